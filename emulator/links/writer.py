"""A thread that writes to a file that may block, such as a pipe into a paused ``less``.

The file descriptor stays in blocking mode, because a change of the mode would affect all processes on the terminal. Bytes
after a failed write are lost.
"""

from __future__ import annotations

import errno
import sys
import threading
import time
from collections.abc import Callable
from typing import Protocol

from fcu_emulator.emulator.links.byte_link import Backlog, Patience

BACKLOG_LIMIT = 16 * 1024 * 1024
CHUNK = 4096
"""Bytes in one write."""
JOIN_S = 0.2


def is_broken_pipe(error: BaseException) -> bool:
    """Return whether the reader has closed the pipe (EINVAL on Windows)."""
    broken = {errno.EPIPE, errno.EINVAL} if sys.platform == "win32" else {errno.EPIPE}
    return isinstance(error, OSError) and error.errno in broken


class RawFile(Protocol):
    """The part of ``io.RawIOBase`` and ``io.BytesIO`` that this module uses."""

    def write(self, data: bytes, /) -> int | None: ...

    def fileno(self) -> int: ...


class BackgroundWriter:
    """Output to ``file`` in a daemon thread. It calls ``on_failure()`` after a failed write."""

    def __init__(self, file: RawFile, name: str, on_failure: Callable[[], None] = lambda: None) -> None:
        self._file = file
        self._on_failure = on_failure
        self._changed = threading.Condition()  # guards all attributes below
        self._backlog = Backlog(BACKLOG_LIMIT)
        self._in_flight = 0
        self._lost = 0
        self._failure = ""
        self._reader_gone = False
        self._closed = False
        self._thread = threading.Thread(target=self._run, name=name, daemon=True)
        self._thread.start()

    @property
    def failure(self) -> str:
        with self._changed:
            return self._failure

    @property
    def reader_gone(self) -> bool:
        with self._changed:
            return self._reader_gone

    @property
    def lost(self) -> int:
        with self._changed:
            return self._lost

    def put(self, data: bytes) -> None:
        with self._changed:
            if self._closed:
                return
            if self._failure:
                self._lost += len(data)
            else:
                self._lost += self._backlog.put(data)
            self._changed.notify_all()

    def flush(self, timeout_s: float) -> None:
        patience = Patience(timeout_s)
        with self._changed:
            while (left := self._untaken()) and (wait_s := patience.wait_s(left)):
                self._changed.wait(wait_s)

    def close(self) -> bool:
        """End the thread, and return whether it ended. A blocked thread ends with the process."""
        with self._changed:
            self._closed = True
            self._lost += len(self._backlog.take())
            self._changed.notify_all()
        self._thread.join(JOIN_S)
        with self._changed:
            self._lost += self._in_flight
            self._in_flight = 0
        return not self._thread.is_alive()

    def _untaken(self) -> int:
        return len(self._backlog) + self._in_flight

    def _run(self) -> None:
        try:
            while chunk := self._next_chunk():
                self._write(chunk)
        except (OSError, ValueError) as error:  # ValueError: the file was closed elsewhere
            self._give_up(error)

    def _next_chunk(self) -> bytes:
        with self._changed:
            self._changed.wait_for(lambda: self._closed or len(self._backlog))
            chunk = self._backlog.take(CHUNK)
            self._in_flight = len(chunk)
            return chunk

    def _write(self, chunk: bytes) -> None:
        while chunk:
            count = self._file.write(chunk)
            if count is None:  # another process made the descriptor non-blocking, and it is full
                time.sleep(0.01)
                continue
            chunk = chunk[count:]
            with self._changed:
                self._in_flight = len(chunk)
                self._changed.notify_all()

    def _give_up(self, error: Exception) -> None:
        self._on_failure()
        with self._changed:
            self._reader_gone = is_broken_pipe(error)
            self._failure = (error.strerror if isinstance(error, OSError) else "") or str(error)
            self._lost += self._untaken()
            self._backlog.take()
            self._in_flight = 0
            self._changed.notify_all()
