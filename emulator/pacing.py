"""Virtual time against wall time: a thin layer that sleeps between slices of a run.

The clock knows nothing of it, so a paced run and one at full speed give the same bytes. A machine that cannot
keep up, or was asleep, does not race to catch up: the pace goes on from where it is.
"""

from __future__ import annotations

import time

_SLICE_WALL_S = 0.01  # how often links are served while pacing
_SLICE_FREE_S = 0.25  # virtual time between two looks at the links when nothing is paced
_LAG_FORGIVEN_S = 0.5


class Pacer:
    """Sleeps so that virtual time runs ``speed`` times as fast as the wall; None runs as fast as it can."""

    def __init__(self, speed: float | None) -> None:
        self.speed = speed
        self.slice_s = _SLICE_FREE_S if speed is None else min(speed * _SLICE_WALL_S, _SLICE_FREE_S)
        self._origin_wall = time.monotonic()
        self._origin_virtual = 0.0

    def wait(self, now_s: float) -> None:
        """Sleep until the wall has reached virtual time ``now_s``."""
        if self.speed is None:
            return
        due = self._origin_wall + (now_s - self._origin_virtual) / self.speed
        ahead = due - time.monotonic()
        if ahead > 0:
            time.sleep(ahead)
        elif ahead < -_LAG_FORGIVEN_S:
            self._origin_wall, self._origin_virtual = time.monotonic(), now_s
