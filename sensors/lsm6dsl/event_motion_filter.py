"""The filter in front of wake-up, inactivity and tap: it takes gravity away (AN5040 3.7 and 5.3).

The slope is (a[n] - a[n-1]) / 2. After the accelerometer has been switched on a[-1] is 0, so the first slope
is half of gravity: one spurious wake-up, as on silicon. Switched on while the accelerometer runs already, the
filter takes its first sample to have been there before. The high-pass that SLOPE_FDS selects for wake-up and
inactivity has the cut-off of CTRL8_XL.HPCF_XL; its order is not documented, one pole is assumed. The tap
always takes the slope.
"""

from __future__ import annotations

import math
from typing import TypeAlias

from sensors.lsm6dsl.registers import CTRL8_XL, TAP_CFG

Axes: TypeAlias = tuple[float, float, float]
"""X, Y, Z in mg."""

ZERO: Axes = (0.0, 0.0, 0.0)
_DIVISOR = (4, 100, 9, 400)  # HPCF_XL: cut-off is ODR over this; code 0 is the slope filter


class MotionFilter:
    """``slope`` and ``motion`` of the latest sample, in mg; ``motion`` is the filter SLOPE_FDS selects."""

    __slots__ = ("_decay", "_previous", "motion", "slope")

    def __init__(self) -> None:
        self._decay = 0.0  # 0: no high-pass
        self._previous: Axes | None = ZERO
        self.slope = self.motion = ZERO

    def configure(self, mem: bytearray) -> None:
        """Read SLOPE_FDS and HPCF_XL."""
        code = CTRL8_XL.HPCF_XL.get(mem[CTRL8_XL.addr])
        high_pass = mem[TAP_CFG.addr] & TAP_CFG.SLOPE_FDS.mask and code
        self._decay = 1 / (1 + 2 * math.pi / _DIVISOR[code]) if high_pass else 0.0

    def start(self, *, from_zero: bool) -> None:
        """Begin anew: behind a sample of zero, or behind one like the next."""
        self._previous = ZERO if from_zero else None
        self.motion = ZERO

    def step(self, sample: Axes) -> None:
        """Take the next sample, in mg."""
        x, y, z = sample
        before_x, before_y, before_z = self._previous or sample
        self._previous = sample
        self.slope = (x - before_x) / 2, (y - before_y) / 2, (z - before_z) / 2
        if not self._decay:
            self.motion = self.slope
            return
        decay, (passed_x, passed_y, passed_z) = self._decay, self.motion
        self.motion = (
            decay * (passed_x + x - before_x),
            decay * (passed_y + y - before_y),
            decay * (passed_z + z - before_z),
        )
