"""6D and 4D orientation: which axis points up or down (AN5040 5.4).

Decision: an axis is over the threshold when it lies within SIXD_THS of the vertical, that is when it measures
more than cos(SIXD_THS) of 1 g. The documents give the angle only; a position counts when exactly one axis is
over, so a wider angle asks for a more exact position, in either reading of the angle.

Decision: the first position found after switching on is a change as well, from none.
"""

from __future__ import annotations

import math

from sensors.lsm6dsl.event_motion_filter import Axes
from sensors.lsm6dsl.registers import D6D_SRC, TAP_THS_6D

ANGLE_DEG = (80, 70, 60, 50)  # SIXD_THS
_HIGH = (D6D_SRC.XH.mask, D6D_SRC.YH.mask, D6D_SRC.ZH.mask)
_LOW = (D6D_SRC.XL.mask, D6D_SRC.YL.mask, D6D_SRC.ZL.mask)


class Orientation:
    """``position``: the axis bit of the latest position recognised, 0 before the first."""

    def __init__(self) -> None:
        self.position = 0
        self._seen = 0
        self._axes = 3
        self._threshold_mg = 0.0

    def configure(self, mem: bytearray) -> None:
        """Read the angle, and whether Z counts."""
        control = mem[TAP_THS_6D.addr]
        self._threshold_mg = 1000 * math.cos(math.radians(ANGLE_DEG[TAP_THS_6D.SIXD_THS.get(control)]))
        self._axes = 2 if control & TAP_THS_6D.D4D_EN.mask else 3

    def reset(self) -> None:
        """Begin anew."""
        self.position = self._seen = 0

    def step(self, sample: Axes) -> int:
        """The next sample in mg; D6D_IA at the second sample of a new position, for that sample only."""
        seen = self._over(sample)
        changed = seen != 0 and seen == self._seen and seen != self.position
        self._seen = seen
        if not changed:
            return 0
        self.position = seen
        return D6D_SRC.D6D_IA.mask

    def _over(self, sample: Axes) -> int:
        """The bit of the only axis over the threshold; 0 if there is none, or more than one."""
        limit, found = self._threshold_mg, 0
        for axis in range(self._axes):
            value = sample[axis]
            if -limit <= value <= limit:
                continue
            if found:
                return 0
            found = _HIGH[axis] if value > 0 else _LOW[axis]
        return found
