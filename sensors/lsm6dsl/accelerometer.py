"""The LSM6DSL's accelerometer: from specific force to counts (datasheet Table 3; AN5040 sections 3 and 4).

World, deviation, noise and self-test are added up as samples at the output data rate and go through the
filters the registers select (``sensors.lsm6dsl.filters``); the user offset is added behind them. Noise is
white before the filters. In high performance it has the datasheet's density; in low-power and normal mode its
RMS at a bandwidth of ODR/2, and at ODR/9, is the datasheet's.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from fractions import Fraction

import numpy as np

from sensors.errors import Deviation
from sensors.filtering import SampledFilter
from sensors.filters import Array, Chain
from sensors.lsm6dsl.declaration import LSM6DSLErrors
from sensors.lsm6dsl.event_samples import EventFilters, EventSamples
from sensors.lsm6dsl.filters import accelerometer_chain, event_filters, slow_to_settle
from sensors.lsm6dsl.registers import CTRL1_XL, CTRL3_C, CTRL5_C, CTRL6_C, CTRL8_XL, X_OFS_USR
from sensors.lsm6dsl.settling import Mode, accelerometer_discards
from sensors.noise import NoiseSource, noise_key
from sensors.part import Signal
from sensors.sampling import SampleStream, Times, words

# CTRL1_XL.ODR_XL codes 1 to 10 (datasheet Table 52), in Hz; the exact high rates are Table 3's.
ODR_HZ = (0, 12.5, 26, 52, 104, 208, 416, 833, 1666, 3332, 6664)
_ODR_LOWEST_CODE = 11  # 1.6 Hz in low power, 12.5 Hz otherwise

# CTRL1_XL.FS_XL: the datasheet's order is 2, 16, 4, 8 g; sensitivities from Table 3.
MG_PER_LSB = (0.061, 0.488, 0.122, 0.244)
_NOISE_FACTOR = (80 / 80, 130 / 80, 80 / 80, 90 / 80)  # Table 3: 80, 130, 80, 90 ug/sqrt(Hz)
_LOW_POWER_RMS_FACTOR = (1.8, 3.0, 2.0, 2.4)  # Table 3: mg RMS in low-power and normal mode
_LOW_POWER_LAST_CODE = 5  # up to 208 Hz XL_HM_MODE selects low-power or normal mode

_LOW_POWER_ODR_9_FACTOR = 0.6  # Table 3: of these with LPF2 at ODR/9, where white noise would have half
_ODR_9_CODE = 2  # CTRL8_XL.HPCF_XL

SELF_TEST_MG = 800.0  # datasheet Table 3 allows 90 to 1700 mg; one value inside, for every part
_SELF_TEST_SIGN = (0, 1, -1, 0)  # CTRL5_C.ST_XL; 3 is not allowed
_OFF = Mode(0.0, high_performance=True, column=False)


@dataclass(frozen=True)
class AccelerometerSettings:
    """What the registers say about the accelerometer."""

    odr_hz: float
    scale: int  # FS_XL code
    chain: Chain | None
    event_filters: EventFilters
    mode: Mode
    noise_rms_factor: float  # before the chain: mg RMS for each ug/sqrt(Hz) of the part's noise density
    self_test: int
    user_offset_mg: tuple[float, float, float]

    @classmethod
    def decode(cls, mem: bytearray) -> AccelerometerSettings:
        """Read the settings out of the main register bank."""
        control = mem[CTRL1_XL.addr]
        code, scale = CTRL1_XL.ODR_XL.get(control), CTRL1_XL.FS_XL.get(control)
        high_performance = not mem[CTRL6_C.addr] & CTRL6_C.XL_HM_MODE.mask
        odr = _odr(code, high_performance=high_performance)
        low_power = not high_performance and (code <= _LOW_POWER_LAST_CODE or code == _ODR_LOWEST_CODE)
        filters = accelerometer_chain(mem, odr, high_performance=not low_power)
        if low_power:
            factor = _LOW_POWER_RMS_FACTOR[scale] / 80 * _low_power_excess(mem[CTRL8_XL.addr], filters)
        else:
            factor = _NOISE_FACTOR[scale] * math.sqrt(odr / 2) / 1000
        return cls(
            odr_hz=odr,
            scale=scale,
            chain=filters,
            event_filters=event_filters(mem, odr, high_performance=not low_power),
            mode=Mode(odr, not low_power, slow_to_settle(mem)),
            noise_rms_factor=factor,
            self_test=_SELF_TEST_SIGN[CTRL5_C.ST_XL.get(mem[CTRL5_C.addr])],
            user_offset_mg=_user_offset(mem),
        )


def _odr(code: int, *, high_performance: bool) -> float:
    if code == _ODR_LOWEST_CODE:
        return 12.5 if high_performance else 1.6
    return ODR_HZ[code] if code < len(ODR_HZ) else 0  # 12 to 15 are not allowed; nothing is measured


def _low_power_excess(ctrl8: int, filters: Chain | None) -> float:
    """How much stronger than white noise it must be for the one filtered figure the datasheet gives."""
    low_pass_only = not ctrl8 & CTRL8_XL.HP_SLOPE_XL_EN.mask and ctrl8 & CTRL8_XL.LPF2_XL_EN.mask
    if filters and low_pass_only and CTRL8_XL.HPCF_XL.get(ctrl8) == _ODR_9_CODE:
        return _LOW_POWER_ODR_9_FACTOR / filters.noise_gain
    return 1.0


def _user_offset(mem: bytearray) -> tuple[float, float, float]:
    """X and Y are added to the output, Z is subtracted (AN5040 4.6; datasheet 9.91 to 9.93)."""
    weight_mg = 1000 / (64 if mem[CTRL6_C.addr] & CTRL6_C.USR_OFF_W.mask else 1024)
    x, y, z = np.frombuffer(mem, dtype=np.int8, count=3, offset=X_OFS_USR.addr).tolist()
    return x * weight_mg, y * weight_mg, -z * weight_mg


class Accelerometer:
    """The accelerometer and its ``stream`` of samples; ``acceleration_g``: specific force, sensor's axes."""

    def __init__(
        self, acceleration_g: Signal, temperature_degc: Signal, errors: LSM6DSLErrors, seed: int
    ) -> None:
        self._acceleration_g = acceleration_g
        self._temperature_degc = temperature_degc
        self._density = errors.acc_noise_ug_rthz
        self._noise = NoiseSource(noise_key(seed, "LSM6DSL", "XL"), 3)
        self._deviation = Deviation(
            errors.acc_bias_mg,
            errors.acc_scale_percent,
            errors.acc_bias_drift_mg_per_degc,
            errors.acc_scale_drift_percent_per_degc,
        )
        self.rate_factor = errors.rate_factor
        self.stream = SampleStream(6, self.produce)
        self._filter = SampledFilter(self._unfiltered)
        self.for_events = EventSamples(self._unfiltered)
        self.settings = AccelerometerSettings(
            0, 0, None, EventFilters(None, None), _OFF, 0.0, 0, (0.0, 0.0, 0.0)
        )

    @property
    def rate(self) -> Fraction:
        """Output data rate in Hz; 0 in power-down."""
        return Fraction(self.settings.odr_hz).limit_denominator(10) * self.rate_factor

    def configure(self, mem: bytearray) -> None:
        """Take over the settings of the main register bank from the next sample on."""
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

    def world_changed(self, now_ps: int | None) -> None:
        """The signals are others from ``now_ps`` on, or from the next sample on that nobody has looked at."""
        number = self.stream.next_number(now_ps)
        self._filter.forget(number)
        self.for_events.world_changed(number)
        self.stream.invalidate()

    def produce(self, number: int, t_s: Times) -> bytes:
        """Samples as little-endian X, Y, Z int16."""
        settings = self.settings
        mg = self._filter.block(number, len(t_s)) if settings.chain else self._sampled(number, t_s)
        if any(settings.user_offset_mg):
            mg = mg + np.array(settings.user_offset_mg).reshape(3, 1)
        return words(mg / MG_PER_LSB[settings.scale], len(t_s))

    def _unfiltered(self, number: int, count: int) -> Array:
        return self._sampled(number, self.stream.times_s(number, count))

    def _sampled(self, number: int, t_s: Times) -> Array:
        """Unfiltered, (3, n), or (3, 1) where all are the same."""
        settings = self.settings
        mg = self._deviation.apply(1000 * self._acceleration_g(t_s), t_s, self._temperature_degc)
        if self._density:
            mg = mg + self._density * settings.noise_rms_factor * self._noise.block(number, len(t_s))
        if settings.self_test:
            mg += settings.self_test * SELF_TEST_MG
        return mg


CONFIGURATION = (CTRL1_XL, CTRL3_C, CTRL5_C, CTRL6_C, CTRL8_XL)
"""The registers that change what the accelerometer puts out."""
