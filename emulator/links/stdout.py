"""The terminal that started the emulator: standard output and input.

Decision: a daemon thread writes to standard output, because a write may block.

Decision: the thread writes to the raw file beneath ``sys.stdout.buffer``, because the lock of the
buffer would abort an exit while the thread is blocked.

Decision: after a failed write (reader gone, disk full) standard output is redirected to the null
device, so that the flush at exit does not fail (Python's ``signal``, "Note on SIGPIPE").

Decision: standard input is read only if it is a terminal and this process is in the terminal's
foreground process group. Otherwise SIGTTIN may stop the process.

Decision: the terminal stays in line mode, so that Ctrl-C still ends the run.
"""

from __future__ import annotations

import contextlib
import os
import signal
import sys
import threading

from fcu_emulator.emulator.errors import LinkError
from fcu_emulator.emulator.links.byte_link import Backlog
from fcu_emulator.emulator.links.writer import CHUNK, BackgroundWriter, RawFile

if sys.platform == "win32":
    import msvcrt


# -- The link -----------------------------------------------------------------------------------------------


class StdoutLink:
    """A link to standard output. The input consists of the lines that are typed on a foreground terminal."""

    def __init__(self) -> None:
        self._file = _raw_stdout()
        self._keyboard = Keyboard() if has_keyboard() else None
        self._closed = False
        self._writer = BackgroundWriter(self._file, "serial-stdout", self._point_to_nowhere)

    def send(self, data: bytes) -> None:
        self._writer.put(data)

    def receive(self, most: int) -> bytes:
        return self._keyboard.read(most) if self._keyboard and not self._closed else b""

    def flush(self, timeout_s: float) -> None:
        self._writer.flush(timeout_s)

    def close(self) -> None:
        if self._closed:
            return
        self._closed = True
        if self._keyboard:
            self._keyboard.close()
        self._writer.close()

    def announce(self) -> list[str]:
        typing = "; lines typed here go to the board" if self._keyboard else ""
        return [f"serial: on standard output{typing}"]

    def report(self) -> list[str]:
        lost = self._writer.lost
        reason = self._writer.failure or "its reader was too slow"
        return [f"serial: {lost} bytes lost on standard output: {reason}"] if lost else []

    @property
    def reader_gone(self) -> bool:
        return self._writer.reader_gone

    def undelivered(self) -> int:
        return self._writer.lost

    def _point_to_nowhere(self) -> None:
        with contextlib.suppress(OSError, ValueError):
            null = os.open(os.devnull, os.O_WRONLY)
            os.dup2(null, self._file.fileno(), inheritable=True)
            os.close(null)


def _raw_stdout() -> RawFile:
    buffer = getattr(sys.stdout, "buffer", None)
    if buffer is None:
        raise LinkError(
            "cannot open --serial stdout: standard output is closed; use --serial port", kind="no_stdout"
        )
    with contextlib.suppress(OSError):  # the first write finds and reports a reader that is already gone
        sys.stdout.flush()
    if sys.platform == "win32":
        with contextlib.suppress(OSError):  # a stream in memory does not have a descriptor
            msvcrt.setmode(buffer.fileno(), os.O_BINARY)
    raw: RawFile = getattr(buffer, "raw", buffer)
    return raw


# -- Typing -------------------------------------------------------------------------------------------------


INBOX_LIMIT = 64 * 1024
RETRY_S = 0.25


def has_keyboard(fd: int = 0) -> bool:
    """Return whether ``fd`` is a terminal with this process in its foreground."""
    if not os.isatty(fd):
        return False
    if sys.platform != "win32":
        try:
            return os.tcgetpgrp(fd) == os.getpgrp()
        except OSError:  # a terminal, but not the controlling terminal of this process
            return False
    else:
        return True


class Keyboard:
    """Input of terminal ``fd``, read in a daemon thread until Ctrl-D or ``close``."""

    def __init__(self, fd: int = 0) -> None:
        self._fd = fd
        self._changed = threading.Condition()  # guards the inbox
        self._inbox = Backlog(INBOX_LIMIT)
        self._closed = threading.Event()
        threading.Thread(target=self._run, name="serial-keyboard", daemon=True).start()

    def read(self, most: int) -> bytes:
        with self._changed:
            self._changed.notify_all()
            return self._inbox.take(most)

    def close(self) -> None:
        self._closed.set()
        with self._changed:
            self._changed.notify_all()

    def _run(self) -> None:
        if sys.platform != "win32":
            # With SIGTTIN blocked, a read after Ctrl-Z and "bg" fails with EIO instead of stopping the board.
            signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGTTIN})
        while not self._closed.is_set():
            try:
                data = os.read(self._fd, CHUNK)
            except OSError:  # the process is in the background now; it may be in the foreground again later
                self._closed.wait(RETRY_S)
                continue
            if not data:
                return
            with self._changed:
                self._inbox.put(data)
                self._changed.wait_for(self._has_room)

    def _has_room(self) -> bool:
        return self._closed.is_set() or len(self._inbox) <= INBOX_LIMIT - CHUNK
