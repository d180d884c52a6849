"""``fcu terminal`` with a running board: it finds the board, and works with pipes, consoles and Windows consoles."""

from __future__ import annotations

import contextlib
import json
import os
import socket
import stat
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from fcu_emulator.emulator.cli.terminal import key, open_port
from fcu_emulator.emulator.errors import InputError, LinkError
from fcu_emulator.emulator.links.control import ControlServer, Message, running_boards, the_running_board
from fcu_emulator.emulator.links.tcp import TcpLink
from tests.support.words import Words

ALL_BYTES = bytes(range(256))
DEADLINE_S = 30.0
TERMINAL = [sys.executable, "-m", "fcu_emulator", "terminal"]


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return a runtime folder for this test."""
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    monkeypatch.setenv("LOCALAPPDATA", str(tmp_path))
    return tmp_path / "fcu-emulator"


@contextlib.contextmanager
def served(link: TcpLink, door: ControlServer | None = None) -> Iterator[bytearray]:
    """Serve a board in a thread, and record the input that it receives."""
    typed, over = bytearray(), threading.Event()

    def run() -> None:
        while not over.wait(0.002):
            link.send(b"")
            typed.extend(link.receive(1 << 20))
            if door:
                door.serve()

    thread = threading.Thread(target=run)
    thread.start()
    try:
        yield typed
    finally:
        over.set()
        thread.join(DEADLINE_S)


@contextlib.contextmanager
def running_control_server(*serial: str, name: str = "lab3") -> Iterator[ControlServer]:
    def answer(message: Message) -> dict[str, object]:
        if message.get("wrong"):
            raise InputError("that is wrong")
        return {"heard": dict(message)}

    with contextlib.closing(ControlServer(name, serial, answer)) as door:
        over = threading.Event()

        def run() -> None:
            while not over.wait(0.002):
                door.serve()

        thread = threading.Thread(target=run)
        thread.start()
        try:
            yield door
        finally:
            over.set()
            thread.join(DEADLINE_S)


def wait_until(condition) -> None:
    give_up_s = time.monotonic() + DEADLINE_S
    while not condition():
        assert time.monotonic() < give_up_s
        time.sleep(0.005)


# -- finding the board --------------------------------------------------------------------------------------


def test_running_board_is_found_and_answers(folder: Path) -> None:
    with running_control_server("tcp:4001", "/dev/pts/9") as door:
        board = the_running_board()
        assert board.serial == ("tcp:4001", "/dev/pts/9")
        assert (board.name, board.process) == ("lab3", os.getpid())
        assert board.ask({"a": 1}, {"wrong": True}) == [{"heard": {"a": 1}}, {"error": "that is wrong"}]
        (file,) = folder.iterdir()
        if sys.platform != "win32":
            assert stat.S_IMODE(file.stat().st_mode) == 0o600
        door.close()
    assert list(folder.iterdir()) == []
    with pytest.raises(InputError, match=r"fcu run --serial port$") as refused:
        the_running_board()
    assert refused.value.kind == "no_board"


def test_several_running_boards_require_board_option() -> None:
    with running_control_server(name="lab3"), running_control_server(name="mine.elf"):
        with pytest.raises(
            InputError, match=r"^2 boards run: \d+ \(lab3\), \d+ \(mine.elf\); .* --board PROCESS$"
        ):
            the_running_board()
        with pytest.raises(InputError, match=r"\b1\b") as refused:
            the_running_board("1")
        assert refused.value.kind == "no_such_process"


def test_file_of_killed_board_is_removed(folder: Path) -> None:
    with running_control_server():
        (living,) = folder.iterdir()
        known = json.loads(living.read_text(encoding="utf-8"))
        with socket.socket() as reserved:
            reserved.bind(("127.0.0.1", 0))  # nobody listens
            dead = {**known, "port": reserved.getsockname()[1]}
            (folder / "board-1-1.json").write_text(json.dumps(dead), encoding="utf-8")
            (folder / "board-2-2.json").write_text("no JSON", encoding="utf-8")
            (folder / "board-3-3.json").write_text("{}", encoding="utf-8")
            assert len(running_boards()) == 1
        assert list(folder.iterdir()) == [living]


@pytest.mark.parametrize(
    "said",
    [
        b'{"token": "wrong"}\n{"a": 1}\n',
        b'{"a": 1}\n',
        b"GET / HTTP/1.1\r\n\r\n",
        b"[1]\n",
        b"[" * 60_000 + b"\n",
        b'{"token": 1}\n',
        b"x" * 100_000,
        b"\xff\xfe\n",
    ],
)
def test_caller_without_token_is_disconnected(said: bytes) -> None:
    with running_control_server():
        (board,) = running_boards()
        with socket.create_connection(("127.0.0.1", board.port), DEADLINE_S) as stranger:
            heard = b""
            with contextlib.suppress(OSError):  # reset while we were speaking
                stranger.sendall(said)
                heard = stranger.recv(100)
            assert heard == b""
        assert board.ask({"a": 1}) == [{"heard": {"a": 1}}]


def test_invalid_message_with_token_gets_error() -> None:
    with running_control_server():
        (board,) = running_boards()
        with socket.create_connection(("127.0.0.1", board.port), DEADLINE_S) as connection:
            connection.sendall(json.dumps({"token": board.token}).encode() + b"\n}{\n\n[]\n")
            with connection.makefile("rb") as lines:
                answers = [json.loads(lines.readline()) for _ in range(4)]
        assert answers[0] == {"ok": True}
        assert ["invalid message" in one.get("error", "") for one in answers[1:]] == [True, True, True]


def test_many_silent_connections_do_not_block_client() -> None:
    with running_control_server():
        (board,) = running_boards()
        with contextlib.ExitStack() as stack:
            for _ in range(20):
                stack.enter_context(socket.create_connection(("127.0.0.1", board.port), DEADLINE_S))
            assert board.ask({"a": 1}) == [{"heard": {"a": 1}}]


# -- pipes: bytes as they are -------------------------------------------------------------------------------


def test_all_byte_values_pass_between_pipes_and_board(words: Words) -> None:
    with contextlib.closing(TcpLink(0)) as link:
        link.send(ALL_BYTES * 100)
        with (
            served(link) as typed,
            subprocess.Popen(
                [*TERMINAL, link.address],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=subprocess.PIPE,
            ) as terminal,
        ):
            assert terminal.stdin is not None
            assert terminal.stdout is not None
            assert terminal.stderr is not None
            assert terminal.stdout.read(25_600) == ALL_BYTES * 100
            terminal.stdin.write(ALL_BYTES * 100)
            terminal.stdin.close()
            wait_until(lambda: len(typed) == 25_600)
            assert typed == ALL_BYTES * 100
            link.flush(DEADLINE_S)
            link.close()
            words("terminal", terminal.stderr.read().decode().strip())
            assert terminal.wait(DEADLINE_S) == 0


def test_terminal_without_argument_uses_running_board() -> None:
    with contextlib.closing(TcpLink(0)) as link, running_control_server(link.address):
        name, port = open_port(None)
        assert name == link.address
        port.close()


def test_board_without_port_is_read_through_control_socket() -> None:
    with running_control_server():
        name, port = open_port(None)
        assert name.startswith("the board lab3 (process ")
        with contextlib.closing(port):
            assert port.read() is None


@pytest.mark.parametrize(
    ("where", "message"),
    [
        ("tcp:x", "65535"),
        ("/nowhere/at/all", "/nowhere/at/all"),
        ("nonsense://x", "invalid URL"),
    ],
)
def test_unusable_address_is_refused_in_one_line(where: str, message: str) -> None:
    with pytest.raises(LinkError) as caught:
        open_port(where)
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)


def test_error_for_unserved_port_shows_run_command() -> None:
    with socket.socket() as reserved:
        reserved.bind(("127.0.0.1", 0))
        number = reserved.getsockname()[1]
        with pytest.raises(LinkError, match=f"^tcp:{number}: .* fcu run --serial tcp:{number}$"):
            open_port(f"tcp:{number}")


def test_run_and_terminal_find_each_other() -> None:
    run = [sys.executable, "-m", "fcu_emulator", "run", "lab3", "--serial", "tcp:0"]
    with subprocess.Popen(run, stderr=subprocess.PIPE) as board:
        assert board.stderr is not None
        while b"open it with one of" not in board.stderr.readline():
            pass
        assert board.stderr.readline().startswith(b"fcu:   fcu terminal tcp:")
        wait_until(running_boards)
        with subprocess.Popen(TERMINAL, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE) as terminal:
            assert terminal.stdout is not None
            assert terminal.stdout.read(15) == b"STEVAL-FCU001V1"
            board.terminate()
            assert terminal.wait(DEADLINE_S) == 0


# -- consoles -----------------------------------------------------------------------------------------------


@pytest.mark.skipif(sys.platform == "win32", reason="needs a pseudo-terminal as its console")
def test_console_sends_keys_immediately_and_is_restored() -> None:
    import termios

    ours, its = os.openpty()
    before = termios.tcgetattr(its)
    with (
        contextlib.closing(TcpLink(0)) as link,
        served(link) as typed,
        subprocess.Popen(
            [*TERMINAL, link.address], stdin=its, stdout=its, stderr=its, start_new_session=True
        ) as terminal,
    ):
        shown = b""
        while b"Ctrl-]" not in shown:
            shown += os.read(ours, 100)
        os.write(ours, b"a\x03\x1a\x04\xff")  # Ctrl-C, Ctrl-Z and Ctrl-D are the board's
        wait_until(lambda: typed == b"a\x03\x1a\x04\xff")
        link.send(b"one\ntwo")
        while b"two" not in shown:
            shown += os.read(ours, 100)
        assert b"one\r\ntwo" in shown  # no staircase
        os.write(ours, b"z\x1dnot this")
        assert terminal.wait(DEADLINE_S) == 0
        wait_until(lambda: typed.endswith(b"z"))
        assert termios.tcgetattr(its) == before
    os.close(ours)
    os.close(its)


@pytest.mark.skipif(sys.platform == "win32", reason="needs a pseudo-terminal as its console")
def test_killed_terminal_restores_console() -> None:
    import termios

    ours, its = os.openpty()
    before = termios.tcgetattr(its)
    with (
        contextlib.closing(TcpLink(0)) as link,
        served(link),
        subprocess.Popen(
            [*TERMINAL, link.address], stdin=its, stdout=its, stderr=its, start_new_session=True
        ) as terminal,
    ):
        shown = b""
        while b"Ctrl-]" not in shown:
            shown += os.read(ours, 100)
        wait_until(lambda: termios.tcgetattr(its) != before)
        terminal.terminate()
        assert terminal.wait(DEADLINE_S) == 0
        assert termios.tcgetattr(its) == before
    os.close(ours)
    os.close(its)


class WindowsKeys:
    """Replacement for ``msvcrt.getwch`` and ``kbhit``, with the codes of keys in the order of the console."""

    def __init__(self, *keys: str) -> None:
        self._keys = [list(one) for one in keys]

    def getwch(self) -> str:
        while not self._keys[0]:
            self._keys.pop(0)
        return self._keys[0].pop(0)

    def kbhit(self) -> bool:
        return bool(self._keys[0])


@pytest.mark.parametrize(
    ("pressed", "sent"),
    [
        ("a", b"a"),
        ("\x1d", b"\x1d"),
        ("\r", b"\r"),
        ("\xe0H", b"\x1b[A"),
        ("\x00K", b"\x1b[D"),
        ("\xe0", "à".encode()),  # a letter of its own
        ("\ud83d\ude00", "😀".encode()),
        ("\ud83d", "�x".encode()),  # half a character, and what came after it
    ],
)
def test_key_pressed_on_windows_is_sent_as_bytes(pressed: str, sent: bytes) -> None:
    keys = WindowsKeys("\x00;", pressed, "x")  # F1 first, which a serial line does not know
    assert key(keys.getwch, keys.kbhit) == sent
