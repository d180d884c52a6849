"""Inactivity: a part that lies still goes to sleep, and wakes at the first motion (AN5040 5.6).

While inactive the accelerometer runs at 12.5 Hz in low power though CTRL1_XL keeps its content, and the
gyroscope goes on, sleeps or is off as INACT_EN says. The model decodes its sensors from the registers as
:meth:`Activity.effective` shows them, so this file alone knows about it.
"""

from __future__ import annotations

from sensors.lsm6dsl.event_held import Held
from sensors.lsm6dsl.event_motion_filter import Axes
from sensors.lsm6dsl.event_wake_up import threshold_mg
from sensors.lsm6dsl.registers import CTRL1_XL, CTRL2_G, CTRL4_C, CTRL6_C, TAP_CFG, WAKE_UP_DUR

_ODR_12_5_HZ = 1
_GYROSCOPE_SLEEPS, _GYROSCOPE_OFF = 2, 3  # INACT_EN


class Activity:
    """``inactive``: SLEEP_STATE_IA; ``enabled``: INACT_EN is not 0."""

    def __init__(self) -> None:
        self.inactive = False
        self.enabled = False
        self._still = Held()
        self._threshold_mg = 0.0

    def configure(self, mem: bytearray, full_scale_mg: int) -> None:
        """Read enable, threshold and duration; switching the function off wakes the part."""
        self.enabled = bool(TAP_CFG.INACT_EN.get(mem[TAP_CFG.addr]))
        self._threshold_mg = threshold_mg(mem, full_scale_mg)
        self._still.periods = 512 * WAKE_UP_DUR.SLEEP_DUR.get(mem[WAKE_UP_DUR.addr]) or 16
        if not self.enabled:
            self.reset()

    def reset(self) -> None:
        """Begin anew, awake."""
        self.inactive = False
        self._still.reset()

    def step(self, motion: Axes) -> bool:
        """The next filtered sample in mg; whether ``inactive`` has changed."""
        if not self.enabled:
            return False
        x, y, z = motion
        limit = self._threshold_mg
        still = -limit < x < limit and -limit < y < limit and -limit < z < limit
        was, self.inactive = self.inactive, self._still.step(still) or (self.inactive and still)
        return self.inactive != was

    def effective(self, mem: bytearray) -> bytearray:
        """The main bank as the sensors have to take it now: itself while awake, or off anyway."""
        inact = TAP_CFG.INACT_EN.get(mem[TAP_CFG.addr])
        on = inact and mem[TAP_CFG.addr] & TAP_CFG.INTERRUPTS_ENABLE.mask
        if not (self.inactive and on and mem[CTRL1_XL.addr] & CTRL1_XL.ODR_XL.mask):
            return mem
        asleep = bytearray(mem)
        asleep[CTRL1_XL.addr] = CTRL1_XL.ODR_XL.put(mem[CTRL1_XL.addr], _ODR_12_5_HZ)
        asleep[CTRL6_C.addr] |= CTRL6_C.XL_HM_MODE.mask
        if inact == _GYROSCOPE_SLEEPS:
            asleep[CTRL4_C.addr] |= CTRL4_C.SLEEP.mask
        elif inact == _GYROSCOPE_OFF:
            asleep[CTRL2_G.addr] = CTRL2_G.ODR_G.put(mem[CTRL2_G.addr], 0)
        return asleep
