"""The event functions as one feature, fed with every accelerometer sample before LPF2 (AN5040 section 5).

If an event is latched (LIR) and routed to a pin, it stays set until its source register is read. SINGLE_DOUBLE_TAP
latches the double tap, not the single tap (as in 5.5.3; 5.5.1 contradicts it).
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from fcu_emulator.sensors.filters import Array
from fcu_emulator.sensors.lsm6dsl.accelerometer import MG_PER_LSB, EventSamples
from fcu_emulator.sensors.lsm6dsl.event_detectors import (
    Activity,
    Axes,
    FreeFallDetector,
    MotionFilter,
    Orientation,
    TapDetector,
    WakeUp,
)
from fcu_emulator.sensors.lsm6dsl.feature import FeatureContext, SignalName, Signals, Violations
from fcu_emulator.sensors.lsm6dsl.pins import routes
from fcu_emulator.sensors.lsm6dsl.registers import (
    CTRL1_XL,
    CTRL8_XL,
    D6D_SRC,
    FREE_FALL,
    INT_DUR2,
    MD1_CFG,
    MD2_CFG,
    TAP_CFG,
    TAP_SRC,
    TAP_THS_6D,
    WAKE_UP_DUR,
    WAKE_UP_SRC,
    WAKE_UP_THS,
)
from fcu_emulator.sensors.register import Register
from fcu_emulator.sensors.register_file import NEVER_PS


class EventOutput:
    """One event: ``bits`` in the source register. If ``latched``, the bits stay set until the register is read."""

    __slots__ = ("_name", "_signals", "bits", "latched")

    def __init__(self, signals: Signals, name: SignalName) -> None:
        self._signals = signals
        self._name: SignalName = name
        self.bits = 0
        self.latched = False

    def update(self, bits: int, at_ps: int) -> None:
        if bits == self.bits or (self.latched and not bits):
            return
        self.bits = bits
        self._signals.set(self._name, bits != 0, at_ps)

    def acknowledge(self, at_ps: int) -> None:
        if self.latched:
            self.drop(at_ps)

    def drop(self, at_ps: int) -> None:
        self.bits = 0
        self._signals.set(self._name, False, at_ps)


_FULL_SCALE_MG = (2000, 16000, 4000, 8000)  # FS_XL, in the datasheet's order
_BLOCK = 1024  # samples processed together


class Events:
    """Event functions; ``rate_changed(at_ps)`` is called when activity changes the rates."""

    CONFIGURATION: tuple[type[Register], ...] = (
        CTRL1_XL,
        CTRL8_XL,
        TAP_CFG,
        TAP_THS_6D,
        INT_DUR2,
        WAKE_UP_THS,
        WAKE_UP_DUR,
        FREE_FALL,
        MD1_CFG,
        MD2_CFG,
    )

    def __init__(
        self, chip: FeatureContext, samples: EventSamples, rate_changed: Callable[[int], None]
    ) -> None:
        self.active = False
        self.activity = Activity()
        self._chip = chip
        self._samples = samples
        self._violations = Violations(chip)
        self._low_pass_on_6d = False
        self._rate_changed = rate_changed
        self._filter = MotionFilter()
        self._free_fall, self._wake_up = FreeFallDetector(), WakeUp()
        self._orientation, self._tap = Orientation(), TapDetector()
        signals = chip.signals
        self._ff, self._wu = EventOutput(signals, "FF"), EventOutput(signals, "WU")
        self._sleep, self._six_d = EventOutput(signals, "INACT_STATE"), EventOutput(signals, "6D")
        self._single, self._double = EventOutput(signals, "SINGLE_TAP"), EventOutput(signals, "DOUBLE_TAP")
        self._outputs = (self._ff, self._wu, self._sleep, self._six_d, self._single, self._double)
        self._mg_per_lsb = MG_PER_LSB[0]
        self._next = 0  # the first unprocessed sample
        self._running = self._routed = False
        self._wire()

    def _wire(self) -> None:
        registers = self._chip.registers
        for register, after in (
            (WAKE_UP_SRC, self._after_wake_up_src),
            (TAP_SRC, self._after_tap_src),
            (D6D_SRC, self._after_d6d_src),
        ):
            registers.before_read(register, self._before_source)
            registers.after_read(register, after)

    # -- the registers ----------------------------------------------------------------------------------

    def configure(self, now_ps: int) -> None:
        mem = self._chip.registers.mem
        was_on = self.active and self._running
        self.active = bool(mem[TAP_CFG.addr] & TAP_CFG.INTERRUPTS_ENABLE.mask)
        self._running = self._chip.xl.running
        scale = CTRL1_XL.FS_XL.get(mem[CTRL1_XL.addr])
        self._mg_per_lsb = MG_PER_LSB[scale]
        self._decode(mem, _FULL_SCALE_MG[scale])
        self._route(mem)
        if not self.active:
            self.reset(now_ps)
        elif not self._running:
            self._stop(now_ps)
        elif not was_on:
            self._filter.start(from_zero=self._chip.xl.index < 0)
        self._next = self._chip.xl.latest(now_ps) + 1
        self._low_pass_on_6d = bool(mem[CTRL8_XL.addr] & CTRL8_XL.LOW_PASS_ON_6D.mask)
        self._samples.watch(
            self._chip.xl.number(self._next), on=self.active and self._running, low_pass=self._low_pass_on_6d
        )
        self._violations.report(event_violations(mem), now_ps)

    def reset(self, now_ps: int) -> None:
        self._restart()
        for output in self._outputs:
            output.drop(now_ps)

    def _stop(self, now_ps: int) -> None:
        self._restart()
        for output in self._outputs:
            if not output.latched:
                output.drop(now_ps)

    def _restart(self) -> None:
        self._running = False
        for detector in (self._free_fall, self._wake_up, self._orientation, self._tap, self.activity):
            detector.reset()

    def _decode(self, mem: bytearray, full_scale_mg: int) -> None:
        self._filter.configure(mem)
        self._free_fall.configure(mem)
        self._wake_up.configure(mem, full_scale_mg)
        self._orientation.configure(mem)
        self._tap.configure(mem, full_scale_mg)
        self.activity.configure(mem, full_scale_mg)

    def _route(self, mem: bytearray) -> None:
        int1, int2 = routes(mem)
        routed = int1 | int2
        latch = bool(mem[TAP_CFG.addr] & TAP_CFG.LIR.mask)
        double = bool(mem[WAKE_UP_THS.addr] & WAKE_UP_THS.SINGLE_DOUBLE_TAP.mask)
        self._ff.latched = latch and "FF" in routed
        self._wu.latched = latch and "WU" in routed
        self._sleep.latched = latch and "INACT_STATE" in routed
        self._six_d.latched = latch and "6D" in routed
        self._single.latched = latch and "SINGLE_TAP" in routed and not double
        self._double.latched = latch and "DOUBLE_TAP" in routed and double
        self._routed = bool(routed)

    # -- the samples ------------------------------------------------------------------------------------

    def catch_up(self, now_ps: int) -> None:
        stream = self._chip.xl
        while self._running:
            latest = stream.latest(
                now_ps
            )  # read again in each pass, because a change of the rate restarts the index
            if self._next > latest:
                return
            self._process(self._next, min(latest + 1, self._next + _BLOCK))

    def next_event_ps(self) -> int:
        """Return the next sample's time if the sample can have effects, else ``NEVER_PS``."""
        if self._running and (self._routed or self.activity.enabled):
            return self._chip.xl.time_ps(self._next)
        return NEVER_PS

    def _process(self, first: int, end: int) -> None:
        stream = self._chip.xl
        number, count = stream.number(first), end - first
        samples = tilted = self._counted(self._samples.before_lpf2(number, count))
        if self._low_pass_on_6d:
            tilted = self._counted(self._samples.after_lpf2(number, count))
        for index, sample, tilt in zip(range(first, end), samples, tilted, strict=True):
            self._next = index + 1
            at_ps = stream.time_ps(index)
            if self._step(sample, tilt, at_ps):
                self._rate_changed(at_ps)  # configures this feature again
                return

    def _counted(self, mg: Array) -> list[Axes]:
        counts = np.clip(np.rint(mg / self._mg_per_lsb), -32768, 32767)
        return list(zip(*(counts * self._mg_per_lsb).tolist(), strict=True))

    def _step(self, sample: Axes, tilt: Axes, at_ps: int) -> bool:
        """Process one sample, in mg; return whether activity changed.

        ``tilt``: the sample for orientation.
        """
        self._filter.step(sample)
        motion = self._filter.motion
        self._ff.update(self._free_fall.step(sample), at_ps)
        self._wu.update(self._wake_up.step(motion), at_ps)
        self._six_d.update(self._orientation.step(tilt), at_ps)
        changed = self.activity.step(motion)
        self._sleep.update(WAKE_UP_SRC.SLEEP_STATE_IA.mask if changed else 0, at_ps)
        if (
            changed or self.activity.inactive
        ):  # no tap is detected during inactivity, and the waking sample is not a tap
            self._tap.reset()
            tap = 0
        else:
            tap = self._tap.step(self._filter.slope)
        self._single.update(tap if tap & TAP_SRC.SINGLE_TAP.mask else 0, at_ps)
        self._double.update(tap if tap & TAP_SRC.DOUBLE_TAP.mask else 0, at_ps)
        return changed

    # -- the source registers ---------------------------------------------------------------------------

    def _before_source(self, first: int, end: int, now_ps: int) -> None:
        del first, end
        self._chip.catch_up(now_ps)
        mem = self._chip.registers.mem
        asleep = WAKE_UP_SRC.SLEEP_STATE_IA.mask if self.activity.inactive else 0
        mem[WAKE_UP_SRC.addr] = self._ff.bits | self._wu.bits | asleep
        mem[TAP_SRC.addr] = self._single.bits | self._double.bits
        data_enabled = D6D_SRC.DEN_DRDY.mask if self._chip.signals["DEN_DRDY"] else 0
        mem[D6D_SRC.addr] = self._six_d.bits | self._orientation.position | data_enabled

    def _after_wake_up_src(self, first: int, end: int, now_ps: int) -> None:
        del first, end
        for output in (self._ff, self._wu, self._sleep):
            output.acknowledge(now_ps)
        self._chip.catch_up(now_ps)

    def _after_tap_src(self, first: int, end: int, now_ps: int) -> None:
        del first, end
        self._single.acknowledge(now_ps)
        self._double.acknowledge(now_ps)
        self._chip.catch_up(now_ps)

    def _after_d6d_src(self, first: int, end: int, now_ps: int) -> None:
        del first, end
        self._six_d.acknowledge(now_ps)
        self._chip.catch_up(now_ps)


# -- invalid settings ---------------------------------------------------------------------------------------

_FASTEST_ODR = 10  # 6664 Hz: too fast for activity recognition


def event_violations(mem: bytearray) -> dict[tuple[str, str], bool]:
    """Return the invalid settings of event functions that are on (AN5040 5.5, 5.6)."""
    config = mem[TAP_CFG.addr]
    on = bool(config & TAP_CFG.INTERRUPTS_ENABLE.mask)
    tap, wake_up = TAP_THS_6D.TAP_THS.get(mem[TAP_THS_6D.addr]), WAKE_UP_THS.WK_THS.get(mem[WAKE_UP_THS.addr])
    taps = bool(config & (TAP_CFG.TAP_X_EN.mask | TAP_CFG.TAP_Y_EN.mask | TAP_CFG.TAP_Z_EN.mask))
    rests = bool(TAP_CFG.INACT_EN.get(config))
    return {
        ("tap-threshold", "TAP_THS_6D.TAP_THS not above the wake-up threshold"): on
        and taps
        and 0 < 2 * tap <= wake_up,
        ("inactivity-rate", "TAP_CFG.INACT_EN with ODR_XL above 3332 Hz"): on
        and rests
        and CTRL1_XL.ODR_XL.get(mem[CTRL1_XL.addr]) == _FASTEST_ODR,
    }
