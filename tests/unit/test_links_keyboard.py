"""Typing into the terminal that started the emulator, for processes that own the terminal and other processes."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

import fcu_emulator.emulator.errors
from fcu_emulator.emulator.links.stdout import has_keyboard

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="job control is a POSIX matter")

DEADLINE_S = 30.0
SOURCES = Path(fcu_emulator.emulator.errors.__file__).parents[1]

PRELUDE = """
import os, select, signal, sys, time
terminal = os.open(sys.argv[1], os.O_RDWR)   # a session's first terminal becomes its controlling one
import fcntl, termios
fcntl.ioctl(terminal, termios.TIOCSCTTY, 0)
os.dup2(terminal, 0)
from fcu_emulator.emulator.links import open_link
from fcu_emulator.emulator.links.stdout import has_keyboard
"""
ECHO = """
link = open_link('stdout')
link.send(link.announce()[0].encode() + b'\\n')
got, give_up_s = b'', time.monotonic() + 30.0
while not got.endswith(b'\\n') and time.monotonic() < give_up_s:
    got += link.receive(1 << 20)
link.send(b'got ' + got)
link.flush(10.0)
link.close()
"""
BACKGROUND = """
child = os.fork()
if child == 0:
    os.setpgid(0, 0)
    os._exit(has_keyboard())
_, status = os.waitpid(child, 0)
print(has_keyboard(), os.waitstatus_to_exitcode(status))
"""
# A shell's part: the board's job goes to the background while it waits for a key, and comes back.
SENT_TO_BACKGROUND = """
signal.signal(signal.SIGTTOU, signal.SIG_IGN)
typing = int(sys.argv[2])
told, tell = os.pipe()
board = os.fork()
if board == 0:
    os.setpgid(0, 0)
    os.tcsetpgrp(0, os.getpid())
    link = open_link('stdout')
    os.write(tell, b'.')
    got, give_up_s = b'', time.monotonic() + 30.0
    while got.count(b'\\n') < 2 and time.monotonic() < give_up_s:
        if data := link.receive(1 << 20):
            got += data
            os.write(tell, b'.')
    os._exit(0 if got == b'one\\ntwo\\n' else 1)
os.read(told, 1)
os.tcsetpgrp(0, os.getpid())
os.write(typing, b'one\\n')
select.select([told], [], [], 1.0)   # the read that was under way ended, and the next one is refused
os.tcsetpgrp(0, board)
os.write(typing, b'two\\n')
_, status = os.waitpid(board, os.WUNTRACED)
print('stopped' if os.WIFSTOPPED(status) else os.waitstatus_to_exitcode(status))
if os.WIFSTOPPED(status):
    os.kill(board, signal.SIGKILL)
"""


@pytest.fixture
def terminal() -> Iterator[tuple[int, str]]:
    """Return the master side of a new terminal, and the path of the other side."""
    master, slave = os.openpty()
    path = os.ttyname(slave)
    try:
        yield master, path
    finally:
        os.close(slave)
        os.close(master)


def run_in_terminal(script: str, path: str, master: int) -> subprocess.Popen[bytes]:
    return subprocess.Popen(
        [sys.executable, "-c", PRELUDE + script, path, str(master)],
        cwd=SOURCES,
        start_new_session=True,
        pass_fds=[master],
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
    )


def test_typed_line_reaches_board(terminal: tuple[int, str]) -> None:
    master, path = terminal
    os.write(master, b"hello\n")  # waits in the terminal until the process reads
    with run_in_terminal(ECHO, path, master) as process:
        output, errors = process.communicate(timeout=DEADLINE_S)
    assert errors == b""
    assert output == b"serial: on standard output; lines typed here go to the board\ngot hello\n"


def test_background_job_does_not_read_terminal(terminal: tuple[int, str]) -> None:
    master, path = terminal
    with run_in_terminal(BACKGROUND, path, master) as process:
        output, errors = process.communicate(timeout=DEADLINE_S)
    assert errors == b""
    assert output == b"True 0\n"


def test_background_board_reads_keyboard_again_in_foreground(terminal: tuple[int, str]) -> None:
    master, path = terminal
    with run_in_terminal(SENT_TO_BACKGROUND, path, master) as process:
        output, errors = process.communicate(timeout=DEADLINE_S)
    assert errors == b""
    assert output == b"0\n"


def test_terminal_of_another_session_is_not_keyboard(terminal: tuple[int, str]) -> None:
    _, path = terminal
    fd = os.open(path, os.O_RDWR | os.O_NOCTTY)
    try:
        assert os.isatty(fd)
        assert not has_keyboard(fd)
    finally:
        os.close(fd)


def test_pipe_is_not_keyboard() -> None:
    reading_fd, writing_fd = os.pipe()
    try:
        assert not has_keyboard(reading_fd)
    finally:
        os.close(reading_fd)
        os.close(writing_fd)
