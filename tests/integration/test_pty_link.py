"""The pseudo-terminal link with real readers: pyserial, as students use it, and programs like ``cat``."""

from __future__ import annotations

import contextlib
import os
import random
import shutil
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
import serial

from fcu_emulator.emulator.links import ByteLink, byte_link, open_link
from tests.support.words import Words

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="Windows has no pseudo-terminals")

ALL_BYTES = bytes(range(256))
BOOT = b"STEVAL-FCU001V1 FH rev.1.0 - Sep 2017\n\n"  # the lab's text
DEADLINE_S = 30.0
MIB = 1024 * 1024


@pytest.fixture
def port(tmp_path: Path) -> Path:
    return tmp_path / "board"


@pytest.fixture
def link(port: Path) -> Iterator[ByteLink]:
    link = open_link(f"pty:{port}")
    yield link
    link.close()


@contextlib.contextmanager
def terminal(port: Path) -> Iterator[serial.Serial]:
    """Open a terminal program: pyserial sets attributes and flushes its input."""
    with serial.Serial(str(port), 115200, timeout=0) as device:
        yield device


@contextlib.contextmanager
def plain_file(port: Path) -> Iterator[int]:
    """Open a reader that does not flush its input, such as ``cat``."""
    fd = os.open(port, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
    try:
        yield fd
    finally:
        os.close(fd)


def read_plain(fd: int) -> bytes:
    try:
        return os.read(fd, 4096)
    except BlockingIOError:
        return b""


def collect(link: ByteLink, read: Callable[[], bytes], count: int) -> bytes:
    """Run the board's loop until ``read`` has returned ``count`` bytes."""
    got = bytearray()
    give_up_s = time.monotonic() + DEADLINE_S
    while len(got) < count:
        assert time.monotonic() < give_up_s, f"{len(got)} of {count} bytes came"
        link.send(b"")
        got += read()
    return bytes(got)


def receive(link: ByteLink, count: int) -> bytes:
    return collect(link, lambda: link.receive(1 << 20), count)


def serve(link: ByteLink, device: serial.Serial) -> None:
    """Serve the link until the reader receives the board's output."""
    link.send(b"!")
    assert collect(link, lambda: device.read(4096), 1)[-1:] == b"!"


def test_all_byte_values_reach_reader_unchanged(link: ByteLink, port: Path) -> None:
    with terminal(port) as device:
        link.send(ALL_BYTES)
        assert collect(link, lambda: device.read(4096), 256) == ALL_BYTES


def test_all_byte_values_reach_board_without_echo(link: ByteLink, port: Path) -> None:
    with plain_file(port) as fd:
        os.write(fd, ALL_BYTES)
        assert receive(link, 256) == ALL_BYTES
        link.send(b"!")
        assert collect(link, lambda: read_plain(fd), 1) == b"!"


def test_bytes_sent_before_closing_arrive(link: ByteLink, port: Path) -> None:
    with plain_file(port) as fd:
        os.write(fd, b"reset\r")
    assert receive(link, 6) == b"reset\r"


def test_excess_input_waits_in_kernel(link: ByteLink, port: Path) -> None:
    data = random.Random(5).randbytes(300_000)
    with plain_file(port) as fd:
        got, written, turn = bytearray(), 0, 0
        give_up_s = time.monotonic() + DEADLINE_S
        while len(got) < len(data):
            assert time.monotonic() < give_up_s
            with contextlib.suppress(BlockingIOError):
                written += os.write(fd, data[written : written + 4096])
            link.send(b"")
            turn += 1
            if turn % 40 == 0:  # the board asks too seldom: 40 writes are more than the inbox takes
                got += link.receive(1 << 20)
        assert got == data


def test_terminal_opened_late_shows_boot_text(link: ByteLink, port: Path) -> None:
    link.send(BOOT)
    with terminal(port) as device:
        assert collect(link, lambda: device.read(4096), len(BOOT)) == BOOT


def test_late_reader_without_flush_gets_boot_text(link: ByteLink, port: Path) -> None:
    link.send(BOOT)
    with plain_file(port) as fd:
        assert collect(link, lambda: read_plain(fd), len(BOOT)) == BOOT


def test_flush_after_noticed_opening_keeps_text(link: ByteLink, port: Path) -> None:
    link.send(BOOT)
    with plain_file(port):
        link.send(b"")  # the board sees a reader that has not flushed yet
        with terminal(port) as device:
            assert collect(link, lambda: device.read(4096), len(BOOT)) == BOOT


def test_second_flush_during_setup_keeps_text(link: ByteLink, port: Path) -> None:
    link.send(BOOT)
    with terminal(port) as device:
        link.send(b"")  # the board sees the first flush
        device.reset_input_buffer()
        assert collect(link, lambda: device.read(4096), len(BOOT)) == BOOT


def test_briefly_opened_port_has_no_reader(link: ByteLink, port: Path) -> None:
    link.send(BOOT)
    with plain_file(port):
        link.send(b"")  # noticed, and gone again before anything was handed over: stty
    link.send(b"")
    with terminal(port) as device:
        assert collect(link, lambda: device.read(4096), len(BOOT)) == BOOT


def only_report(link: ByteLink, port: Path) -> str:
    """Return the only line of a link's report, with a name for the port."""
    (line,) = link.report()
    return line.replace(str(port), "PORT")


def test_newest_mebibyte_is_kept_without_reader(link: ByteLink, port: Path, words: Words) -> None:
    with plain_file(port):
        link.send(b"")  # a glance that is no reader
    data = random.Random(1).randbytes(5_000_000)
    for start in range(0, len(data), 10_000):
        link.send(data[start : start + 10_000])
    told = only_report(link, port)
    assert told.count(f" {len(data) - MIB} ") == 1
    words("run", told)
    with terminal(port) as device:
        assert collect(link, lambda: device.read(65536), MIB) == data[-MIB:]


def test_slow_reader_loses_nothing(link: ByteLink, port: Path) -> None:
    data = random.Random(2).randbytes(200_000)
    with terminal(port) as device:
        link.send(data)
        assert collect(link, lambda: device.read(100), len(data)) == data
    assert link.report() == []


def test_stopped_reader_loses_oldest_bytes_beyond_16_mebibytes(
    link: ByteLink, port: Path, words: Words
) -> None:
    with terminal(port) as device:
        serve(link, device)
        for _ in range(18):
            link.send(bytes(MIB))
        told = only_report(link, port)
    lost = told.split()[1]
    assert MIB < int(lost) <= 2 * MIB
    words("run", told.replace(lost, "COUNT"))


def test_reader_may_disconnect_and_reconnect(link: ByteLink, port: Path, words: Words) -> None:
    with terminal(port) as device:
        serve(link, device)
    link.send(b"nobody hears this")
    words("run", only_report(link, port))
    with terminal(port) as device:
        link.send(b"welcome back")
        assert collect(link, lambda: device.read(4096), 12) == b"welcome back"


def test_next_reader_gets_no_old_bytes_or_settings(link: ByteLink, port: Path, words: Words) -> None:
    with terminal(port) as device:
        serve(link, device)
        link.send(bytes(50_000))
    subprocess.run(["stty", "-F", str(port), "cooked", "echo"], check=True)
    link.send(b"")
    with plain_file(port) as fd:
        os.write(fd, ALL_BYTES)
        assert receive(link, 256) == ALL_BYTES
        link.send(ALL_BYTES)
        assert collect(link, lambda: read_plain(fd), 256) == ALL_BYTES
    words("run", only_report(link, port))


@pytest.fixture
def ordinary_user() -> Iterator[Path]:
    """Return a directory, and drop root's rights if necessary, because TIOCEXCL does not stop root."""
    with tempfile.TemporaryDirectory() as directory:
        user = os.geteuid()
        if user == 0:
            os.chown(directory, 65534, 65534)
            os.seteuid(65534)
        try:
            yield Path(directory)
        finally:
            os.seteuid(user)


@pytest.mark.skipif(sys.platform != "linux", reason="elsewhere the last close ends exclusive mode")
def test_port_reopens_after_exclusive_access(ordinary_user: Path) -> None:
    import fcntl
    import termios

    port = ordinary_user / "board"
    link = open_link(f"pty:{port}")
    with contextlib.closing(link):
        with terminal(port) as device:
            fcntl.ioctl(device.fileno(), termios.TIOCEXCL)  # as screen does; on Linux it outlives the program
            serve(link, device)
            link.send(b"to the end")
            started_s = time.monotonic()
            link.flush(0.02)  # cannot see whether all is read, so it gives the reader the time
            assert time.monotonic() - started_s >= 0.02
            assert collect(link, lambda: device.read(4096), 10) == b"to the end"
            device.write(b"bye")
        link.send(b"")
        assert receive(link, 3) == b"bye"
        with terminal(port) as device:
            serve(link, device)


@pytest.mark.skipif(sys.platform != "linux", reason="elsewhere the last close ends exclusive mode")
def test_board_continues_when_port_cannot_be_recreated(ordinary_user: Path) -> None:
    import fcntl
    import termios

    port = ordinary_user / "removed" / "board"
    port.parent.mkdir()
    with contextlib.closing(open_link(f"pty:{port}")) as link:
        with terminal(port) as device:
            serve(link, device)
            fcntl.ioctl(device.fileno(), termios.TIOCEXCL)
            shutil.rmtree(port.parent)
        link.send(b"goes on")
        link.send(b"goes on")
        assert only_report(link, port).split().count("14") == 1
        assert link.undelivered() == 0  # no reader had the port open


def read_until_hung_up(fd: int, got: bytearray) -> None:
    with contextlib.suppress(OSError):  # EIO: hung up
        while data := os.read(fd, 16):
            got.extend(data)


def test_flush_lets_reader_take_everything_before_close(
    link: ByteLink, port: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(byte_link, "STALL_S", 60.0)  # a reader on a busy machine has not gone away
    data = random.Random(3).randbytes(100_000)
    got = bytearray()
    with plain_file(port) as fd:
        os.set_blocking(fd, True)
        reader = threading.Thread(target=read_until_hung_up, args=(fd, got))
        reader.start()
        link.send(data)
        link.flush(DEADLINE_S)
        link.close()
        reader.join(DEADLINE_S)
    assert got == data
    assert link.report() == []


def test_flush_without_reader_returns_immediately(
    link: ByteLink, port: Path, monkeypatch: pytest.MonkeyPatch, words: Words
) -> None:
    monkeypatch.setattr(byte_link, "STALL_S", 6 * DEADLINE_S)
    link.send(BOOT)
    started_s = time.monotonic()
    link.flush(6 * DEADLINE_S)
    assert time.monotonic() - started_s < DEADLINE_S
    link.close()
    words("run", only_report(link, port))


def test_flush_times_out_on_stopped_reader(link: ByteLink, port: Path, words: Words) -> None:
    with terminal(port) as device:
        serve(link, device)
        link.send(b"unread")
        link.flush(0.05)
        link.close()
        words("run", only_report(link, port))


def test_closed_link_is_silent(link: ByteLink) -> None:
    link.close()
    link.close()
    link.send(BOOT)
    link.flush(1.0)
    assert link.receive(1 << 20) == b""
    assert link.report() == []
