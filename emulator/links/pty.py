"""The board's serial port as a pseudo-terminal, which any terminal program opens like a USB serial adapter.

Decision: the pseudo-terminal keeps text until the first reader comes, so that a user who opens the port late
still sees the boot messages. A real board has a reset button for that. Without the kept text a student would
have to restart the emulator and would miss the messages each time.

Decision: the pseudo-terminal holds data back until a new reader has flushed its input and no further flush
came for ``SETTLE_S``. A terminal program flushes its input right after opening (pyserial: open, tcsetattr,
tcflush), which would destroy data already in the kernel. For programs that do not flush (``cat``), data is
held for ``HOLD_S`` after the opening. An opening shorter than that (``stty``, a modem prober) does not count
as a reader.

Decision: after a reader of the pseudo-terminal has left, text is lost as on a real wire. Keeping it was
rejected, because the next reader would see text that is minutes old.

Decision: the emulator never keeps the slave side of the pseudo-terminal open. It opens the slave once after
creating the pair and closes it again. From then on ``poll`` on the master reports POLLHUP exactly while no
other process has it open (pty(7)). An open slave, as in most programs, would hide the arrival and departure
of a reader. A short opening to check the reader's queue has no effect on the reader. Packet mode
(ioctl_tty(2), TIOCPKT) puts one control byte before everything read and reports the reader's flushes.

Tested on Linux. macOS and the BSDs have the same calls, but were not tested.
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

assert sys.platform != "win32"  # for mypy, which thereby knows the system's functions

# -- The link -----------------------------------------------------------------------------------------------


FIRST_LIMIT = 1024 * 1024
"""Bytes kept before the first reader."""
BACKLOG_LIMIT = 16 * 1024 * 1024
"""Bytes kept for a reader that has the port open and does not read."""
INBOX_LIMIT = 64 * 1024
"""Bytes taken from a reader in advance; the rest waits in the kernel, which blocks the writer."""
WRITE_BUDGET = 256 * 1024
"""Approximate bytes passed to the kernel per call: a fast reader must not keep the board in it."""
HOLD_S = 0.4
SETTLE_S = 0.05
POLL_S = 0.005
EXCLUSIVE_GRACE_S = 0.3
"""Time at the end of a run for a reader whose queue cannot be checked; it is about to read, not paused."""


class PtyLink:
    """A pseudo-terminal named ``link_path``, or else the first free ttyFCU<n> in the user's directory.

    Raises LinkError if the name is taken or the system has no free pseudo-terminal.
    """

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
        self._hold_until_s = 0.0  # and gets no data before this time
        self._serving = False  # and that time is over: a reader
        self._had_reader = False  # now or earlier
        self._lost_absent = 0
        self._lost_slow = 0
        self._closed = False

    @property
    def path(self) -> Path:
        return self._name.path

    @property
    def address(self) -> str:
        """Return the stable name, as text."""
        return str(self.path)

    def send(self, data: bytes) -> None:
        """Queue ``data`` for the reader and write to the kernel as much as it accepts."""
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
        """Return bytes that the reader has written."""
        if self._closed:
            return b""
        self._follow_reader()
        self._write()
        return self._inbox.take(most)

    def flush(self, timeout_s: float) -> None:
        """Wait until an attached reader has read everything, because ``close`` disconnects it."""
        if self._closed:
            return
        patience = Patience(timeout_s)
        while (left := self._untaken()) and (wait_s := patience.wait_s(left)):
            time.sleep(min(POLL_S, wait_s))
        if self._present and self._device.unread() is None:
            time.sleep(min(EXCLUSIVE_GRACE_S, patience.wait_s(0)))

    def close(self) -> None:
        """Remove the name and close the port; unread bytes are lost."""
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
        """Return the port and, for each usual terminal program, the command to paste."""
        return [
            f"serial: {self.path} ({self._device.path}), 115200 8N1; open it with one of",
            *(f"  {command}" for command in programs.for_pty(self.path)),
        ]

    def report(self) -> list[str]:
        """Return one line if bytes were lost."""
        return losses(
            self.path,
            (self._lost_absent, "while no program had it open"),
            (self._lost_slow, "because its reader was too slow"),
        )

    def undelivered(self) -> int:
        """Return how many bytes a slow reader lost; bytes without a reader do not count."""
        return self._lost_slow

    def _follow_reader(self) -> None:
        """Detect a reader's arrival, flushes and departure, and read its bytes."""
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
        """Fill the inbox up to its limit; return whether the reader flushed its input."""
        flushed_any = False
        while len(self._inbox) <= INBOX_LIMIT - CHUNK:  # the inbox never overflows
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
        """Create a new device for the name, because the old one is permanently locked."""
        self._read()  # its last bytes may have come after the check that found it gone
        with contextlib.suppress(LinkError):  # then the port stays locked, but the board continues
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
        """Return how many bytes an attached reader has not read; 0 without a reader."""
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
"""The most that one read returns, in bytes."""


class PtyDevice:
    """A raw pseudo-terminal; readers open ``path``. Raises OSError if the system has none left."""

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
        """Return whether any process has the device open."""
        return not any(events & select.POLLHUP for _, events in self._poll.poll(0))

    def read(self) -> tuple[bytes, bool]:
        """Return one piece of the reader's bytes, and whether it flushed its input since the last call."""
        try:
            packet = os.read(self._master, CHUNK)
        except OSError as error:  # EAGAIN: no data; EIO: no data, and no process has it open
            if error.errno not in (errno.EAGAIN, errno.EIO):
                raise
            return b"", False
        control = packet[0] if packet else 0
        if control == termios.TIOCPKT_DATA:
            return packet[1:], False
        return b"", bool(control & termios.TIOCPKT_FLUSHREAD)

    def write(self, data: bytes) -> int:
        """Write ``data`` to the reader's queue and return how many bytes it accepted."""
        try:
            return os.write(self._master, data)
        except BlockingIOError:
            return 0

    def unread(self) -> int | None:
        """Return how many bytes the reader has not read, None if it forbids other openings (TIOCEXCL).

        At most a page is counted, so this is a lower bound; 0 is exact.
        """
        try:
            with self._slave() as slave:
                # poll() first: it makes the kernel move pending bytes into the queue that FIONREAD counts
                waiting = select.poll()
                waiting.register(slave, select.POLLIN)
                waiting.poll(0)
                answer: bytes = fcntl.ioctl(slave, termios.FIONREAD, bytes(4))
        except OSError:
            return None
        return int(struct.unpack("i", answer)[0])

    def recycle(self) -> int | None:
        """Clear the device after a reader has left, and return how many unread bytes it had.

        Without this the next reader would get the last one's unread bytes and settings. Returns None if the
        device cannot be opened any more: ``screen`` sets TIOCEXCL, which on Linux remains set after its end.
        """
        try:
            with self._slave() as slave:
                _make_raw(slave)
                return _read_all(slave)
        except OSError:
            return None

    def close(self) -> None:
        """Close the master; a reader is disconnected and loses its unread bytes."""
        os.close(self._master)

    @contextlib.contextmanager
    def _slave(self) -> Iterator[int]:
        slave = os.open(self.path, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
        try:
            yield slave
        finally:
            os.close(slave)


def _make_raw(slave: int) -> None:
    """Switch off echo, line editing, translation and flow control; set 115200 baud for programs that ask."""
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
