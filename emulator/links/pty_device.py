"""One pseudo-terminal, seen from its master side: who has it open, what has been read, what has been flushed.

Decision: the slave side is never held open here. It is opened once when the pair is made and closed again,
whereupon ``poll`` on the master reports POLLHUP exactly while nobody else has it open (pty(7)). Holding it,
as most programs do, would hide a reader's coming and going. A short opening to look at the reader's queue
disturbs nobody.

Packet mode (ioctl_tty(2), TIOCPKT) puts one control byte before everything read and tells of the reader's
flushes.

Tried on Linux. macOS and the BSDs have the same calls; nothing was tried there.
"""

from __future__ import annotations

import contextlib
import errno
import fcntl
import os
import select
import struct
import termios
import tty
from collections.abc import Iterator

CHUNK = 4096
"""The most that one read returns, in bytes."""


class PtyDevice:
    """A raw pseudo-terminal; ``path`` is what a reader opens. Raises OSError if the system has none left."""

    def __init__(self) -> None:
        self._master, slave = os.openpty()
        try:
            self.path = os.ttyname(slave)
            _make_raw(slave)
        finally:
            os.close(slave)
        os.set_blocking(self._master, False)
        fcntl.ioctl(self._master, termios.TIOCPKT, struct.pack("i", 1))
        self._poll = select.poll()
        self._poll.register(self._master, select.POLLIN)

    def has_reader(self) -> bool:
        """Tell whether anybody has the device open."""
        return not any(events & select.POLLHUP for _, events in self._poll.poll(0))

    def read(self) -> tuple[bytes, bool]:
        """Return one piece of what the reader wrote, and whether it flushed its input since the last call."""
        try:
            packet = os.read(self._master, CHUNK)
        except OSError as error:  # EAGAIN: nothing there; EIO: nothing there, and nobody has it open
            if error.errno not in (errno.EAGAIN, errno.EIO):
                raise
            return b"", False
        control = packet[0] if packet else 0
        if control == termios.TIOCPKT_DATA:
            return packet[1:], False
        return b"", bool(control & termios.TIOCPKT_FLUSHREAD)

    def write(self, data: bytes) -> int:
        """Hand ``data`` to the reader's queue and return how many bytes it had room for."""
        try:
            return os.write(self._master, data)
        except BlockingIOError:
            return 0

    def unread(self) -> int | None:
        """Return how many bytes the reader has not taken, None if it lets nobody look (TIOCEXCL).

        At most a page is counted, so this is a lower bound; 0 is exact.
        """
        try:
            with self._slave() as slave:
                # poll() first: it makes the kernel move what is under way into the queue FIONREAD counts.
                waiting = select.poll()
                waiting.register(slave, select.POLLIN)
                waiting.poll(0)
                answer: bytes = fcntl.ioctl(slave, termios.FIONREAD, bytes(4))
        except OSError:
            return None
        return int(struct.unpack("i", answer)[0])

    def recycle(self) -> int | None:
        """After a reader has gone, make the device as new and return how many bytes it had left unread.

        Without this the next reader would find the last one's leftovers and settings. None if the device
        cannot be opened any more: ``screen`` sets TIOCEXCL, which on Linux outlives it.
        """
        try:
            with self._slave() as slave:
                _make_raw(slave)
                return _read_all(slave)
        except OSError:
            return None

    def close(self) -> None:
        """Close the master; a reader is hung up and loses what it has not taken."""
        os.close(self._master)

    @contextlib.contextmanager
    def _slave(self) -> Iterator[int]:
        slave = os.open(self.path, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
        try:
            yield slave
        finally:
            os.close(slave)


def _make_raw(slave: int) -> None:
    """No echo, no line editing, no translation, no flow control; 115200 baud for those who ask."""
    tty.setraw(slave, termios.TCSANOW)
    settings = termios.tcgetattr(slave)
    settings[4] = settings[5] = termios.B115200
    termios.tcsetattr(slave, termios.TCSANOW, settings)
    if hasattr(termios, "TIOCNXCL"):
        fcntl.ioctl(slave, termios.TIOCNXCL)


def _read_all(slave: int) -> int:
    count = 0
    with contextlib.suppress(BlockingIOError):
        while data := os.read(slave, CHUNK):
            count += len(data)
    return count
