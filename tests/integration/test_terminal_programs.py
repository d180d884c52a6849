"""Terminal programs of students with a running board: screen and minicom on a pseudo-terminal.

``test_tcp_link.py`` tests PuTTY's plink; all these files test pyserial.
"""

from __future__ import annotations

import contextlib
import os
import shutil
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from fcu_emulator import Board
from fcu_emulator.emulator.links import ByteLink, open_link
from fcu_emulator.emulator.links.runner import Runner

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="Windows has no pseudo-terminals")
DEADLINE_S = 30.0


class Running:
    """The template's board on one link, in real time, until the ``with`` block ends."""

    def __init__(self, link: ByteLink) -> None:
        self.board = Board(firmware="lab3")
        self._runner = Runner(self.board, [link], None, 1.0)
        self._thread = threading.Thread(target=self._run)

    def __enter__(self) -> Running:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._runner.stop()
        self._thread.join(DEADLINE_S)

    def _run(self) -> None:
        with self.board:  # firmware in Python ends in the thread in which it ran
            self._runner.run()

    def typed(self) -> int:
        """Return the number of received bytes. The lab's firmware reads none, so all except the first are overruns."""
        return self.board.terminal.uart.rx_lost + self.board.terminal.uart.rxne


@pytest.fixture
def port(tmp_path: Path) -> Path:
    return tmp_path / "board"


@pytest.fixture
def running(port: Path) -> Iterator[Running]:
    with contextlib.closing(open_link(f"pty:{port}")) as link, Running(link) as running:
        yield running


def wait_for(said: str) -> Iterator[None]:
    """Repeat a loop until a deadline."""
    give_up_s = time.monotonic() + DEADLINE_S
    while True:
        assert time.monotonic() < give_up_s, said
        yield
        time.sleep(0.02)


@pytest.mark.skipif(shutil.which("screen") is None, reason="screen is not installed")
def test_screen_program_shows_and_sends_text(running: Running, port: Path, tmp_path: Path) -> None:
    log, name = tmp_path / "screenlog", f"fcu-test-{os.getpid()}"
    socket_folder = tmp_path / "screens"
    socket_folder.mkdir(mode=0o700)
    environment = {**os.environ, "SCREENDIR": str(socket_folder), "TERM": "vt100"}

    def screen(*arguments: str) -> None:
        subprocess.run(["screen", *arguments], env=environment, check=True, timeout=DEADLINE_S)

    (tmp_path / "rc").write_text("logfile flush 0\n", encoding="utf-8")
    screen("-c", str(tmp_path / "rc"), "-dmS", name, "-L", "-Logfile", str(log), str(port), "115200")
    try:
        for _ in wait_for("screen has not shown the board's text"):
            if log.exists() and b"LAB3 Init..." in log.read_bytes():
                break
        screen("-S", name, "-X", "stuff", "hello")
        for _ in wait_for("what was typed into screen has not arrived"):
            if running.typed() == 5:
                break
    finally:
        screen("-S", name, "-X", "quit")


@pytest.mark.skipif(shutil.which("minicom") is None, reason="minicom is not installed")
def test_minicom_shows_and_sends_text(running: Running, port: Path, tmp_path: Path) -> None:
    import termios

    ours, its = os.openpty()
    termios.tcsetwinsize(its, (24, 80))
    environment = {**os.environ, "TERM": "vt100", "HOME": str(tmp_path)}
    command = ["minicom", "-D", str(port), "-b", "115200", "-o"]
    shown = bytearray()
    with subprocess.Popen(command, env=environment, stdin=its, stdout=its, start_new_session=True) as minicom:
        os.close(its)
        os.set_blocking(ours, False)
        try:
            for _ in wait_for("minicom has not shown the board's text"):
                with contextlib.suppress(BlockingIOError):
                    shown += os.read(ours, 4096)
                if b"STEVAL-FCU001V1" in shown:
                    break
            os.write(ours, b"hello")
            for _ in wait_for("what was typed into minicom has not arrived"):
                if running.typed() == 5:
                    break
        finally:
            minicom.kill()
            os.close(ours)
