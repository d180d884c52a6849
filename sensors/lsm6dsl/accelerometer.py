"""The LSM6DSL's accelerometer: from specific force to counts (datasheet Table 3; AN5040 sections 3 and 4).

Samples pass the front end, deviation, noise, self-test, the selected filters and the user offset.

Decisions about order and shape of filters (AN5040 3.7): LPF1 at ODR/2, or at 740 Hz outside high performance, precedes
decimation, and all other filters run at the output rate; low-pass filters start in the settled state, other
filters start from zero.

Decision: if the filters of the event functions are switched on while the accelerometer runs, these filters start from
the next sample as if they had settled on its value.

Decision: after a change of the bandwidth, or of the rate within low power, firmware must discard as many samples as
after a turn-on (AN5040 3.9).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from fractions import Fraction
from typing import NamedTuple, TypeAlias

import numpy as np

from fcu_emulator.sensors.filters import (
    SLOPE,
    Array,
    Chain,
    SampledFilter,
    Section,
    Source,
    Start,
    chain,
    high_pass,
    low_pass,
)
from fcu_emulator.sensors.front_end import (
    Deviation,
    Flicker,
    FrontEnd,
    Kernel,
    NoiseSource,
    add_noise,
    kernel,
    noise_key,
)
from fcu_emulator.sensors.lsm6dsl.declaration import LSM6DSLErrors
from fcu_emulator.sensors.lsm6dsl.registers import (
    CTRL1_XL,
    CTRL3_C,
    CTRL5_C,
    CTRL6_C,
    CTRL8_XL,
    X_OFS_USR,
)
from fcu_emulator.sensors.part import Signal
from fcu_emulator.sensors.sampling import SampleStream, Times, words

# CTRL1_XL.ODR_XL codes 1 to 10 (datasheet Tables 52 and 3), in Hz.
ODR_HZ = (0, 12.5, 26, 52, 104, 208, 416, 833, 1666, 3332, 6664)
_ODR_LOWEST_CODE = 11  # 1.6 Hz in low power, 12.5 Hz otherwise

# CTRL1_XL.FS_XL: 2, 16, 4, 8 g (Table 3)
MG_PER_LSB = (0.061, 0.488, 0.122, 0.244)
_NOISE_FACTOR = (80 / 80, 130 / 80, 80 / 80, 90 / 80)  # Table 3: 80, 130, 80, 90 ug/sqrt(Hz)
_LOW_POWER_RMS_FACTOR = (1.8, 3.0, 2.0, 2.4)  # Table 3: mg RMS in low-power and normal mode
_LOW_POWER_LAST_CODE = 5  # at rates up to 208 Hz, XL_HM_MODE selects low-power or normal mode

_LOW_POWER_ODR_9_FACTOR = 0.6  # filtered / unfiltered RMS, LPF2 at ODR/9 (Table 3); 0.5 for white noise
_ODR_9_CODE = 2  # CTRL8_XL.HPCF_XL

SELF_TEST_MG = 800.0  # Table 3 allows 90 to 1700 mg
_SELF_TEST_SIGN = (0, 1, -1, 0)  # CTRL5_C.ST_XL; 3 is not allowed


# -- samples to discard (AN5040 3.9, Tables 12 and 13) ------------------------------------------------------

_WIDE, _NARROW_OR_SLOPE = 0, 1  # columns of Table 13: LPF1_BW_SEL = 0, and = 1 or slope filter

# High performance by rate in Hz (Table 13).
_XL_TURN_ON = {52.0: (1, 1), 1666.0: (2, 2), 3332.0: (3, 4), 6664.0: (13, 13)}
_XL_TURN_ON_104_TO_833 = (1, 2)
_XL_TURN_ON_OTHERS = (0, 1)
_XL_MIDDLE_FROM_HZ, _XL_MIDDLE_TO_HZ = 104, 833
_XL_FROM_FAST_TO_FAST = 5  # Table 12: change between two rates above 833 Hz in high performance
_XL_CHANGE = 1  # Table 12: samples to discard in addition to those after a turn-on


class PowerMode(NamedTuple):
    """Mode of a sensor as defined in AN5040 3.9; ``odr_hz`` is 0 in power-down and sleep.

    ``column``: the second column of Table 13 or 16 applies.
    """

    odr_hz: float
    high_performance: bool
    column: bool

    @property
    def fast(self) -> bool:
        return self.high_performance and self.odr_hz > _XL_MIDDLE_TO_HZ


def accelerometer_discards(old: PowerMode, new: PowerMode) -> int:
    """Return the number of samples to discard after a change of mode."""
    if new == old or not new.odr_hz:
        return 0
    if old.fast and new.fast:
        return _XL_FROM_FAST_TO_FAST
    row = _XL_TURN_ON_OTHERS
    if new.high_performance and _XL_MIDDLE_FROM_HZ <= new.odr_hz <= _XL_MIDDLE_TO_HZ:
        row = _XL_TURN_ON_104_TO_833
    elif new.high_performance:
        row = _XL_TURN_ON.get(new.odr_hz, row)
    turn_on = row[_NARROW_OR_SLOPE if new.column else _WIDE]
    changed = old.odr_hz and old[:2] != new[:2] and (old.high_performance or new.high_performance)
    return turn_on + _XL_CHANGE if changed else turn_on


# -- samples of the event functions -------------------------------------------------------------------------

Sections: TypeAlias = tuple[Section, ...]

_UNCHANGED: Section = (1.0, 0.0, 0.0, 0.0, 0.0)


class EventFilters(NamedTuple):
    """Filters before and after LPF2: None while the accelerometer is off, () without filters."""

    before_lpf2: Sections | None
    after_lpf2: Sections | None


class EventSamples:
    """The accelerometer's samples before and after LPF2; blocks are (3, n), in mg."""

    def __init__(self, unfiltered: Source) -> None:
        self._filters = EventFilters(None, None)
        self._before, self._after = SampledFilter(unfiltered), SampledFilter(unfiltered)
        self._watched = self._low_passed = False

    # -- for the accelerometer --------------------------------------------------------------------------

    def settings_change(self, filters: EventFilters, number: int, *, restarts: bool) -> None:
        anew = restarts or filters != self._filters
        self._filters = filters
        if self._watched:
            _follow(self._before, filters.before_lpf2, number, anew=anew)
        if self._low_passed:
            _follow(self._after, filters.after_lpf2, number, anew=anew)

    def forget(self, number: int) -> None:
        if self._watched:
            self._before.forget(number)
        if self._low_passed:
            self._after.forget(number)

    # -- for the event functions ------------------------------------------------------------------------

    def watch(self, number: int, *, on: bool, low_pass: bool) -> None:
        """Enable or disable these samples from sample ``number`` on."""
        if on != self._watched:
            self._watched = on
            self._before.restart(_chain(self._filters.before_lpf2) if on else None, number)
        low_pass = on and low_pass
        if low_pass != self._low_passed:
            self._low_passed = low_pass
            self._after.restart(_chain(self._filters.after_lpf2) if low_pass else None, number)

    def before_lpf2(self, number: int, count: int) -> Array:
        return self._before.block(number, count)

    def after_lpf2(self, number: int, count: int) -> Array:
        """Return samples through LPF2, independently of the output's filter."""
        return self._after.block(number, count)


def _follow(view: SampledFilter, sections: Sections | None, number: int, *, anew: bool) -> None:
    if anew:
        view.restart(_chain(sections), number)
    else:
        view.split(number)


def _chain(sections: Sections | None) -> Chain | None:
    if sections is None:
        return None
    return chain(sections, "settled") if sections else chain((_UNCHANGED,), "zero")


# -- filters (AN5040 3.7 and Table 10) ----------------------------------------------------------------------

_DIVISOR = (50, 100, 9, 400)  # CTRL8_XL.HPCF_XL: cut-off of LPF2 and high-pass, ODR divided by this number
_SLOPE_CODE = 0  # HPCF_XL code of the slope filter, with HP_SLOPE_XL_EN
_ANALOG_WIDE_HZ, _ANALOG_NARROW_HZ = 1500, 400
_ANALOG_WIDE_FROM_HZ = 1666
_LPF1_LOW_POWER_HZ = 740  # at every rate


def accelerometer_chain(mem: bytearray, odr_hz: float) -> Chain | None:
    """Return the output's filters; None without filters."""
    if not odr_hz:
        return None
    control = mem[CTRL8_XL.addr]
    sections: list[Section] = []
    high_pass_path = bool(control & CTRL8_XL.HP_SLOPE_XL_EN.mask)
    if high_pass_path or control & CTRL8_XL.LPF2_XL_EN.mask:
        narrow = control & CTRL8_XL.INPUT_COMPOSITE.mask
    else:
        narrow = mem[CTRL1_XL.addr] & CTRL1_XL.LPF1_BW_SEL.mask
    if narrow:
        sections.append(low_pass(1 / 4))
    code = CTRL8_XL.HPCF_XL.get(control)
    start: Start = "settled"
    if high_pass_path and code == _SLOPE_CODE:
        start = "zero"
        sections.append(SLOPE)
    elif high_pass_path and control & CTRL8_XL.HP_REF_MODE.mask:
        start = "reference"
        sections.append(_UNCHANGED)
    elif high_pass_path:
        start = "zero"
        sections.append(high_pass(1 / _DIVISOR[code]))
    elif control & CTRL8_XL.LPF2_XL_EN.mask:
        sections.append(low_pass(1 / _DIVISOR[code]))
    return chain(tuple(sections), start) if sections else None


def event_filters(mem: bytearray, odr_hz: float) -> EventFilters:
    """Return the event functions' filters: LPF1 by INPUT_COMPOSITE, and LPF2 for 6D (datasheet figure 8)."""
    if not odr_hz:
        return EventFilters(None, None)
    sections = [low_pass(1 / 4)] if mem[CTRL8_XL.addr] & CTRL8_XL.INPUT_COMPOSITE.mask else []
    lpf2 = low_pass(1 / _DIVISOR[CTRL8_XL.HPCF_XL.get(mem[CTRL8_XL.addr])])
    return EventFilters(tuple(sections), (*sections, lpf2))


def analog_hz(mem: bytearray, odr_hz: float, *, high_performance: bool) -> float | None:
    """Return the cut-off of the analog stage, which is used in high-performance mode only."""
    if not high_performance:
        return None
    wide = odr_hz >= _ANALOG_WIDE_FROM_HZ and not mem[CTRL1_XL.addr] & CTRL1_XL.BW0_XL.mask
    return _ANALOG_WIDE_HZ if wide else _ANALOG_NARROW_HZ


def slow_to_settle(mem: bytearray) -> bool:
    """Return whether LPF1 at ODR/4 or the slope filter is used (AN5040 Table 13)."""
    control = mem[CTRL8_XL.addr]
    slope = control & CTRL8_XL.HP_SLOPE_XL_EN.mask and CTRL8_XL.HPCF_XL.get(control) == _SLOPE_CODE
    return bool(slope or mem[CTRL1_XL.addr] & CTRL1_XL.LPF1_BW_SEL.mask)


def reference_mode_is_idle(mem: bytearray) -> bool:
    """Return whether HP_REF_MODE is set without the high-pass filter (AN5040 3.7)."""
    control = mem[CTRL8_XL.addr]
    high_pass_on = control & CTRL8_XL.HP_SLOPE_XL_EN.mask and CTRL8_XL.HPCF_XL.get(control) != _SLOPE_CODE
    return bool(control & CTRL8_XL.HP_REF_MODE.mask and not high_pass_on)


def add_low_pass(sections: list[Section], cutoff_hz: float, odr_hz: float) -> None:
    """Add a low-pass, unless its cut-off is too high for this sample rate."""
    if cutoff_hz < odr_hz / 2:
        sections.append(low_pass(cutoff_hz / odr_hz))


# -- the sensor ---------------------------------------------------------------------------------------------

_OFF = PowerMode(0.0, high_performance=True, column=False)


@dataclass(frozen=True)
class AccelerometerSettings:
    """The accelerometer's settings in the registers."""

    odr_hz: float
    scale: int  # FS_XL code
    chain: Chain | None
    event_filters: EventFilters
    analog_hz: float | None
    mode: PowerMode
    noise_rms_factor: float  # noise before the chain: mg RMS per ug/sqrt(Hz)
    self_test: int
    user_offset_mg: tuple[float, float, float]

    @property
    def highest_mg(self) -> float:
        """Full scale of the converter."""
        return 32768 * MG_PER_LSB[self.scale]

    def kernel(self, rate_factor: float) -> Kernel:
        lpf1_hz = _LPF1_LOW_POWER_HZ if self.analog_hz is None else None
        return kernel(self.odr_hz, self.analog_hz, lpf1_hz, self.highest_mg, rate_factor=rate_factor)

    def noise_chain(self) -> Chain | None:
        sections: list[Section] = []
        if self.analog_hz is not None and self.odr_hz:
            add_low_pass(sections, self.analog_hz, self.odr_hz)
        return chain(tuple(sections), "settled") if sections else None

    @classmethod
    def decode(cls, mem: bytearray) -> AccelerometerSettings:
        control = mem[CTRL1_XL.addr]
        code, scale = CTRL1_XL.ODR_XL.get(control), CTRL1_XL.FS_XL.get(control)
        high_performance = not mem[CTRL6_C.addr] & CTRL6_C.XL_HM_MODE.mask
        odr = _odr(code, high_performance=high_performance)
        low_power = not high_performance and (code <= _LOW_POWER_LAST_CODE or code == _ODR_LOWEST_CODE)
        filters = accelerometer_chain(mem, odr)
        if low_power:
            factor = _LOW_POWER_RMS_FACTOR[scale] / 80 * _low_power_excess(mem[CTRL8_XL.addr], filters)
        else:
            factor = _NOISE_FACTOR[scale] * math.sqrt(odr / 2) / 1000
        return cls(
            odr_hz=odr,
            scale=scale,
            chain=filters,
            event_filters=event_filters(mem, odr),
            analog_hz=analog_hz(mem, odr, high_performance=not low_power),
            mode=PowerMode(odr, not low_power, slow_to_settle(mem)),
            noise_rms_factor=factor,
            self_test=_SELF_TEST_SIGN[CTRL5_C.ST_XL.get(mem[CTRL5_C.addr])],
            user_offset_mg=_user_offset(mem),
        )


def _odr(code: int, *, high_performance: bool) -> float:
    if code == _ODR_LOWEST_CODE:
        return 12.5 if high_performance else 1.6
    return ODR_HZ[code] if code < len(ODR_HZ) else 0  # 12 to 15 are not allowed; nothing is measured


def _low_power_excess(ctrl8: int, filters: Chain | None) -> float:
    """Return the factor that makes white noise meet the datasheet's filtered figure."""
    low_pass_only = not ctrl8 & CTRL8_XL.HP_SLOPE_XL_EN.mask and ctrl8 & CTRL8_XL.LPF2_XL_EN.mask
    if filters and low_pass_only and CTRL8_XL.HPCF_XL.get(ctrl8) == _ODR_9_CODE:
        return _LOW_POWER_ODR_9_FACTOR / filters.noise_gain
    return 1.0


def _user_offset(mem: bytearray) -> tuple[float, float, float]:
    """Return the user offset to add. Z is negated, because Z is subtracted (AN5040 4.6; datasheet 9.91 to 9.93)."""
    weight_mg = 1000 / (64 if mem[CTRL6_C.addr] & CTRL6_C.USR_OFF_W.mask else 1024)
    x, y, z = np.frombuffer(mem, dtype=np.int8, count=3, offset=X_OFS_USR.addr).tolist()
    return x * weight_mg, y * weight_mg, -z * weight_mg


class Accelerometer:
    """The accelerometer; ``acceleration_g`` is the specific force in sensor axes."""

    def __init__(
        self, acceleration_g: Signal, temperature_degc: Signal, errors: LSM6DSLErrors, seed: int
    ) -> None:
        self._temperature_degc = temperature_degc
        self._density = errors.acc_noise_ug_rthz
        self._noise = NoiseSource(noise_key(seed, "LSM6DSL", "XL"), 3)
        self._flicker: Flicker | None = None
        if errors.acc_bias_instability_ug:
            instability_mg = errors.acc_bias_instability_ug / 1000
            self._flicker = Flicker(seed, "LSM6DSL", "XL", channels=3, bias_instability=instability_mg)
        self._deviation = Deviation(
            errors.acc_bias_mg,
            errors.acc_scale_percent,
            errors.acc_bias_drift_mg_per_degc,
            errors.acc_scale_drift_percent_per_degc,
            errors.acc_cross_axis_percent,
        )
        self.rate_factor = errors.rate_factor
        self.stream = SampleStream(6, self.produce)
        self._front_end = FrontEnd(acceleration_g, self.stream.times_s, self._measured_mg)
        self._analog_noise = SampledFilter(self._noise.block)
        self._filter = SampledFilter(self._unfiltered)
        self.for_events = EventSamples(self._unfiltered)
        self.stream.when_world_changes(self._filter.forget)
        self.stream.when_world_changes(self.for_events.forget)
        self._noise_chain: Chain | None = None
        self.settings = AccelerometerSettings(
            0, 0, None, EventFilters(None, None), None, _OFF, 0.0, 0, (0.0, 0.0, 0.0)
        )

    @property
    def rate(self) -> Fraction:
        """Output data rate in Hz; 0 in power-down."""
        return Fraction(self.settings.odr_hz).limit_denominator(10) * self.rate_factor

    def configure(self, mem: bytearray) -> None:
        settings, old = AccelerometerSettings.decode(mem), self.settings
        if settings == old:
            return
        number = self.stream.next_number()
        if (settings.chain, settings.odr_hz) == (old.chain, old.odr_hz):
            self._filter.split(number)
        else:
            self._filter.restart(settings.chain, number)
        restarts = settings.odr_hz != old.odr_hz
        discards = accelerometer_discards(old.mode, settings.mode)
        if discards:
            self.stream.settled_number = number + discards
        self.for_events.settings_change(settings.event_filters, number, restarts=restarts)
        self.settings = settings
        if settings.odr_hz:
            self._front_end.configure(settings.kernel(float(self.rate_factor)))
        if (settings.analog_hz, settings.odr_hz) != (old.analog_hz, old.odr_hz):
            self._noise_chain = settings.noise_chain()
            self._analog_noise.restart(self._noise_chain, number)

    def produce(self, number: int, t_s: Times) -> bytes:
        settings = self.settings
        mg = self._filter.block(number, len(t_s)) if settings.chain else self._sampled(number, t_s)
        if any(settings.user_offset_mg):
            mg = mg + np.array(settings.user_offset_mg).reshape(3, 1)
        return words(mg / MG_PER_LSB[settings.scale], len(t_s))

    def _measured_mg(self, acceleration_g: Array, t_s: Times) -> Array:
        return self._deviation.apply(1000 * acceleration_g, t_s, self._temperature_degc).T

    def _unfiltered(self, number: int, count: int) -> Array:
        return self._sampled(number, self.stream.times_s(number, count))

    def _sampled(self, number: int, t_s: Times) -> Array:
        """Return unfiltered samples, (3, n), or (3, 1) if all are equal."""
        settings = self.settings
        mg = np.ascontiguousarray(self._front_end.block(number, t_s).T)
        if self._density:
            noise = self._noise if self._noise_chain is None else self._analog_noise
            white = self._density * settings.noise_rms_factor * noise.block(number, len(t_s))
            mg = add_noise(mg, white, settings.highest_mg)
        if self._flicker is not None:
            mg = add_noise(mg, self._flicker.block(t_s), settings.highest_mg)
        if settings.self_test:
            mg += settings.self_test * SELF_TEST_MG
        return mg


CONFIGURATION = (CTRL1_XL, CTRL3_C, CTRL5_C, CTRL6_C, CTRL8_XL)
"""Registers that change the accelerometer's output."""
