"""The terminal the emulator was started from: text on standard output, typing from standard input.

Decisions about standard output, which may be a terminal, a pipe or a file:

* A daemon thread writes (:mod:`fcu_emulator.emulator.links.writer`).
* The thread writes to the raw file beneath ``sys.stdout.buffer``. The buffered layer has a lock, and an
  interpreter that exits while a blocked daemon thread holds it aborts; raw writes also need no flush.
* Once a write failed (reader gone, disk full) nothing more is written and standard output is pointed at the
  null device, so that the interpreter's own flush at exit cannot fail either (Python library reference,
  module ``signal``, "Note on SIGPIPE").

Decisions about standard input:

* It is read only if it is a terminal and this process is in its foreground process group. A pipe, a file or a
  background job is left alone: taking its bytes would rob whoever else reads it, and a background read would
  stop the whole process (SIGTTIN).
* The terminal stays in line mode: a line arrives at Enter, Ctrl-C still ends the run. The road not taken, raw
  mode, must be undone on every way out, a crash included, or the user's shell is left unusable; the pty link
  serves who wants single keys.
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
    """Sends to standard output; receives what is typed, if standard input is a terminal in the foreground."""

    def __init__(self) -> None:
        self._file = _raw_stdout()
        self._keyboard = Keyboard() if has_keyboard() else None
        self._closed = False
        self._writer = BackgroundWriter(self._file, "serial-stdout", self._point_to_nowhere)

    def send(self, data: bytes) -> None:
        """Queue ``data`` for the writing thread."""
        self._writer.put(data)

    def receive(self, most: int) -> bytes:
        """Return what was typed; always empty without a keyboard."""
        return self._keyboard.read(most) if self._keyboard and not self._closed else b""

    def flush(self, timeout_s: float) -> None:
        """Wait until all is written, within ``timeout_s`` seconds and the reader's patience."""
        self._writer.flush(timeout_s)

    def close(self) -> None:
        """End the writing thread; one blocked by its reader ends with the process, what it holds is lost."""
        if self._closed:
            return
        self._closed = True
        if self._keyboard:
            self._keyboard.close()
        self._writer.close()

    def announce(self) -> list[str]:
        """Return one line, which also says whether typing reaches the board."""
        typing = "; lines typed here go to the board" if self._keyboard else ""
        return [f"serial: on standard output{typing}"]

    def report(self) -> list[str]:
        """Return one line if bytes were lost."""
        lost = self._writer.lost
        reason = self._writer.failure or "its reader was too slow"
        return [f"serial: {lost} bytes lost on standard output: {reason}"] if lost else []

    @property
    def reader_gone(self) -> bool:
        """Whether standard output is a pipe whose reader has closed it."""
        return self._writer.reader_gone

    def undelivered(self) -> int:
        """Return how many bytes were lost, for whatever reason."""
        return self._writer.lost

    def _point_to_nowhere(self) -> None:
        with contextlib.suppress(OSError, ValueError):
            null = os.open(os.devnull, os.O_WRONLY)
            os.dup2(null, self._file.fileno(), inheritable=True)
            os.close(null)


def _raw_stdout() -> RawFile:
    """Return the unbuffered binary file of ``sys.stdout``, all earlier text written out."""
    buffer = getattr(sys.stdout, "buffer", None)
    if buffer is None:
        raise LinkError(
            "--serial stdout: this process has no standard output; use --serial port", kind="no_stdout"
        )
    with contextlib.suppress(OSError):  # a reader already gone is found, and told, by the first write
        sys.stdout.flush()
    if sys.platform == "win32":
        with contextlib.suppress(OSError):  # a stream in memory has no descriptor
            msvcrt.setmode(buffer.fileno(), os.O_BINARY)
    raw: RawFile = getattr(buffer, "raw", buffer)
    return raw


# -- Typing -------------------------------------------------------------------------------------------------


INBOX_LIMIT = 64 * 1024
RETRY_S = 0.25


def has_keyboard(fd: int = 0) -> bool:
    """Tell whether ``fd`` is a terminal whose typing is meant for this process."""
    if not os.isatty(fd):
        return False
    if sys.platform != "win32":
        try:
            return os.tcgetpgrp(fd) == os.getpgrp()
        except OSError:  # a terminal, but not this process's controlling one
            return False
    else:
        return True


class Keyboard:
    """Reads terminal ``fd`` in a daemon thread until end of file (Ctrl-D) or ``close``."""

    def __init__(self, fd: int = 0) -> None:
        self._fd = fd
        self._changed = threading.Condition()  # guards the inbox
        self._inbox = Backlog(INBOX_LIMIT)
        self._closed = threading.Event()
        threading.Thread(target=self._run, name="serial-keyboard", daemon=True).start()

    def read(self, most: int) -> bytes:
        """Return up to ``most`` bytes of what was typed."""
        with self._changed:
            self._changed.notify_all()
            return self._inbox.take(most)

    def close(self) -> None:
        """Ask the thread to end; one that waits for a key ends with the process instead."""
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
            except OSError:  # in the background now, perhaps in front again later
                self._closed.wait(RETRY_S)
                continue
            if not data:
                return
            with self._changed:
                self._inbox.put(data)
                self._changed.wait_for(self._has_room)

    def _has_room(self) -> bool:
        """Whether the next piece fits; until then what is typed waits in the kernel."""
        return self._closed.is_set() or len(self._inbox) <= INBOX_LIMIT - CHUNK
