"""Wake-up: the filtered acceleration exceeds a threshold on any axis (AN5040 5.3)."""

from __future__ import annotations

from sensors.lsm6dsl.event_held import Held
from sensors.lsm6dsl.event_motion_filter import Axes
from sensors.lsm6dsl.registers import WAKE_UP_DUR, WAKE_UP_SRC, WAKE_UP_THS


def threshold_mg(mem: bytearray, full_scale_mg: int) -> float:
    """WK_THS in mg: one LSB is a 64th of the full scale."""
    return WAKE_UP_THS.WK_THS.get(mem[WAKE_UP_THS.addr]) * full_scale_mg / 64


class WakeUp:
    """WU_IA and the axes while any axis has exceeded WK_THS for WAKE_DUR/ODR."""

    def __init__(self) -> None:
        self._held = Held()
        self._threshold_mg = 0.0

    def configure(self, mem: bytearray, full_scale_mg: int) -> None:
        """Read threshold and duration."""
        self._threshold_mg = threshold_mg(mem, full_scale_mg)
        self._held.periods = WAKE_UP_DUR.WAKE_DUR.get(mem[WAKE_UP_DUR.addr])

    def reset(self) -> None:
        """Begin anew."""
        self._held.reset()

    def step(self, motion: Axes) -> int:
        """The next filtered sample in mg; bits of WAKE_UP_SRC."""
        x, y, z = motion
        limit = self._threshold_mg
        axes = 0
        if not -limit <= x <= limit:
            axes |= WAKE_UP_SRC.X_WU.mask
        if not -limit <= y <= limit:
            axes |= WAKE_UP_SRC.Y_WU.mask
        if not -limit <= z <= limit:
            axes |= WAKE_UP_SRC.Z_WU.mask
        return WAKE_UP_SRC.WU_IA.mask | axes if self._held.step(axes != 0) else 0
