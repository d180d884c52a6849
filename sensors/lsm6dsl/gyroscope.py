"""The LSM6DSL's gyroscope: from angular rate to counts (datasheet Table 3; AN5040 section 3).

Approximation: as for the accelerometer, the filters act on the noise's bandwidth and not on the signal.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from fractions import Fraction

from sensors.errors import Deviation, words
from sensors.lsm6dsl.accelerometer import ODR_HZ
from sensors.lsm6dsl.errors import LSM6DSLErrors
from sensors.lsm6dsl.registers import CTRL2_G, CTRL4_C, CTRL5_C, CTRL7_G
from sensors.noise import NoiseSource, noise_key
from sensors.part import Signal
from sensors.sampling import Times

# CTRL2_G.FS_G: 250, 500, 1000, 2000 dps; the last entry is FS_125 (Table 3).
MDPS_PER_LSB = (8.75, 17.5, 35.0, 70.0, 4.375)
_FS_125 = 4

# Overall cut-off in Hz with LPF1 off, for ODR codes 1 to 10 (AN5040 Table 19).
_CUTOFF_HZ = (0, 4, 8, 17, 33, 67, 137, 312, 988, 1161, 1250)
_LOW_POWER_RMS_FACTOR = 75 / 4  # Table 3: 75 mdps RMS in low-power and normal mode, for 4 mdps/sqrt(Hz)
_LOW_POWER_LAST_CODE = 5

SELF_TEST_DPS = (50.0, 400.0, 400.0, 400.0, 50.0)  # Table 3 allows 20 to 80 at 250 dps, 150 to 700 at 2000
_SELF_TEST_SIGN = (0, 1, 0, -1)  # CTRL5_C.ST_G; 2 is not allowed


@dataclass(frozen=True)
class GyroscopeSettings:
    """What the registers say about the gyroscope."""

    odr_hz: float
    scale: int  # FS_G code, or 4 for +-125 dps
    noise_rms_factor: float  # mdps RMS for each mdps/sqrt(Hz) of the part's noise density
    self_test: int

    @classmethod
    def decode(cls, mem: bytearray) -> GyroscopeSettings:
        """Read the settings out of the main register bank."""
        control = mem[CTRL2_G.addr]
        code = CTRL2_G.ODR_G.get(control)
        scale = _FS_125 if control & CTRL2_G.FS_125.mask else CTRL2_G.FS_G.get(control)
        if code >= len(ODR_HZ):  # 11 to 15 are not available; nothing is measured
            code = 0
        low_power = bool(mem[CTRL7_G.addr] & CTRL7_G.G_HM_MODE.mask) and code <= _LOW_POWER_LAST_CODE
        sleeping = bool(mem[CTRL4_C.addr] & CTRL4_C.SLEEP.mask)
        return cls(
            odr_hz=0 if sleeping else ODR_HZ[code],
            scale=scale,
            noise_rms_factor=_LOW_POWER_RMS_FACTOR if low_power else math.sqrt(_CUTOFF_HZ[code]),
            self_test=_SELF_TEST_SIGN[CTRL5_C.ST_G.get(mem[CTRL5_C.addr])],
        )


class Gyroscope:
    """Produces blocks of gyroscope samples; ``angular_rate_dps`` in the sensor's axes."""

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
        self.settings = GyroscopeSettings(0, 0, 0.0, 0)

    @property
    def rate(self) -> Fraction:
        """Output data rate in Hz; 0 in power-down and sleep."""
        return Fraction(self.settings.odr_hz).limit_denominator(10)

    def produce(self, number: int, t_s: Times) -> bytes:
        """Samples as little-endian X, Y, Z int16."""
        settings = self.settings
        dps = self._deviation.apply(self._angular_rate_dps(t_s), t_s, self._temperature_degc)
        if self._density:
            dps += self._density * settings.noise_rms_factor / 1000 * self._noise.block(number, len(t_s))
        if settings.self_test:
            dps += settings.self_test * SELF_TEST_DPS[settings.scale]
        return words(dps * (1000 / MDPS_PER_LSB[settings.scale]))


CONFIGURATION = (CTRL2_G, CTRL4_C, CTRL5_C, CTRL7_G)
"""The registers that change what the gyroscope puts out."""
