"""Standard output as the board's terminal: a pipe that blocks, closes, or has a slow reader."""

from __future__ import annotations

import contextlib
import io
import os
import random
import re
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

import fcu_emulator.emulator.errors
from fcu_emulator.emulator.errors import LinkError
from fcu_emulator.emulator.links import StdoutLink, stdout
from tests.support.words import Words

ALL_BYTES = bytes(range(256))
DEADLINE_S = 30.0
MIB = 1024 * 1024
SOURCES = Path(fcu_emulator.emulator.errors.__file__).parents[1]


class Pipe:
    """Standard output is replaced by a pipe, and the test holds the reading end."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.reading_fd, writing_fd = os.pipe()
        self._stdout = io.TextIOWrapper(os.fdopen(writing_fd, "wb"), newline="\r\n")
        monkeypatch.setattr(sys, "stdout", self._stdout)
        monkeypatch.setattr(os, "isatty", lambda fd: False)  # the terminal of who runs the tests stays theirs
        self.link = StdoutLink()

    def read_exactly(self, count: int) -> bytes:
        got = bytearray()
        while len(got) < count and (data := os.read(self.reading_fd, count - len(got))):
            got += data
        return bytes(got)

    def hang_up(self) -> None:
        if self.reading_fd >= 0:
            os.close(self.reading_fd)
            self.reading_fd = -1

    def close(self) -> None:
        self.hang_up()  # releases a blocked writer
        self.link.flush(DEADLINE_S)
        self.link.close()
        self._stdout.close()


@pytest.fixture
def pipe(monkeypatch: pytest.MonkeyPatch) -> Iterator[Pipe]:
    with contextlib.closing(Pipe(monkeypatch)) as pipe:
        yield pipe


def test_all_byte_values_pass_without_newline_translation(pipe: Pipe) -> None:
    pipe.link.send(ALL_BYTES)
    assert pipe.read_exactly(256) == ALL_BYTES


def test_each_send_is_visible_immediately(pipe: Pipe) -> None:
    for line in (b"one\n", b"two"):
        pipe.link.send(line)
        assert pipe.read_exactly(len(line)) == line


def test_earlier_text_is_printed_before_link_output(monkeypatch: pytest.MonkeyPatch) -> None:
    memory = io.TextIOWrapper(io.BytesIO())
    monkeypatch.setattr(sys, "stdout", memory)
    memory.write("before ")
    link = StdoutLink()
    link.send(b"after")
    link.flush(DEADLINE_S)
    link.close()
    memory.seek(0)
    assert memory.read() == "before after"


def test_slow_reader_gets_everything_at_flush(pipe: Pipe) -> None:
    data = random.Random(4).randbytes(500_000)
    got = bytearray()
    reader = threading.Thread(target=lambda: got.extend(pipe.read_exactly(len(data))))
    pipe.link.send(data)  # more than a pipe holds
    reader.start()
    pipe.link.flush(DEADLINE_S)
    pipe.link.close()
    reader.join(DEADLINE_S)
    assert got == data
    assert pipe.link.report() == []


@pytest.mark.skipif(sys.platform == "win32", reason="Windows pipes always block")
def test_non_blocking_descriptor_loses_nothing(pipe: Pipe) -> None:
    os.set_blocking(sys.stdout.fileno(), False)
    data = random.Random(6).randbytes(200_000)
    pipe.link.send(data)
    assert pipe.read_exactly(len(data)) == data
    pipe.link.flush(DEADLINE_S)
    assert pipe.link.report() == []


def test_blocked_reader_loses_oldest_bytes_beyond_16_mebibytes(pipe: Pipe, words: Words) -> None:
    for _ in range(18):
        pipe.link.send(bytes(MIB))
    (line,) = pipe.link.report()
    assert MIB < int(line.split()[1]) <= 2 * MIB
    assert pipe.link.undelivered() == int(line.split()[1])
    words("run", re.sub(r"\d+", "N", line))


@pytest.mark.skipif(sys.platform == "win32", reason="Windows cannot count what a pipe holds")
def test_flush_times_out_and_close_counts_loss(pipe: Pipe) -> None:
    import fcntl
    import termios

    pipe.link.send(bytes(MIB))
    pipe.link.flush(0.05)
    pipe.link.close()
    (line,) = pipe.link.report()
    in_the_pipe = int.from_bytes(fcntl.ioctl(pipe.reading_fd, termios.FIONREAD, bytes(4)), sys.byteorder)
    assert 0 < in_the_pipe < MIB
    assert line.startswith(f"serial: {MIB - in_the_pipe} bytes lost")


def test_closed_reader_is_reported_once_with_lost_bytes(pipe: Pipe, words: Words) -> None:
    pipe.hang_up()
    pipe.link.send(b"12345")
    pipe.link.flush(DEADLINE_S)
    pipe.link.send(b"678")
    pipe.link.close()
    pipe.link.close()
    pipe.link.send(b"after close")
    (line,) = pipe.link.report()
    assert line.split()[1] == "8"
    words("run", line.rpartition(": ")[0])
    assert pipe.link.reader_gone
    assert pipe.link.undelivered() == 8


def test_process_without_standard_output_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "stdout", None)
    with pytest.raises(LinkError, match="--serial port") as caught:
        StdoutLink()
    assert caught.value.kind == "no_stdout"


def run(script: str, stdin: int = subprocess.DEVNULL) -> subprocess.Popen[bytes]:
    prelude = "import sys\nfrom fcu_emulator.emulator.links import open_link\nlink = open_link('stdout')\n"
    return subprocess.Popen(
        [sys.executable, "-c", prelude + script],
        cwd=SOURCES,
        stdin=stdin,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
    )


def test_interpreter_exits_cleanly_after_reader_closes() -> None:
    script = """
sys.stdin.read()                    # until the reader has left
link.send(b'x' * 100_000)
link.flush(10.0)
sys.stdout.write('printed late')    # what the interpreter would flush at exit
link.close()
sys.stderr.write(link.report()[0])
"""
    with run(script, stdin=subprocess.PIPE) as process:
        assert process.stdout is not None
        process.stdout.close()
        process.stdout = None
        _, errors = process.communicate(timeout=DEADLINE_S)
    (line,) = errors.decode().splitlines()  # its own report, and no complaint of the interpreter's
    assert line.startswith("serial: 100000 bytes lost ")
    assert process.returncode == 0


def test_interpreter_exits_cleanly_while_its_reader_blocks() -> None:
    script = "link.send(b'x' * 1_000_000)\nlink.flush(0.05)\nlink.close()\n"
    with run(script) as process:
        assert process.wait(DEADLINE_S) == 0
        assert process.stderr is not None
        assert process.stderr.read() == b""


def test_piped_standard_input_is_not_read() -> None:
    script = """
assert link.receive(1 << 20) == b''
link.send(sys.stdin.buffer.read())
assert link.receive(1 << 20) == b''
link.flush(10.0)
link.close()
"""
    with run(script, stdin=subprocess.PIPE) as process:
        output, errors = process.communicate(b"a recording\r\n", timeout=DEADLINE_S)
    assert errors == b""
    assert output == b"a recording\r\n"


def test_failed_keyboard_read_is_retried(monkeypatch: pytest.MonkeyPatch) -> None:
    """The process was in the background, where a read of its terminal fails, and then in the foreground again."""
    ended = threading.Event()
    answers = iter((OSError("in the background"), OSError("still"), b"typed", b""))

    def read(fd: int, most: int) -> bytes:
        answer = next(answers)
        if isinstance(answer, OSError):
            raise answer
        if not answer:
            ended.set()
        return answer

    monkeypatch.setattr(stdout, "RETRY_S", 0.0)
    monkeypatch.setattr(os, "read", read)
    keyboard = stdout.Keyboard(99)
    assert ended.wait(DEADLINE_S)
    assert keyboard.read(3) == b"typ"
    assert keyboard.read(100) == b"ed"


def test_announcement_omits_typing_without_keyboard(pipe: Pipe, words: Words) -> None:
    (line,) = pipe.link.announce()
    words("run", line)


def test_flush_with_nothing_queued_returns_immediately(pipe: Pipe) -> None:
    started_s = time.monotonic()
    pipe.link.flush(6 * DEADLINE_S)
    assert time.monotonic() - started_s < DEADLINE_S
