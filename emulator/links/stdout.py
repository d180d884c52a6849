"""The terminal the emulator was started from: text on standard output, typing from standard input.

Decisions about standard output, which may be a terminal, a pipe or a file:

* A daemon thread writes. A pipe into a paused ``less`` blocks its writer, and the board must not stop for
  that; a non-blocking descriptor is the road not taken, since that flag is shared with every process on the
  same terminal.
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
import time
from typing import Protocol

from emulator.errors import LinkError
from emulator.links.byte_link import Backlog, Patience

if sys.platform == "win32":
    import msvcrt


# -- The link -----------------------------------------------------------------------------------------------


BACKLOG_LIMIT = 16 * 1024 * 1024
CHUNK = 4096
"""Bytes in one write: small, so that a slow reader's progress can be seen."""
JOIN_S = 0.2


class _RawFile(Protocol):
    """The part of ``io.RawIOBase`` and ``io.BytesIO`` that is used here."""

    def write(self, data: bytes, /) -> int | None: ...
    def fileno(self) -> int: ...


class StdoutLink:
    """Sends to standard output; receives what is typed, if standard input is a terminal in the foreground."""

    def __init__(self) -> None:
        self._file = _raw_stdout()
        self._keyboard = Keyboard() if has_keyboard() else None
        self._changed = threading.Condition()  # guards all below
        self._backlog = Backlog(BACKLOG_LIMIT)
        self._in_flight = 0
        self._lost = 0
        self._failure = ""
        self._closed = False
        self._writer = threading.Thread(target=self._run, name="serial-stdout", daemon=True)
        self._writer.start()

    def send(self, data: bytes) -> None:
        """Queue ``data`` for the writing thread."""
        with self._changed:
            if self._closed:
                return
            if self._failure:
                self._lost += len(data)
            else:
                self._lost += self._backlog.put(data)
            self._changed.notify_all()

    def receive(self, most: int) -> bytes:
        """Return what was typed; always empty without a keyboard."""
        return self._keyboard.read(most) if self._keyboard and not self._closed else b""

    def flush(self, timeout_s: float) -> None:
        """Wait until all is written, within ``timeout_s`` seconds and the reader's patience."""
        patience = Patience(timeout_s)
        with self._changed:
            while (left := self._untaken()) and (wait_s := patience.wait_s(left)):
                self._changed.wait(wait_s)

    def close(self) -> None:
        """End the writing thread; one blocked by its reader ends with the process, what it holds is lost."""
        with self._changed:
            if self._closed:
                return
            self._closed = True
            self._lost += len(self._backlog.take())
            self._changed.notify_all()
        if self._keyboard:
            self._keyboard.close()
        self._writer.join(JOIN_S)
        with self._changed:
            self._lost += self._in_flight
            self._in_flight = 0

    def announce(self) -> list[str]:
        """Return one line, which also says whether typing reaches the board."""
        typing = "; lines typed here go to the board" if self._keyboard else ""
        return [f"serial: on standard output{typing}"]

    def report(self) -> list[str]:
        """Return one line if bytes were lost."""
        with self._changed:
            reason = self._failure or "its reader was too slow"
            return [f"serial: {self._lost} bytes lost on standard output: {reason}"] if self._lost else []

    def undelivered(self) -> int:
        """Return how many bytes were lost, for whatever reason."""
        with self._changed:
            return self._lost

    def _untaken(self) -> int:
        return len(self._backlog) + self._in_flight

    def _run(self) -> None:
        try:
            while chunk := self._next_chunk():
                self._write(chunk)
        except (OSError, ValueError) as error:  # ValueError: somebody closed sys.stdout
            self._give_up(error)

    def _next_chunk(self) -> bytes:
        """Wait for something to write; empty when the link is closed."""
        with self._changed:
            self._changed.wait_for(lambda: self._closed or len(self._backlog))
            chunk = self._backlog.take(CHUNK)
            self._in_flight = len(chunk)
            return chunk

    def _write(self, chunk: bytes) -> None:
        while chunk:
            count = self._file.write(chunk)
            if count is None:  # somebody made the descriptor non-blocking, and it is full
                time.sleep(0.01)
                continue
            chunk = chunk[count:]
            with self._changed:
                self._in_flight = len(chunk)
                self._changed.notify_all()

    def _give_up(self, error: Exception) -> None:
        with contextlib.suppress(OSError, ValueError):
            null = os.open(os.devnull, os.O_WRONLY)
            os.dup2(null, self._file.fileno(), inheritable=True)
            os.close(null)
        with self._changed:
            self._failure = (error.strerror if isinstance(error, OSError) else "") or str(error)
            self._lost += self._untaken()
            self._backlog.take()
            self._in_flight = 0
            self._changed.notify_all()


def _raw_stdout() -> _RawFile:
    """Return the unbuffered binary file of ``sys.stdout``, all earlier text written out."""
    buffer = getattr(sys.stdout, "buffer", None)
    if buffer is None:
        raise LinkError("--serial stdout: this process has no standard output; use --serial pty")
    with contextlib.suppress(OSError):  # a reader already gone is found, and told, by the first write
        sys.stdout.flush()
    if sys.platform == "win32":
        with contextlib.suppress(OSError):  # a stream in memory has no descriptor
            msvcrt.setmode(buffer.fileno(), os.O_BINARY)
    raw: _RawFile = getattr(buffer, "raw", buffer)
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
