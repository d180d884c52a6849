"""Connection messages, escaped and limited in rate to protect the terminal."""

from __future__ import annotations

import time
from collections.abc import Callable

from fcu_emulator.emulator.text import one_line

BURST = 5
"""Number of lines that may pass in quick succession; afterwards, one line may pass per :data:`EVERY_S`."""
EVERY_S = 10.0


class LimitedLines:
    """Filter that passes lines to ``say``, escaped and limited in rate. It is not thread-safe.

    The first line after omitted lines contains the number of omitted lines.
    """

    def __init__(self, say: Callable[[str], None], clock_s: Callable[[], float] = time.monotonic) -> None:
        self._say = say
        self._clock_s = clock_s
        self._allowance = float(BURST)
        self._before_s = clock_s()
        self._left_out = 0

    def __call__(self, line: str) -> None:
        now_s = self._clock_s()
        self._allowance = min(self._allowance + (now_s - self._before_s) / EVERY_S, BURST)
        self._before_s = now_s
        if self._allowance < 1:
            self._left_out += 1
            return
        self._allowance -= 1
        left_out, self._left_out = self._left_out, 0
        self._say(one_line(line) + (f" ({left_out} lines were left out before)" if left_out else ""))
