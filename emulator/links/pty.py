"""The serial port as a pseudo-terminal, which terminal programs open like a USB adapter.

Decision: the pseudo-terminal keeps text until the first reader opens it, because a virtual board
has no reset button.

Decision: the pseudo-terminal sends no data to a new reader until this reader has flushed its input, as pyserial
does after opening, but at most for ``HOLD_S``. If a program opens the port for a shorter time, as
``stty`` does, it does not count as a reader.

Decision: after a reader of the pseudo-terminal has left, text is lost as on a real wire.

Decision: the emulator never keeps the slave side of the pseudo-terminal open. Therefore ``poll``
reports POLLHUP if and only if no process has this side open (pty(7)). Packet mode (ioctl_tty(2),
TIOCPKT) reports flushes in a control byte before all data.
"""

from __future__ import annotations

import contextlib
import errno
import fcntl
import os
import select
import struct
import sys
import termios
import time
import tty
from collections.abc import Iterator
from pathlib import Path

from fcu_emulator.emulator.errors import LinkError
from fcu_emulator.emulator.links import programs
from fcu_emulator.emulator.links.byte_link import Backlog, Patience, losses
from fcu_emulator.emulator.links.port_name import PortName, claim_port

assert sys.platform != "win32"  # this test tells mypy which functions the system has

# -- The link -----------------------------------------------------------------------------------------------


FIRST_LIMIT = 1024 * 1024
"""Bytes stored before the first reader opens the port."""
BACKLOG_LIMIT = 16 * 1024 * 1024
"""Bytes stored while a reader does not read."""
INBOX_LIMIT = 64 * 1024
"""Maximum number of a reader's bytes that wait here; further bytes wait in the kernel."""
WRITE_BUDGET = 256 * 1024
"""Approximate number of bytes written per call, so that a fast reader does not delay the board."""
HOLD_S = 0.4
SETTLE_S = 0.05
POLL_S = 0.005
EXCLUSIVE_GRACE_S = 0.3
"""Time that a reader gets at the end of a run if its queue cannot be checked."""


class PtyLink:
    """A pseudo-terminal named ``link_path``, or the first free ttyFCU<n>. Raises LinkError."""

    def __init__(self, link_path: Path | None = None) -> None:
        self._name = claim_port(link_path)
        try:
            self._device = _open_device(self._name)
        except LinkError:
            self._name.release()
            raise
        self._backlog = Backlog(FIRST_LIMIT)
        self._inbox = Backlog(INBOX_LIMIT)
        self._present = False  # a process has the port open
        self._hold_until_s = 0.0  # the reader gets no data before this time
        self._serving = False  # a reader is present, and ``_hold_until_s`` is over
        self._had_reader = False  # a reader is or was present
        self._lost_absent = 0
        self._lost_slow = 0
        self._closed = False

    @property
    def path(self) -> Path:
        return self._name.path

    @property
    def address(self) -> str:
        return str(self.path)

    def send(self, data: bytes) -> None:
        if self._closed:
            return
        self._follow_reader()
        if self._present:
            self._lost_slow += self._backlog.put(data)
        elif self._had_reader:
            self._lost_absent += len(data)
        else:
            self._lost_absent += self._backlog.put(data)
        self._write()

    def receive(self, most: int) -> bytes:
        if self._closed:
            return b""
        self._follow_reader()
        self._write()
        return self._inbox.take(most)

    def flush(self, timeout_s: float) -> None:
        if self._closed:
            return
        patience = Patience(timeout_s)
        while (left := self._untaken()) and (wait_s := patience.wait_s(left)):
            time.sleep(min(POLL_S, wait_s))
        if self._present and self._device.unread() is None:
            time.sleep(min(EXCLUSIVE_GRACE_S, patience.wait_s(0)))

    def close(self) -> None:
        if self._closed:
            return
        self._follow_reader()
        if self._present:
            self._lost_slow += len(self._backlog) + (self._device.unread() or 0)
        else:
            self._lost_absent += len(self._backlog)
        self._closed = True
        self._name.release()
        self._device.close()

    def announce(self) -> list[str]:
        return [
            f"serial: {self.path} ({self._device.path}), 115200 8N1; open it with one of",
            *(f"  {command}" for command in programs.for_pty(self.path)),
        ]

    def report(self) -> list[str]:
        return losses(
            self.path,
            (self._lost_absent, "while no program had it open"),
            (self._lost_slow, "because its reader was too slow"),
        )

    def undelivered(self) -> int:
        return self._lost_slow

    def _follow_reader(self) -> None:
        flushed = self._read()
        if not self._device.has_reader():
            if self._present:
                self._reader_left()
            return
        now_s = time.monotonic()
        if not self._present:
            self._present = True
            self._hold_until_s = now_s + HOLD_S
            self._backlog.limit = BACKLOG_LIMIT
        if self._serving:
            return
        if flushed:
            self._hold_until_s = now_s + SETTLE_S
        if now_s >= self._hold_until_s:
            self._serving = self._had_reader = True

    def _read(self) -> bool:
        """Fill the inbox. Return whether the reader flushed its input."""
        flushed_any = False
        while len(self._inbox) <= INBOX_LIMIT - CHUNK:  # stop before the inbox exceeds its limit
            data, flushed = self._device.read()
            flushed_any |= flushed
            self._inbox.put(data)
            if not data and not flushed:
                break
        return flushed_any

    def _reader_left(self) -> None:
        self._present = self._serving = False
        if self._had_reader:
            self._lost_absent += len(self._backlog.take())
        else:
            self._backlog.limit = FIRST_LIMIT
        unread = self._device.recycle()
        if unread is None:
            self._renew_device()
        else:
            self._lost_absent += unread

    def _renew_device(self) -> None:
        """Create a device for ``link_path``, because the old device is permanently locked."""
        self._read()  # the reader may have sent bytes after the latest read and before closing the port
        with contextlib.suppress(LinkError):  # the port stays locked, but the board continues
            fresh = _open_device(self._name)
            self._device.close()
            self._device = fresh

    def _write(self) -> None:
        budget = WRITE_BUDGET
        while self._serving and self._backlog and budget > 0:
            count = self._device.write(self._backlog.peek(CHUNK))
            if not count:
                return
            self._backlog.drop(count)
            budget -= count

    def _untaken(self) -> int:
        self._follow_reader()
        self._write()
        if not self._present:
            return 0
        return len(self._backlog) + (self._device.unread() or 0)


def _open_device(name: PortName) -> PtyDevice:
    """Open a device and point ``name`` to it. Raises LinkError."""
    try:
        device = PtyDevice()
    except OSError as error:
        raise LinkError(f"cannot open --serial pty: {error.strerror}; use --serial tcp") from error
    try:
        name.point_to(device.path)
    except LinkError:
        device.close()
        raise
    return device


# -- The device, as its master uses it ----------------------------------------------------------------------


CHUNK = 4096
"""Bytes in one read."""


class PtyDevice:
    """A raw pseudo-terminal. Readers open ``path``. Raises OSError if the system has none left."""

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
        return not any(events & select.POLLHUP for _, events in self._poll.poll(0))

    def read(self) -> tuple[bytes, bool]:
        """Return bytes of the reader, and whether it flushed its input."""
        try:
            packet = os.read(self._master, CHUNK)
        except OSError as error:  # EAGAIN: no data; EIO: no data, and no process has the port open
            if error.errno not in (errno.EAGAIN, errno.EIO):
                raise
            return b"", False
        control = packet[0] if packet else 0
        if control == termios.TIOCPKT_DATA:
            return packet[1:], False
        return b"", bool(control & termios.TIOCPKT_FLUSHREAD)

    def write(self, data: bytes) -> int:
        try:
            return os.write(self._master, data)
        except BlockingIOError:
            return 0

    def unread(self) -> int | None:
        """Return a lower bound for the number of unread bytes, or None if TIOCEXCL locks the port.

        The result 0 is exact.
        """
        try:
            with self._slave() as slave:
                # poll() first: it moves pending bytes into the queue that FIONREAD counts
                waiting = select.poll()
                waiting.register(slave, select.POLLIN)
                waiting.poll(0)
                answer: bytes = fcntl.ioctl(slave, termios.FIONREAD, bytes(4))
        except OSError:
            return None
        return int(struct.unpack("i", answer)[0])

    def recycle(self) -> int | None:
        """Discard a former reader's settings and unread bytes, and return the number of these bytes.

        Return None if the device cannot be opened. On Linux, TIOCEXCL of ``screen`` stays set.
        """
        try:
            with self._slave() as slave:
                _make_raw(slave)
                return _read_all(slave)
        except OSError:
            return None

    def close(self) -> None:
        os.close(self._master)

    @contextlib.contextmanager
    def _slave(self) -> Iterator[int]:
        slave = os.open(self.path, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
        try:
            yield slave
        finally:
            os.close(slave)


def _make_raw(slave: int) -> None:
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
