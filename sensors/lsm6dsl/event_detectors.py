"""The event functions' detectors, fed sample by sample (AN5040 3.7 and section 5).

Decision: a duration of N/ODR ends N periods after the first sample at which the condition was true. Counting N samples
would make the durations 0 and 1 equal.

The slope (a[n] - a[n-1]) / 2, or a high-pass of one pole, removes gravity (3.7). After switch-on, a[-1] is 0. This
causes a spurious wake-up, as on silicon.

Decision: an axis is over the threshold if it measures more than cos(SIXD_THS) of 1 g (5.4). Decision: the first
position found after switching on also counts as a change.
"""

from __future__ import annotations

import math
from typing import Literal, TypeAlias

from fcu_emulator.sensors.lsm6dsl.registers import (
    CTRL1_XL,
    CTRL2_G,
    CTRL4_C,
    CTRL6_C,
    CTRL8_XL,
    D6D_SRC,
    FREE_FALL,
    INT_DUR2,
    TAP_CFG,
    TAP_SRC,
    TAP_THS_6D,
    WAKE_UP_DUR,
    WAKE_UP_SRC,
    WAKE_UP_THS,
)


class DurationCounter:
    """Counter of consecutive samples at which a condition was true."""

    __slots__ = ("_run", "periods")

    def __init__(self) -> None:
        self.periods = 0
        self._run = 0

    def reset(self) -> None:
        self._run = 0

    def step(self, condition: bool) -> bool:
        self._run = self._run + 1 if condition else 0
        return self._run > self.periods


Axes: TypeAlias = tuple[float, float, float]
"""X, Y, Z in mg."""

ZERO: Axes = (0.0, 0.0, 0.0)
_DIVISOR = (4, 100, 9, 400)  # HPCF_XL: cut-off is ODR divided by this number; code 0 is the slope filter


class MotionFilter:
    """The filters of the event functions. ``slope``: the slope at the latest sample; ``motion``: the output
    of the filter that SLOPE_FDS selects, both in mg.
    """

    __slots__ = ("_decay", "_previous", "motion", "slope")

    def __init__(self) -> None:
        self._decay = 0.0  # 0: no high-pass
        self._previous: Axes | None = ZERO
        self.slope = self.motion = ZERO

    def configure(self, mem: bytearray) -> None:
        code = CTRL8_XL.HPCF_XL.get(mem[CTRL8_XL.addr])
        high_pass = mem[TAP_CFG.addr] & TAP_CFG.SLOPE_FDS.mask and code
        self._decay = 1 / (1 + 2 * math.pi / _DIVISOR[code]) if high_pass else 0.0

    def start(self, *, from_zero: bool) -> None:
        """Restart as if the previous sample had been zero or, if ``from_zero`` is False, equal to the next sample."""
        self._previous = ZERO if from_zero else None
        self.motion = ZERO

    def step(self, sample: Axes) -> None:
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


# -- free fall: all three axes near zero for long enough (AN5040 5.1; datasheet Tables 199 and 200) ---------

_FREE_FALL_MG = (156, 219, 250, 312, 344, 406, 469, 500)  # FF_THS, for every full scale


class FreeFallDetector:
    """Detector of free fall: FF_IA is set while every axis has stayed within FF_THS for FF_DUR/ODR."""

    def __init__(self) -> None:
        self._duration = DurationCounter()
        self._threshold_mg = _FREE_FALL_MG[0]

    def configure(self, mem: bytearray) -> None:
        control = mem[FREE_FALL.addr]
        self._threshold_mg = _FREE_FALL_MG[FREE_FALL.FF_THS.get(control)]
        upper = WAKE_UP_DUR.FF_DUR5.get(mem[WAKE_UP_DUR.addr])
        self._duration.periods = upper << 5 | FREE_FALL.FF_DUR_4_0.get(control)

    def reset(self) -> None:
        self._duration.reset()

    def step(self, sample: Axes) -> int:
        """Process a sample in mg; return bits of WAKE_UP_SRC."""
        x, y, z = sample
        limit = self._threshold_mg
        falling = -limit < x < limit and -limit < y < limit and -limit < z < limit
        return WAKE_UP_SRC.FF_IA.mask if self._duration.step(falling) else 0


# -- wake-up: the filtered acceleration exceeds a threshold on any axis (AN5040 5.3) ------------------------


def _wake_up_mg(mem: bytearray, full_scale_mg: int) -> float:
    """Return WK_THS in mg: one LSB is full scale / 64."""
    return WAKE_UP_THS.WK_THS.get(mem[WAKE_UP_THS.addr]) * full_scale_mg / 64


class WakeUp:
    """Detector of wake-up: WU_IA and the bits of the axes are set while an axis has exceeded WK_THS for
    WAKE_DUR/ODR.
    """

    def __init__(self) -> None:
        self._duration = DurationCounter()
        self._threshold_mg = 0.0

    def configure(self, mem: bytearray, full_scale_mg: int) -> None:
        self._threshold_mg = _wake_up_mg(mem, full_scale_mg)
        self._duration.periods = WAKE_UP_DUR.WAKE_DUR.get(mem[WAKE_UP_DUR.addr])

    def reset(self) -> None:
        self._duration.reset()

    def step(self, motion: Axes) -> int:
        """Process a filtered sample in mg; return bits of WAKE_UP_SRC."""
        x, y, z = motion
        limit = self._threshold_mg
        axes = 0
        if not -limit <= x <= limit:
            axes |= WAKE_UP_SRC.X_WU.mask
        if not -limit <= y <= limit:
            axes |= WAKE_UP_SRC.Y_WU.mask
        if not -limit <= z <= limit:
            axes |= WAKE_UP_SRC.Z_WU.mask
        return WAKE_UP_SRC.WU_IA.mask | axes if self._duration.step(axes != 0) else 0


# -- 6D and 4D orientation: which axis points up or down (AN5040 5.4) ---------------------------------------

_ANGLE_DEG = (80, 70, 60, 50)  # SIXD_THS
_HIGH = (D6D_SRC.XH.mask, D6D_SRC.YH.mask, D6D_SRC.ZH.mask)
_LOW = (D6D_SRC.XL.mask, D6D_SRC.YL.mask, D6D_SRC.ZL.mask)


class Orientation:
    """Recogniser of orientations; ``position``: the latest axis bit, or 0."""

    def __init__(self) -> None:
        self.position = 0
        self._seen = 0
        self._axes = 3
        self._threshold_mg = 0.0

    def configure(self, mem: bytearray) -> None:
        control = mem[TAP_THS_6D.addr]
        self._threshold_mg = 1000 * math.cos(math.radians(_ANGLE_DEG[TAP_THS_6D.SIXD_THS.get(control)]))
        self._axes = 2 if control & TAP_THS_6D.D4D_EN.mask else 3

    def reset(self) -> None:
        self.position = self._seen = 0

    def step(self, sample: Axes) -> int:
        """Process a sample in mg; return D6D_IA at the second sample of a new position."""
        seen = self._over(sample)
        changed = seen != 0 and seen == self._seen and seen != self.position
        self._seen = seen
        if not changed:
            return 0
        self.position = seen
        return D6D_SRC.D6D_IA.mask

    def _over(self, sample: Axes) -> int:
        limit, found = self._threshold_mg, 0
        for axis in range(self._axes):
            value = sample[axis]
            if -limit <= value <= limit:
                continue
            if found:
                return 0
            found = _HIGH[axis] if value > 0 else _LOW[axis]
        return found


# -- single and double tap (AN5040 5.5) ---------------------------------------------------------------------

_State: TypeAlias = Literal["idle", "shock", "quiet", "second"]
_AXES = (TAP_SRC.X_TAP.mask, TAP_SRC.Y_TAP.mask, TAP_SRC.Z_TAP.mask)


class TapDetector:
    """Recogniser of taps. Single and double taps are never signalled together."""

    def __init__(self) -> None:
        self._state: _State = "idle"
        self._count = 0  # samples since the state began
        self._is_second = False  # whether the shock or quiet time may belong to a second tap
        self._over = False
        self._bits = 0
        self._enabled = (False, False, False)
        self._threshold_mg = 0.0
        self._shock = self._quiet = self._gap = 0
        self._double = False

    def configure(self, mem: bytearray, full_scale_mg: int) -> None:
        config, windows = mem[TAP_CFG.addr], mem[INT_DUR2.addr]
        bits = TAP_CFG.TAP_X_EN, TAP_CFG.TAP_Y_EN, TAP_CFG.TAP_Z_EN
        self._enabled = (bool(bits[0].get(config)), bool(bits[1].get(config)), bool(bits[2].get(config)))
        self._threshold_mg = TAP_THS_6D.TAP_THS.get(mem[TAP_THS_6D.addr]) * full_scale_mg / 32
        self._shock = 8 * INT_DUR2.SHOCK.get(windows) or 4
        self._quiet = 4 * INT_DUR2.QUIET.get(windows) or 2
        self._gap = 32 * INT_DUR2.DUR.get(windows) or 16
        self._double = bool(mem[WAKE_UP_THS.addr] & WAKE_UP_THS.SINGLE_DOUBLE_TAP.mask)
        if not any(self._enabled):
            self.reset()

    def reset(self) -> None:
        self._state, self._count, self._over, self._bits = "idle", 0, False, 0

    def step(self, slope: Axes) -> int:
        """Process a slope in mg; return bits of TAP_SRC during an event."""
        over = self._exceeds(slope)
        begins = over and not self._over
        self._over = over
        self._count += 1
        if self._state == "quiet" and self._count >= self._quiet:
            self._enter("second" if self._double and not self._is_second else "idle")
        if self._state == "shock":
            self._in_shock(over)
        elif self._state != "quiet" and begins and not self._too_late():
            self._begin(slope, is_second=self._state == "second")
        elif self._state == "second" and self._too_late():
            self._enter("idle")
        return self._bits if self._state == "quiet" else 0

    def _too_late(self) -> bool:
        return self._state == "second" and self._count >= self._gap

    def _exceeds(self, slope: Axes) -> bool:
        limit = self._threshold_mg
        x, y, z = self._enabled
        return (
            (x and not -limit <= slope[0] <= limit)
            or (y and not -limit <= slope[1] <= limit)
            or (z and not -limit <= slope[2] <= limit)
        )

    def _enter(self, state: _State) -> None:
        self._state, self._count = state, 0

    def _begin(self, slope: Axes, *, is_second: bool) -> None:
        self._is_second = is_second
        sizes = [abs(value) if on else 0.0 for value, on in zip(slope, self._enabled, strict=True)]
        self._bits = TAP_SRC.TAP_IA.mask
        for size, bit in zip(sizes, _AXES, strict=True):
            self._bits |= bit if size > self._threshold_mg else 0
        if slope[sizes.index(max(sizes))] < 0:
            self._bits |= TAP_SRC.TAP_SIGN.mask
        self._enter("shock")

    def _in_shock(self, over: bool) -> None:
        if self._count > self._shock:  # too long for a tap; detection of a tap starts again
            self._enter("idle")
        elif not over:
            self._bits |= TAP_SRC.DOUBLE_TAP.mask if self._is_second else TAP_SRC.SINGLE_TAP.mask
            self._enter("quiet")


# -- inactivity: a motionless sensor sleeps, and wakes at the first motion (AN5040 5.6) ---------------------

_ODR_12_5_HZ = 1
_GYROSCOPE_SLEEPS, _GYROSCOPE_OFF = 2, 3  # INACT_EN


class Activity:
    """Detector of inactivity. ``inactive``: SLEEP_STATE_IA; ``enabled``: INACT_EN is not 0."""

    def __init__(self) -> None:
        self.inactive = False
        self.enabled = False
        self._still = DurationCounter()
        self._threshold_mg = 0.0

    def configure(self, mem: bytearray, full_scale_mg: int) -> None:
        self.enabled = bool(TAP_CFG.INACT_EN.get(mem[TAP_CFG.addr]))
        self._threshold_mg = _wake_up_mg(mem, full_scale_mg)
        self._still.periods = 512 * WAKE_UP_DUR.SLEEP_DUR.get(mem[WAKE_UP_DUR.addr]) or 16
        if not self.enabled:
            self.reset()

    def reset(self) -> None:
        self.inactive = False
        self._still.reset()

    def step(self, motion: Axes) -> bool:
        """Process a filtered sample in mg; return whether ``inactive`` changed."""
        if not self.enabled:
            return False
        x, y, z = motion
        limit = self._threshold_mg
        still = -limit < x < limit and -limit < y < limit and -limit < z < limit
        was, self.inactive = self.inactive, self._still.step(still) or (self.inactive and still)
        return self.inactive != was

    def effective(self, mem: bytearray) -> bytearray:
        """Return the main bank with the present effects of inactivity."""
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
