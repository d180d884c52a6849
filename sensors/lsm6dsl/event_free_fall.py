"""Free fall: all three axes near zero for long enough (AN5040 5.1; datasheet Tables 199 and 200)."""

from __future__ import annotations

from sensors.lsm6dsl.event_held import Held
from sensors.lsm6dsl.event_motion_filter import Axes
from sensors.lsm6dsl.registers import FREE_FALL, WAKE_UP_DUR, WAKE_UP_SRC

THRESHOLD_MG = (156, 219, 250, 312, 344, 406, 469, 500)  # FF_THS, whatever the full scale


class FreeFall:
    """FF_IA while every axis has stayed within FF_THS for FF_DUR/ODR."""

    def __init__(self) -> None:
        self._held = Held()
        self._threshold_mg = THRESHOLD_MG[0]

    def configure(self, mem: bytearray) -> None:
        """Read threshold and duration."""
        control = mem[FREE_FALL.addr]
        self._threshold_mg = THRESHOLD_MG[FREE_FALL.FF_THS.get(control)]
        upper = WAKE_UP_DUR.FF_DUR5.get(mem[WAKE_UP_DUR.addr])
        self._held.periods = upper << 5 | FREE_FALL.FF_DUR_4_0.get(control)

    def reset(self) -> None:
        """Begin anew."""
        self._held.reset()

    def step(self, sample: Axes) -> int:
        """The next sample in mg; bits of WAKE_UP_SRC."""
        x, y, z = sample
        limit = self._threshold_mg
        falling = -limit < x < limit and -limit < y < limit and -limit < z < limit
        return WAKE_UP_SRC.FF_IA.mask if self._held.step(falling) else 0
