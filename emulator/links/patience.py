"""How long the end of a run waits for a reader that may have stopped reading."""

from __future__ import annotations

import time

STALL_S = 2.0
"""Seconds without progress after which a reader is taken to have stopped, such as a paused ``less``."""


class Patience:
    """Waiting for a reader is over after ``timeout_s`` seconds, or ``STALL_S`` after its last progress."""

    def __init__(self, timeout_s: float) -> None:
        now_s = time.monotonic()
        self._deadline_s = now_s + timeout_s
        self._progress_s = now_s
        self._left: int | None = None

    def wait_s(self, left: int) -> float:
        """Return how many more seconds ``left`` untaken bytes may be waited for; 0.0 when it is over."""
        now_s = time.monotonic()
        if left != self._left:
            self._left = left
            self._progress_s = now_s
        return max(0.0, min(self._deadline_s, self._progress_s + STALL_S) - now_s)
