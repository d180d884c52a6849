"""What the user types into the terminal the emulator was started from.

Decisions:

* Standard input is read only if it is a terminal and this process is in its foreground process group. A pipe,
  a file or a background job is left alone: taking its bytes would rob whoever else reads it, and a background
  read would stop the whole process (SIGTTIN).
* The terminal stays in line mode: a line arrives at Enter, Ctrl-C still ends the run. The road not taken, raw
  mode, must be undone on every way out, a crash included, or the user's shell is left unusable; the pty link
  serves who wants single keys.
"""

from __future__ import annotations

import os
import signal
import sys
import threading

from emulator.links.backlog import Backlog

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
        self._lock = threading.Lock()
        self._inbox = Backlog(INBOX_LIMIT)
        self._closed = threading.Event()
        threading.Thread(target=self._run, name="serial-keyboard", daemon=True).start()

    def read(self) -> bytes:
        """Return the lines typed since the last call."""
        with self._lock:
            return self._inbox.take()

    def close(self) -> None:
        """Ask the thread to end; one that waits for a key ends with the process instead."""
        self._closed.set()

    def _run(self) -> None:
        if sys.platform != "win32":
            # With SIGTTIN blocked, a read after Ctrl-Z and "bg" fails with EIO instead of stopping the board.
            signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGTTIN})
        while not self._closed.is_set():
            try:
                data = os.read(self._fd, 4096)
            except OSError:  # in the background now, perhaps in front again later
                self._closed.wait(RETRY_S)
                continue
            if not data:
                return
            with self._lock:
                self._inbox.put(data)
