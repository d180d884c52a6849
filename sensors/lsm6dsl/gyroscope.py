"""The LSM6DSL's gyroscope: from angular rate to counts (datasheet Table 3; AN5040 section 3).

After power-down the drive starts within ``LSM6DSLErrors.gyro_turn_on_ms``, 35 ms in Table 4; the 70 ms of AN5040 are a
safe waiting time for drivers. The first samples follow the low-pass step response; Table 16 gives the number
of these samples. Approximation: from 1666 Hz on, samples settle within a few periods; by Table 16 this takes
81 ms.

One low-pass and the filter before decimation give the overall cut-off of Table 19; a pure delay adds the remaining
phase at 20 Hz (3.8). If the filter before decimation alone has too much delay (12.5 to 208 Hz), its cut-off is raised.
ST does not give the phase if LPF1 is off; in this case the model uses the delay of FTYPE = 3.

Decision: at a change from sleep to low power, firmware must discard as many gyroscope samples as from power-down.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from fractions import Fraction
from functools import cache
from typing import NamedTuple

import numpy as np

from fcu_emulator.sensors.filters import (
    PAGE,
    Array,
    Chain,
    SampledFilter,
    Section,
    chain,
    high_pass,
    low_pass,
    response,
)
from fcu_emulator.sensors.front_end import (
    USUAL_DECIMATION,
    Deviation,
    Flicker,
    FrontEnd,
    NoiseSource,
    add_noise,
    before_decimation,
    conversions_per_sample,
    kernel,
    noise_key,
)
from fcu_emulator.sensors.lsm6dsl.accelerometer import ODR_HZ, PowerMode
from fcu_emulator.sensors.lsm6dsl.declaration import LSM6DSLErrors
from fcu_emulator.sensors.lsm6dsl.registers import CTRL2_G, CTRL4_C, CTRL5_C, CTRL6_C, CTRL7_G
from fcu_emulator.sensors.part import Signal
from fcu_emulator.sensors.sampling import PS_PER_S, SampleStream, Times, words

# -- samples to discard (AN5040 3.9, Tables 14 to 16) -------------------------------------------------------

# High performance by rate in Hz (Table 16): LPF1 off, LPF1 on.
_G_TURN_ON = {
    12.5: (2, 2),
    26.0: (3, 3),
    52.0: (3, 3),
    104.0: (3, 4),
    208.0: (3, 5),
    416.0: (3, 6),
    833.0: (3, 9),
    1666.0: (135, 135),
    3332.0: (270, 270),
    6664.0: (540, 540),
}
_G_LOW_POWER, _G_CHANGE = 1, 2  # Table 14: low power, after the drive's start; change in high performance


def gyroscope_discards(old: PowerMode, new: PowerMode) -> int:
    """Return the number of samples to discard after a change of mode and the start of the drive."""
    if new == old or not new.odr_hz:
        return 0
    if not new.high_performance:
        return _G_LOW_POWER
    return _G_CHANGE if old.odr_hz else _G_TURN_ON[new.odr_hz][new.column]


# -- filters (AN5040 3.8) -----------------------------------------------------------------------------------

_HIGH_PASS_HZ = (0.016, 0.065, 0.260, 1.04)  # CTRL7_G.HPM_G

# Overall cut-off in Hz by ODR code (Table 19): LPF1 off, then FTYPE 0 to 3.
_CUTOFF_HZ = {
    1: (4, 4, 4, 4, 4),
    2: (8, 8, 8, 8, 8),
    3: (17, 17, 17, 17, 17),
    4: (33, 33, 33, 33, 33),
    5: (67, 67, 67, 67, 67),
    6: (137, 138, 131, 121, 138),
    7: (312, 245, 195, 155, 293),
    8: (988, 315, 224, 168, 505),
    9: (1161, 343, 234, 172, 925),
    10: (1250, 351, 237, 173, 937),
}
_LPF1_OFF = 0  # column of LPF1 off

# Phase delay in degrees at 20 Hz by ODR code, FTYPE 0 to 3.
_PHASE_HZ = 20
_PHASE_DEG = {
    3: (144, 146, 149, 142),
    4: (75, 77, 79, 73),
    5: (40, 42, 45, 39),
    6: (23, 25, 28, 21),
    7: (14, 17, 19, 13),
    8: (10, 12, 15, 8),
    9: (8, 10, 12, 6),
    10: (7, 9, 11, 5),
}
_FIRST_PHASE_CODE, _FIRST_PHASE_ODR_HZ = (
    3,
    52,
)  # at lower rates, the delay has as many sample periods as at this rate
_HIGHEST_DECIMATION, _BISECTIONS = 4.0, 40


class GyroscopeFilter(NamedTuple):
    """``chain`` filters the output; its input is the angular rate ``delay_s`` earlier.

    ``late_s``: the part of the delay not caused by the filter before decimation; ``decimation``: that filter's cut-off
    divided by the output rate.
    """

    chain: Chain | None
    delay_s: float
    late_s: float
    decimation: float


def gyroscope_filter(mem: bytearray, code: int, odr_hz: float, *, high_performance: bool) -> GyroscopeFilter:
    """Return the filters at ODR code ``code`` (1 to 10)."""
    if not odr_hz:
        return GyroscopeFilter(None, 0.0, 0.0, USUAL_DECIMATION)
    lpf1 = high_performance and mem[CTRL4_C.addr] & CTRL4_C.LPF1_SEL_G.mask
    column = 1 + CTRL6_C.FTYPE.get(mem[CTRL6_C.addr]) if lpf1 else _LPF1_OFF
    low, delay_s, late_s, decimation = _design(code, column, odr_hz)
    control = mem[CTRL7_G.addr]
    if high_performance and control & CTRL7_G.HP_EN_G.mask:
        corner = high_pass(_HIGH_PASS_HZ[CTRL7_G.HPM_G.get(control)] / odr_hz)
        return GyroscopeFilter(chain((corner, *low), "zero"), delay_s, late_s, decimation)
    return GyroscopeFilter(chain(low, "settled") if low else None, delay_s, late_s, decimation)


def _rise(filters: Chain | None, discards: int) -> Array:
    """Return the step response, 0 to 1, for the samples to be discarded after power-down or sleep."""
    if filters is None or filters.start == "zero":
        return np.empty(0)
    low = chain(filters.sections, "zero")
    response, _ = low.run(np.ones((1, PAGE)), low.at_rest(1))
    return response[0, : min(discards, low.settling)]


def high_pass_is_idle(mem: bytearray) -> bool:
    """Return whether HP_EN_G has no effect, because high performance is off (AN5040 3.8)."""
    control = mem[CTRL7_G.addr]
    low_power = control & CTRL7_G.G_HM_MODE.mask and CTRL2_G.ODR_G.get(mem[CTRL2_G.addr]) in range(1, 6)
    return bool(control & CTRL7_G.HP_EN_G.mask and low_power)


class _Design(NamedTuple):
    """The low-pass at the output rate, the delay before it, and the filter before decimation, as `GyroscopeFilter`."""

    low: tuple[Section, ...]
    delay_s: float
    late_s: float
    decimation: float


@cache
def _design(code: int, column: int, odr_hz: float) -> _Design:
    """Return the filters that have the documented cut-off, and the documented phase at 20 Hz."""
    if code < _FIRST_PHASE_CODE:
        periods = _FIRST_PHASE_ODR_HZ / odr_hz
        first = _design(_FIRST_PHASE_CODE, column, _FIRST_PHASE_ODR_HZ)
        low = _low_pass(_CUTOFF_HZ[code][column], odr_hz, first.decimation)
        return _Design(low, first.delay_s * periods, first.late_s * periods, first.decimation)
    documented_s = (
        _PHASE_DEG[code][column - 1] / 360 / _PHASE_HZ
    )  # with LPF1 off the model uses the last column
    lowest, highest = USUAL_DECIMATION, _HIGHEST_DECIMATION
    for decimation in (lowest, *(0.0,) * _BISECTIONS):
        cutoff = decimation or (lowest + highest) / 2
        low = _low_pass(_CUTOFF_HZ[code][column], odr_hz, cutoff)
        delay_s = documented_s - _phase_s(low, odr_hz)
        conversions = conversions_per_sample(odr_hz)
        late_s = delay_s - _phase_s(before_decimation(conversions, cutoff), odr_hz * conversions)
        if decimation and late_s >= 0:
            break
        lowest, highest = (cutoff, highest) if late_s < 0 else (lowest, cutoff)
    return _Design(low, delay_s, max(late_s, 0.0), cutoff)


def _low_pass(cutoff_hz: float, odr_hz: float, decimation: float) -> tuple[Section, ...]:
    """Return a low-pass that, together with the filter before decimation, has an overall cut-off of ``cutoff_hz``."""
    if cutoff_hz >= odr_hz / 2:
        return ()
    conversions = conversions_per_sample(odr_hz)
    before = response(
        before_decimation(conversions, decimation), np.array([cutoff_hz / (odr_hz * conversions)])
    )
    # |H|^2 of a Butterworth low-pass is 1 / (1 + (tan(pi f) / tan(pi fc))^4), and must be 1 / (2 |before|^2).
    excess = 2 * float(np.abs(before[0])) ** 2 - 1
    tangent = math.tan(math.pi * cutoff_hz / odr_hz) / excess**0.25
    return (low_pass(math.atan(tangent) / math.pi),)


def _phase_s(sections: tuple[Section, ...], rate_hz: float) -> float:
    """Return the delay of a 20 Hz signal by a cascade at ``rate_hz``."""
    gain = response(sections, np.array([_PHASE_HZ / rate_hz]))
    return -float(np.angle(gain[0])) / (2 * math.pi * _PHASE_HZ)


# -- the sensor ---------------------------------------------------------------------------------------------

# CTRL2_G.FS_G: 250, 500, 1000, 2000 dps, and FS_125 (Table 3).
MDPS_PER_LSB = (8.75, 17.5, 35.0, 70.0, 4.375)
_FS_125 = 4

_LOW_POWER_RMS_FACTOR = 75 / 4  # Table 3: 75 mdps RMS in low-power and normal mode, for 4 mdps/sqrt(Hz)
_LOW_POWER_LAST_CODE = 5
_PS_PER_MS = PS_PER_S // 1000

SELF_TEST_DPS = (
    50.0,
    400.0,
    400.0,
    400.0,
    50.0,
)  # dps; Table 3 allows 20 to 80 at 250 dps, and 150 to 700 at 2000 dps
_SELF_TEST_SIGN = (0, 1, 0, -1)  # CTRL5_C.ST_G; 2 is not allowed
_OFF = PowerMode(0.0, high_performance=True, column=False)


@dataclass(frozen=True)
class GyroscopeSettings:
    """The gyroscope's settings in the registers."""

    odr_hz: float
    scale: int  # FS_G code, or 4 for +-125 dps
    filters: GyroscopeFilter
    noise_rms_factor: float  # noise before the chain: mdps RMS per mdps/sqrt(Hz)
    self_test: int
    driven: bool  # the drive runs, also in sleep
    mode: PowerMode

    @property
    def highest_dps(self) -> float:
        """Full scale of the converter."""
        return 32768 * MDPS_PER_LSB[self.scale] / 1000

    @classmethod
    def decode(cls, mem: bytearray) -> GyroscopeSettings:
        control = mem[CTRL2_G.addr]
        code = CTRL2_G.ODR_G.get(control)
        scale = _FS_125 if control & CTRL2_G.FS_125.mask else CTRL2_G.FS_G.get(control)
        if code >= len(ODR_HZ):  # 11 to 15 are not available; nothing is measured
            code = 0
        low_power = bool(mem[CTRL7_G.addr] & CTRL7_G.G_HM_MODE.mask) and code <= _LOW_POWER_LAST_CODE
        odr = 0.0 if mem[CTRL4_C.addr] & CTRL4_C.SLEEP.mask else ODR_HZ[code]
        filters = gyroscope_filter(mem, code, odr, high_performance=not low_power)
        if low_power:
            factor = _LOW_POWER_RMS_FACTOR / (filters.chain.noise_gain if filters.chain else 1.0)
        else:
            factor = math.sqrt(odr / 2)
        return cls(
            odr_hz=odr,
            scale=scale,
            filters=filters,
            noise_rms_factor=factor,
            self_test=_SELF_TEST_SIGN[CTRL5_C.ST_G.get(mem[CTRL5_C.addr])],
            driven=code > 0,
            mode=PowerMode(odr, not low_power, bool(mem[CTRL4_C.addr] & CTRL4_C.LPF1_SEL_G.mask)),
        )


class Gyroscope:
    """The gyroscope; ``angular_rate_dps`` in the sensor's axes."""

    def __init__(
        self, angular_rate_dps: Signal, temperature_degc: Signal, errors: LSM6DSLErrors, seed: int
    ) -> None:
        self._temperature_degc = temperature_degc
        self._density = errors.gyro_noise_mdps_rthz
        self._noise = NoiseSource(noise_key(seed, "LSM6DSL", "G"), 3)
        self._flicker: Flicker | None = None
        if errors.gyro_bias_instability_dph:
            instability_dps = errors.gyro_bias_instability_dph / 3600
            self._flicker = Flicker(seed, "LSM6DSL", "G", channels=3, bias_instability=instability_dps)
        self._deviation = Deviation(
            errors.gyro_bias_dps,
            errors.gyro_scale_percent,
            errors.gyro_bias_drift_dps_per_degc,
            errors.gyro_scale_drift_percent_per_degc,
            errors.gyro_cross_axis_percent,
        )
        self.stream = SampleStream(6, self.produce)
        self._front_end = FrontEnd(angular_rate_dps, self.stream.times_s, self._measured_dps)
        self._filter = SampledFilter(self._unfiltered)
        self.stream.when_world_changes(self._filter.forget)
        self._turn_on_ps = round(errors.gyro_turn_on_ms * _PS_PER_MS)
        self._rate_factor = errors.rate_factor
        self._drive_ready_ps = 0
        self._rise: tuple[int, Array] = (0, np.empty(0))
        self.settings = GyroscopeSettings(
            0, 0, GyroscopeFilter(None, 0.0, 0.0, USUAL_DECIMATION), 0.0, 0, driven=False, mode=_OFF
        )

    @property
    def rate(self) -> Fraction:
        """Output data rate in Hz; 0 in power-down and sleep."""
        return Fraction(self.settings.odr_hz).limit_denominator(10) * self._rate_factor

    def configure(self, mem: bytearray, now_ps: int) -> None:
        settings, old = GyroscopeSettings.decode(mem), self.settings
        if settings == old:
            return
        if settings.driven and not old.driven:
            self._drive_ready_ps = now_ps + self._turn_on_ps
        number = self.stream.next_number()
        discards = gyroscope_discards(old.mode, settings.mode)
        if discards:
            self.stream.settled_number = number + discards
        if (settings.filters, settings.odr_hz) == (old.filters, old.odr_hz):
            self._filter.split(number)
        else:
            self._filter.restart(settings.filters.chain, number)
            if not old.odr_hz:
                self._rise = number, _rise(settings.filters.chain, discards)
        self.settings = settings
        if settings.odr_hz:
            filters = settings.filters
            before = kernel(
                settings.odr_hz,
                None,
                None,
                settings.highest_dps,
                filters.late_s,
                float(self._rate_factor),
                filters.decimation,
            )
            self._front_end.configure(before, filters.delay_s)

    def drive_start_ps(self, now_ps: int) -> int:
        return max(0, self._drive_ready_ps - now_ps)

    def produce(self, number: int, t_s: Times) -> bytes:
        settings = self.settings
        filtered = settings.filters.chain is not None
        dps = self._filter.block(number, len(t_s)) if filtered else self._sampled(number, t_s)
        first, rise = self._rise
        if number < first + len(rise):
            shares = np.ones(len(t_s))
            rising = rise[number - first :][: len(t_s)]
            shares[: len(rising)] = rising
            dps = dps * shares
        return words(dps * (1000 / MDPS_PER_LSB[settings.scale]), len(t_s))

    def _measured_dps(self, angular_rate_dps: Array, t_s: Times) -> Array:
        return self._deviation.apply(angular_rate_dps, t_s, self._temperature_degc).T

    def _unfiltered(self, number: int, count: int) -> Array:
        return self._sampled(number, self.stream.times_s(number, count))

    def _sampled(self, number: int, t_s: Times) -> Array:
        """Return unfiltered samples, (3, n), or (3, 1) if all are equal."""
        settings = self.settings
        dps = np.ascontiguousarray(self._front_end.block(number, t_s).T)
        if self._density:
            white = self._density * settings.noise_rms_factor / 1000 * self._noise.block(number, len(t_s))
            dps = add_noise(dps, white, settings.highest_dps)
        if self._flicker is not None:
            dps = add_noise(dps, self._flicker.block(t_s), settings.highest_dps)
        if settings.self_test:
            dps += settings.self_test * SELF_TEST_DPS[settings.scale]
        return dps


CONFIGURATION = (CTRL2_G, CTRL4_C, CTRL5_C, CTRL6_C, CTRL7_G)
"""Registers that change the gyroscope's output."""
