"""The LSM6DSL's gyroscope: from angular rate to counts (datasheet Table 3; AN5040 section 3).

World, deviation, noise and self-test go through the selected filters as in the accelerometer.

After power-down the drive takes 35 ms to start, the typical turn-on time of the datasheet's Table 4, then
sampling begins; out of sleep it begins at once. ``LSM6DSLErrors.gyro_turn_on_ms`` sets another time. Road not
taken: the 70 ms of AN5040's Tables 14 to 16. They are what a driver has to wait to be sure, and a part that
takes them shows 0 in the lab's first line of text, where the board shows its rates. Road not taken: samples
from the first period on, invalid until the drive runs; AN5040 does not say which it is.

The low-pass filters start from rest with the drive, so the first samples are too small: 3 of them up to
833 Hz, as AN5040's Table 16 says. Approximated: the 81 ms that Table 16 gives from 1666 Hz on are not in the
samples, which settle within a few; they are in what DRDY_MASK hides.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from fractions import Fraction

from sensors.errors import Deviation
from sensors.filtering import SampledFilter
from sensors.filters import Array, chain
from sensors.lsm6dsl.accelerometer import ODR_HZ
from sensors.lsm6dsl.declaration import LSM6DSLErrors
from sensors.lsm6dsl.filters import GyroscopeFilter, gyroscope_filter
from sensors.lsm6dsl.registers import CTRL2_G, CTRL4_C, CTRL5_C, CTRL6_C, CTRL7_G
from sensors.lsm6dsl.settling import Mode, gyroscope_discards
from sensors.noise import NoiseSource, noise_key
from sensors.part import Signal
from sensors.sampling import PS_PER_S, SampleStream, Times, words

# CTRL2_G.FS_G: 250, 500, 1000, 2000 dps; the last entry is FS_125 (Table 3).
MDPS_PER_LSB = (8.75, 17.5, 35.0, 70.0, 4.375)
_FS_125 = 4

_LOW_POWER_RMS_FACTOR = 75 / 4  # Table 3: 75 mdps RMS in low-power and normal mode, for 4 mdps/sqrt(Hz)
_LOW_POWER_LAST_CODE = 5
_PS_PER_MS = PS_PER_S // 1000

SELF_TEST_DPS = (50.0, 400.0, 400.0, 400.0, 50.0)  # Table 3 allows 20 to 80 at 250 dps, 150 to 700 at 2000
_SELF_TEST_SIGN = (0, 1, 0, -1)  # CTRL5_C.ST_G; 2 is not allowed
_OFF = Mode(0.0, high_performance=True, column=False)


@dataclass(frozen=True)
class GyroscopeSettings:
    """What the registers say about the gyroscope."""

    odr_hz: float
    scale: int  # FS_G code, or 4 for +-125 dps
    filters: GyroscopeFilter
    noise_rms_factor: float  # before the chain: mdps RMS for each mdps/sqrt(Hz) of the part's noise density
    self_test: int
    driven: bool  # also in sleep
    mode: Mode

    @classmethod
    def decode(cls, mem: bytearray) -> GyroscopeSettings:
        """Read the settings out of the main register bank."""
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
            mode=Mode(odr, not low_power, bool(mem[CTRL4_C.addr] & CTRL4_C.LPF1_SEL_G.mask)),
        )


class Gyroscope:
    """The gyroscope and its ``stream`` of samples; ``angular_rate_dps`` in the sensor's axes."""

    def __init__(
        self, angular_rate_dps: Signal, temperature_degc: Signal, errors: LSM6DSLErrors, seed: int
    ) -> None:
        self._angular_rate_dps = angular_rate_dps
        self._temperature_degc = temperature_degc
        self._density = errors.gyro_noise_mdps_rthz
        self._noise = NoiseSource(noise_key(seed, "LSM6DSL", "G"), 3)
        self._deviation = Deviation(
            errors.gyro_bias_dps,
            errors.gyro_scale_percent,
            errors.gyro_bias_drift_dps_per_degc,
            errors.gyro_scale_drift_percent_per_degc,
        )
        self.stream = SampleStream(6, self.produce)
        self._filter = SampledFilter(self._unfiltered)
        self._turn_on_ps = round(errors.gyro_turn_on_ms * _PS_PER_MS)
        self._rate_factor = errors.rate_factor
        self._drive_ready_ps = 0
        self.settings = GyroscopeSettings(0, 0, GyroscopeFilter(None, 0.0), 0.0, 0, driven=False, mode=_OFF)

    @property
    def rate(self) -> Fraction:
        """Output data rate in Hz; 0 in power-down and sleep."""
        return Fraction(self.settings.odr_hz).limit_denominator(10) * self._rate_factor

    def configure(self, mem: bytearray, now_ps: int) -> None:
        """Take over the settings of the main register bank from the next sample on."""
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
            filters = settings.filters.chain
            if filters is not None and not old.odr_hz:
                filters = chain(filters.sections, "zero")
            self._filter.restart(filters, number)
        self.settings = settings

    def drive_start_ps(self, now_ps: int) -> int:
        """How long the drive still needs before sampling can begin."""
        return max(0, self._drive_ready_ps - now_ps)

    def world_changed(self, now_ps: int | None) -> None:
        """The signals are others from ``now_ps`` on, or from the next sample on that nobody has looked at."""
        self._filter.forget(self.stream.next_number(now_ps))
        self.stream.invalidate()

    def produce(self, number: int, t_s: Times) -> bytes:
        """Samples as little-endian X, Y, Z int16."""
        settings = self.settings
        filtered = settings.filters.chain is not None
        dps = self._filter.block(number, len(t_s)) if filtered else self._sampled(number, t_s)
        return words(dps * (1000 / MDPS_PER_LSB[settings.scale]), len(t_s))

    def _unfiltered(self, number: int, count: int) -> Array:
        return self._sampled(number, self.stream.times_s(number, count))

    def _sampled(self, number: int, t_s: Times) -> Array:
        """Unfiltered, (3, n), or (3, 1) where all are the same."""
        settings = self.settings
        signal = self._angular_rate_dps(t_s - settings.filters.delay_s)
        dps = self._deviation.apply(signal, t_s, self._temperature_degc)
        if self._density:
            noise = self._noise.block(number, len(t_s))
            dps = dps + self._density * settings.noise_rms_factor / 1000 * noise
        if settings.self_test:
            dps += settings.self_test * SELF_TEST_DPS[settings.scale]
        return dps


CONFIGURATION = (CTRL2_G, CTRL4_C, CTRL5_C, CTRL6_C, CTRL7_G)
"""The registers that change what the gyroscope puts out."""
