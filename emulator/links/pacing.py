"""Virtual time against wall time: a thin layer that sleeps between slices of a run.

The clock knows nothing of it, so a paced run and one at full speed give the same bytes. A machine that cannot
keep up, or was asleep, does not race to catch up: the pace goes on from where it is.
"""

from __future__ import annotations

import time

_SLICE_WALL_S = 0.01  # how often links are served while pacing
_SLICE_FREE_S = 0.25  # virtual time between two looks at the links when nothing is paced
_SHORTEST_SLICE_S = 1e-5
_PATIENCE_S = 0.1  # wall time a slice may take before the next one is made shorter
_LAG_FORGIVEN_S = 0.5


class Pacer:
    """Sleeps so that virtual time runs ``speed`` times as fast as the wall; None runs as fast as it can.

    ``slice_s`` is how much virtual time to run until the next ``wait``. It shrinks while slices take long, so
    that a run stays responsive however slow its firmware makes it.
    """

    def __init__(self, speed: float | None) -> None:
        self.speed = speed
        self._longest_s = _SLICE_FREE_S if speed is None else min(speed * _SLICE_WALL_S, _SLICE_FREE_S)
        self.slice_s = min(self._longest_s, _SLICE_WALL_S)
        self._origin_wall = self._slice_began = time.monotonic()
        self._origin_virtual = 0.0

    def wait(self, now_s: float) -> None:
        """A slice has been run: sleep until the wall has reached virtual time ``now_s``."""
        took = time.monotonic() - self._slice_began
        factor = 0.25 if took > _PATIENCE_S else 2.0
        self.slice_s = max(min(self.slice_s * factor, self._longest_s), _SHORTEST_SLICE_S)
        self._sleep(now_s)
        self._slice_began = time.monotonic()

    def _sleep(self, now_s: float) -> None:
        if self.speed is None:
            return
        due = self._origin_wall + (now_s - self._origin_virtual) / self.speed
        ahead = due - time.monotonic()
        if ahead > 0:
            time.sleep(ahead)
        elif ahead < -_LAG_FORGIVEN_S:
            self._origin_wall, self._origin_virtual = time.monotonic(), now_s
