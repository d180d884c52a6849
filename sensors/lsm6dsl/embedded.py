"""Embedded functions: pedometer, significant motion, tilt and absolute wrist tilt (AN5040 section 6).

Decision: one object models the four embedded functions, so that their events reach a shared pin in the order of time.
If a function is switched on, it starts from its initial state (assumption).

Decision: a step of the pedometer is a peak of the acceleration's magnitude (6.1), because ST publishes no algorithm.
The magnitude must fall by the threshold after a peak, and rise by the threshold before the next peak. So no high-pass
filter is needed.

A tilt event (6.3) occurs after a turn by 35 degrees since the previous event; before the first event the tilt must
last 2 s. A wrist tilt event (6.4; datasheet 12) occurs if the acceleration stays above the threshold (sine of an
angle) for the entire latency time.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from fcu_emulator.sensors.errors import ZERO, Vec3
from fcu_emulator.sensors.lsm6dsl.accelerometer import MG_PER_LSB
from fcu_emulator.sensors.lsm6dsl.banks import BANK_A, BANK_B, BankA, BankB, on_bank_write
from fcu_emulator.sensors.lsm6dsl.feature import FeatureContext, Violations
from fcu_emulator.sensors.lsm6dsl.function_sources import (
    SIGNIFICANT_MOTION,
    STEP,
    STEP_DELTA,
    STEP_OVERFLOW,
    TILT,
    WRIST_TILT,
    FunctionSource,
    FunctionSources,
)
from fcu_emulator.sensors.lsm6dsl.registers import (
    CTRL1_XL,
    CTRL10_C,
    STEP_COUNTER,
    STEP_TIMESTAMP,
    TIMESTAMP1_REG,
    WAKE_UP_DUR,
    WRIST_TILT_IA,
)
from fcu_emulator.sensors.register import Register
from fcu_emulator.sensors.register_file import NEVER_PS
from fcu_emulator.sensors.sampling import PS_PER_S

# -- pedometer ----------------------------------------------------------------------------------------------

_LSB_MG = (32.0, 62.5)  # CONFIG_PEDO_THS_MIN.PEDO_FS (datasheet 11.16)
_FULL_SCALE_MG = (2000.0, 4000.0)
_DEBOUNCE_LSB_PS = 80 * PS_PER_S // 1000  # datasheet 11.18
_DELTA_LSB_PS = 16384 * PS_PER_S // 10000  # datasheet 11.19: 1.6384 s


@dataclass(frozen=True)
class PedometerSettings:
    """The pedometer's settings in bank A."""

    full_scale_mg: float  # limit of each axis, independent of FS_XL
    threshold_mg: float
    debounce_steps: int
    debounce_ps: int  # a longer pause restarts the debounce
    delta_ps: int  # 0: off

    @classmethod
    def decode(cls, mem: bytearray) -> PedometerSettings:
        """Decode bank A; a threshold of 0 acts as 1 LSB."""
        scale = BankA.CONFIG_PEDO_THS_MIN.PEDO_FS.get(mem[BankA.CONFIG_PEDO_THS_MIN.addr])
        threshold = BankA.CONFIG_PEDO_THS_MIN.ths_min.get(mem[BankA.CONFIG_PEDO_THS_MIN.addr])
        debounce = mem[BankA.PEDO_DEB_REG.addr]
        return cls(
            full_scale_mg=_FULL_SCALE_MG[scale],
            threshold_mg=max(threshold, 1) * _LSB_MG[scale],
            debounce_steps=BankA.PEDO_DEB_REG.DEB_STEP.get(debounce),
            debounce_ps=BankA.PEDO_DEB_REG.DEB_TIME.get(debounce) * _DEBOUNCE_LSB_PS,
            delta_ps=mem[BankA.STEP_COUNT_DELTA.addr] * _DELTA_LSB_PS,
        )


class StepDetector:
    """Detector and debouncer of steps."""

    def __init__(self) -> None:
        self.restart()

    def restart(self) -> None:
        self._seeking_peak = True
        self._extreme_mg = 0.0
        self._run = 0  # consecutive steps
        self._last_ps = 0

    def feed(self, magnitude_mg: float, at_ps: int, settings: PedometerSettings) -> int:
        if self._seeking_peak:
            self._extreme_mg = max(self._extreme_mg, magnitude_mg)
            if self._extreme_mg - magnitude_mg < settings.threshold_mg:
                return 0
            self._seeking_peak, self._extreme_mg = False, magnitude_mg
            return self._debounced(at_ps, settings)
        self._extreme_mg = min(self._extreme_mg, magnitude_mg)
        if magnitude_mg - self._extreme_mg >= settings.threshold_mg:
            self._seeking_peak, self._extreme_mg = True, magnitude_mg
        return 0

    def _debounced(self, at_ps: int, settings: PedometerSettings) -> int:
        if at_ps - self._last_ps > settings.debounce_ps:
            self._run = 0
        self._last_ps = at_ps
        self._run += 1
        first_counted = settings.debounce_steps + 1
        if self._run < first_counted:
            return 0
        return first_counted if self._run == first_counted else 1


class DeltaTime:
    """Consecutive time windows of STEP_COUNT_DELTA, each with a flag that is set by a step."""

    def __init__(self) -> None:
        self.end_ps = NEVER_PS
        self._period_ps = 0
        self._stepped = False

    def configure(self, period_ps: int, now_ps: int) -> None:
        """Start windows of length ``period_ps``; 0 stops them."""
        if period_ps != self._period_ps:
            self._period_ps, self._stepped = period_ps, False
            self.end_ps = now_ps + period_ps if period_ps else NEVER_PS

    def stepped(self) -> None:
        self._stepped = True

    def close(self) -> bool:
        """Start the next window; return whether the previous window had a step."""
        self.end_ps += self._period_ps
        stepped, self._stepped = self._stepped, False
        return stepped


# -- significant motion -------------------------------------------------------------------------------------


class SignificantMotion:
    """Counter of steps; it causes an event after enough steps."""

    def __init__(self) -> None:
        self._steps = 0

    def restart(self) -> None:
        self._steps = 0

    def feed(self, steps: int, threshold: int) -> bool:
        self._steps += steps
        if self._steps <= threshold:
            return False
        self._steps = 0
        return True


# -- tilt ---------------------------------------------------------------------------------------------------

_COS_THRESHOLD = math.cos(math.radians(35.0))
_FIRST_TIME_PS = 2 * PS_PER_S


class Tilt:
    """Detector of a change of gravity's direction since the previous event."""

    def __init__(self) -> None:
        self.restart()

    def restart(self) -> None:
        self._reference = ZERO
        self._first_time = True
        self._turned_since_ps: int | None = None

    def feed(self, acceleration: Vec3, at_ps: int) -> bool:
        """Process a sample, in any unit; return whether it causes an event."""
        if self._reference == ZERO:
            self._reference = acceleration
        if not self._turned(acceleration):
            self._turned_since_ps = None
            return False
        if self._first_time:
            if self._turned_since_ps is None:
                self._turned_since_ps = at_ps
            if at_ps - self._turned_since_ps < _FIRST_TIME_PS:
                return False
        self._reference, self._first_time = acceleration, False
        return True

    def _turned(self, acceleration: Vec3) -> bool:
        lengths = math.hypot(*acceleration) * math.hypot(*self._reference)
        dot = sum(one * other for one, other in zip(acceleration, self._reference, strict=True))
        return dot < lengths * _COS_THRESHOLD


# -- absolute wrist tilt ------------------------------------------------------------------------------------

_LATENCY_LSB_PS = 40 * PS_PER_S // 1000
_THRESHOLD_LSB_MG = 15.625
_X_POSITIVE, _X_NEGATIVE = 0x80, 0x40  # the bits of Y and Z are two and four places lower
_DIRECTIONS = (0x80, 0x40, 0x20, 0x10, 0x08, 0x04)


@dataclass(frozen=True)
class WristTiltSettings:
    """The wrist tilt's settings in bank B."""

    latency_ps: int
    threshold_mg: float
    mask: int

    @classmethod
    def decode(cls, mem: bytearray) -> WristTiltSettings:
        return cls(
            latency_ps=mem[BankB.A_WRIST_TILT_LAT.addr] * _LATENCY_LSB_PS,
            threshold_mg=mem[BankB.A_WRIST_TILT_THS.addr] * _THRESHOLD_LSB_MG,
            mask=mem[BankB.A_WRIST_TILT_Mask.addr],
        )


class WristTilt:
    """Timer that measures how long the wrist keeps each direction."""

    def __init__(self) -> None:
        self._since_ps: dict[int, int] = {}
        self._reported = 0

    def restart(self) -> None:
        self._since_ps.clear()
        self._reported = 0

    def feed(self, acceleration_mg: Vec3, at_ps: int, settings: WristTiltSettings) -> int:
        """Process a sample; return new events as bits of WRIST_TILT_IA."""
        over = _over(acceleration_mg, settings.threshold_mg) & settings.mask
        self._reported &= over
        events = 0
        for direction in _DIRECTIONS:
            if not over & direction:
                self._since_ps.pop(direction, None)
            elif at_ps - self._since_ps.setdefault(direction, at_ps) >= settings.latency_ps:
                events |= direction
        events &= ~self._reported
        self._reported |= events
        return events


def _over(acceleration_mg: Vec3, threshold_mg: float) -> int:
    over = 0
    for axis, value in enumerate(acceleration_mg):
        if value > threshold_mg:
            over |= _X_POSITIVE >> 2 * axis
        elif value < -threshold_mg:
            over |= _X_NEGATIVE >> 2 * axis
    return over


# -- all four as one feature --------------------------------------------------------------------------------

_RATE_HZ = 26
_TICKS_AT_ONCE = 256
_PEDO, _SIGN_MOTION = CTRL10_C.PEDO_EN.mask, CTRL10_C.SIGN_MOTION_EN.mask
_TILT, _WRIST_TILT = CTRL10_C.TILT_EN.mask, CTRL10_C.WRIST_TILT_EN.mask
_EVENTS: dict[int, tuple[FunctionSource, ...]] = {
    _PEDO: (STEP, STEP_OVERFLOW, STEP_DELTA),
    _SIGN_MOTION: (SIGNIFICANT_MOTION,),
    _TILT: (TILT,),
    _WRIST_TILT: (WRIST_TILT,),
}
_BANK_A = (BankA.CONFIG_PEDO_THS_MIN, BankA.SM_THS, BankA.PEDO_DEB_REG, BankA.STEP_COUNT_DELTA)
_BANK_B = (BankB.A_WRIST_TILT_LAT, BankB.A_WRIST_TILT_THS, BankB.A_WRIST_TILT_Mask)


class EmbeddedFunctions:
    """Pedometer, significant motion, tilt and wrist tilt."""

    CONFIGURATION: tuple[type[Register], ...] = (CTRL1_XL, CTRL10_C, WAKE_UP_DUR)

    def __init__(self, chip: FeatureContext, sources: FunctionSources) -> None:
        self.active = False
        self._chip = chip
        self._sources = sources
        self._mem = chip.registers.mem
        self._violations = Violations(chip)
        self._on = 0  # active functions, as bits of CTRL10_C
        self._accelerometer_on = False
        self._every, self._next = 1, 0  # samples per tick, and the sample of the next tick
        self._mg_per_lsb = MG_PER_LSB[0]
        self._steps, self._delta = StepDetector(), DeltaTime()
        self._significant_motion, self._tilt, self._wrist_tilt = SignificantMotion(), Tilt(), WristTilt()
        self._decode_banks()
        for register in (STEP_COUNTER, STEP_TIMESTAMP):
            chip.registers.before_read(register, self._before_read)
        on_bank_write(chip, BANK_A, _BANK_A, self.configure)
        on_bank_write(chip, BANK_B, _BANK_B, self.configure)

    # -- feature interface ------------------------------------------------------------------------------

    def configure(self, now_ps: int) -> None:
        control, stream = self._mem[CTRL10_C.addr], self._chip.xl
        self._follow_power(accelerometer_on=stream.running)
        self._decode_banks()
        if control & CTRL10_C.PEDO_RST_STEP.mask:
            self._write_counter(0)
        wanted = control & sum(_EVENTS) if control & CTRL10_C.FUNC_EN.mask else 0
        rate_hz = self._chip.nominal_hz(stream)
        fast_enough = rate_hz >= _RATE_HZ
        was, self._on = self._on, wanted if fast_enough else 0
        self.active = bool(self._on)
        self._begin_and_end(was, now_ps)
        if fast_enough:
            self._every = round(rate_hz / _RATE_HZ)
            self._mg_per_lsb = MG_PER_LSB[CTRL1_XL.FS_XL.get(self._mem[CTRL1_XL.addr])]
            # A restarted stream counts from 0 again; a running stream keeps its ticks.
            following = stream.latest(now_ps) + 1
            self._next = -(-following // self._every) * self._every
        self._delta.configure(self._delta_ps(), now_ps)
        too_slow = bool(wanted) and stream.running and not fast_enough
        self._violations.report(self._find_violations(too_slow=too_slow), now_ps)

    def catch_up(self, now_ps: int) -> None:
        latest = self._chip.xl.latest(now_ps)
        while self._next <= latest:
            self._work(self._next, min(latest + 1, self._next + _TICKS_AT_ONCE * self._every))
        self._close_delta_windows(now_ps)

    def reset(self, now_ps: int) -> None:
        del now_ps
        self.active, self._on = False, 0

    def next_event_ps(self) -> int:
        return min(self._chip.xl.time_ps(self._next), self._delta.end_ps)

    # -- configuration ----------------------------------------------------------------------------------

    def _follow_power(self, *, accelerometer_on: bool) -> None:
        """Reset bank B when the accelerometer leaves power-down (AN5040 6.4)."""
        if accelerometer_on and not self._accelerometer_on:
            self._chip.banks[BANK_B].reset(*_BANK_B)
        self._accelerometer_on = accelerometer_on

    def _decode_banks(self) -> None:
        bank_a = self._chip.banks[BANK_A].mem
        self._pedometer = PedometerSettings.decode(bank_a)
        self._motion_threshold = bank_a[BankA.SM_THS.addr]
        self._wrist = WristTiltSettings.decode(self._chip.banks[BANK_B].mem)

    def _begin_and_end(self, was: int, now_ps: int) -> None:
        begun, ended = self._on & ~was, was & ~self._on
        if begun and not was & (_PEDO | _SIGN_MOTION):
            self._steps.restart()
        if begun & _SIGN_MOTION:
            self._significant_motion.restart()
        if begun & _TILT:
            self._tilt.restart()
        if begun & _WRIST_TILT:
            self._wrist_tilt.restart()
        for function, events in _EVENTS.items():
            if ended & function:
                self._sources.fall(events, now_ps)

    def _delta_ps(self) -> int:
        """Return the delta time; 0 unless the pedometer and a timer of low resolution run (datasheet 11.19)."""
        return self._pedometer.delta_ps if self._on & _PEDO and self._timer_runs_slowly() else 0

    def _timer_runs_slowly(self) -> bool:
        fast = self._mem[WAKE_UP_DUR.addr] & WAKE_UP_DUR.TIMER_HR.mask
        return bool(self._mem[CTRL10_C.addr] & CTRL10_C.TIMER_EN.mask and not fast)

    def _find_violations(self, *, too_slow: bool) -> dict[tuple[str, str], bool]:
        bank_a, bank_b = self._chip.banks[BANK_A].mem, self._chip.banks[BANK_B].mem
        walks, counts = self._on & (_PEDO | _SIGN_MOTION), self._on & _PEDO
        wide = bank_a[BankA.CONFIG_PEDO_THS_MIN.addr] & BankA.CONFIG_PEDO_THS_MIN.PEDO_FS.mask
        narrow = not self._mem[CTRL1_XL.addr] & CTRL1_XL.FS_XL.mask
        return {
            ("embedded-rate", "CTRL10_C: embedded functions need CTRL1_XL.ODR_XL of 26 Hz or more"): too_slow,
            ("pedometer-range", "CONFIG_PEDO_THS_MIN.PEDO_FS = 1 needs CTRL1_XL.FS_XL of 4 g or more"): bool(
                walks and wide
            )
            and narrow,
            ("pedometer-debounce", "PEDO_DEB_REG.DEB_TIME = 0"): bool(walks)
            and not self._pedometer.debounce_ps,
            ("step-timer", "STEP_COUNT_DELTA needs TIMER_EN = 1 and TIMER_HR = 0"): bool(
                counts and self._pedometer.delta_ps
            )
            and not self._timer_runs_slowly(),
            ("wrist-tilt-threshold", "A_WRIST_TILT_THS above 0x3F"): bool(self._on & _WRIST_TILT)
            and bank_b[BankB.A_WRIST_TILT_THS.addr] > 0x3F,
        }

    # -- ticks ------------------------------------------------------------------------------------------

    def _work(self, first: int, end: int) -> None:
        rows = np.ascontiguousarray(self._chip.xl.samples(first, end)[:: self._every])
        mg = rows.view("<i2") * self._mg_per_lsb
        limit = self._pedometer.full_scale_mg
        magnitudes = np.sqrt((np.clip(mg, -limit, limit) ** 2).sum(axis=1))
        for index, magnitude, (x, y, z) in zip(
            range(first, end, self._every), magnitudes.tolist(), mg.tolist(), strict=True
        ):
            self._next = index + self._every  # set first, because an event may call this function again
            self._tick(self._chip.xl.time_ps(index), magnitude, (x, y, z))

    def _tick(self, at_ps: int, magnitude_mg: float, acceleration_mg: Vec3) -> None:
        self._close_delta_windows(at_ps)
        on = self._on
        if on & (_PEDO | _SIGN_MOTION):
            steps = self._steps.feed(magnitude_mg, at_ps, self._pedometer)
            if steps:
                self._walk(steps, at_ps)
        if on & _TILT and self._tilt.feed(acceleration_mg, at_ps):
            self._raise(TILT, at_ps)
        if on & _WRIST_TILT:
            directions = self._wrist_tilt.feed(acceleration_mg, at_ps, self._wrist)
            if directions:
                self._raise(WRIST_TILT, at_ps)
                self._mem[WRIST_TILT_IA.addr] |= directions

    def _raise(self, source: FunctionSource, at_ps: int) -> None:
        """Raise an event. The chip first processes all earlier samples, so that the FIFO stores the correct
        values.
        """
        self._chip.catch_up(at_ps - 1)
        self._sources.happened(source, at_ps)

    def _walk(self, steps: int, at_ps: int) -> None:
        if self._on & _PEDO:
            self._count(steps, at_ps)
        if self._on & _SIGN_MOTION and self._significant_motion.feed(steps, self._motion_threshold):
            self._raise(SIGNIFICANT_MOTION, at_ps)

    def _count(self, steps: int, at_ps: int) -> None:
        self._chip.catch_up(at_ps - 1)  # the FIFO copies the step counter: let it store the old value first
        total = int.from_bytes(self._mem[STEP_COUNTER.addr : STEP_COUNTER.addr + 2], "little") + steps
        if self._mem[CTRL10_C.addr] & CTRL10_C.PEDO_RST_STEP.mask:
            total = 0
        self._write_counter(total & 0xFFFF)
        self._copy_timestamp(at_ps)
        self._delta.stepped()
        self._raise(STEP, at_ps)
        if total > 0xFFFF:
            self._raise(STEP_OVERFLOW, at_ps)

    def _write_counter(self, steps: int) -> None:
        self._mem[STEP_COUNTER.addr : STEP_COUNTER.addr + 2] = steps.to_bytes(2, "little")

    def _copy_timestamp(self, at_ps: int) -> None:
        for byte in range(2):
            (value,) = self._chip.registers.read(TIMESTAMP1_REG.addr + byte, 1, at_ps)
            self._mem[STEP_TIMESTAMP.addr + byte] = value

    def _close_delta_windows(self, until_ps: int) -> None:
        while self._delta.end_ps <= until_ps:
            end_ps = self._delta.end_ps
            if self._delta.close():
                self._raise(STEP_DELTA, end_ps)

    def _before_read(self, first: int, end: int, now_ps: int) -> None:
        del first, end
        self._chip.catch_up(now_ps)
