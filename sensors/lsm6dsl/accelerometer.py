"""The LSM6DSL's accelerometer: from specific force to counts (datasheet Table 3; AN5040 sections 3 and 4).

Approximation: the filters' effect on the noise is modelled (its bandwidth follows the setting), their effect
on the signal is not: a sample is the world at its time, without delay or settling, and its noise is
independent of the sample before.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from fractions import Fraction

import numpy as np

from sensors.errors import Deviation, words
from sensors.lsm6dsl.errors import LSM6DSLErrors
from sensors.lsm6dsl.registers import CTRL1_XL, CTRL3_C, CTRL5_C, CTRL6_C, CTRL8_XL, X_OFS_USR
from sensors.noise import NoiseSource, noise_key
from sensors.part import Signal
from sensors.sampling import Times

# CTRL1_XL.ODR_XL codes 1 to 10 (datasheet Table 52), in Hz; the exact high rates are Table 3's.
ODR_HZ = (0, 12.5, 26, 52, 104, 208, 416, 833, 1666, 3332, 6664)
_ODR_LOWEST_CODE = 11  # 1.6 Hz in low power, 12.5 Hz otherwise

# CTRL1_XL.FS_XL: the datasheet's order is 2, 16, 4, 8 g; sensitivities from Table 3.
MG_PER_LSB = (0.061, 0.488, 0.122, 0.244)
_NOISE_FACTOR = (80 / 80, 130 / 80, 80 / 80, 90 / 80)  # Table 3: 80, 130, 80, 90 ug/sqrt(Hz)
_LOW_POWER_RMS_FACTOR = (1.8, 3.0, 2.0, 2.4)  # Table 3: mg RMS in low-power and normal mode
_LOW_POWER_LAST_CODE = 5  # up to 208 Hz XL_HM_MODE selects low-power or normal mode

_LPF2_DIVISOR = (50, 100, 9, 400)  # CTRL8_XL.HPCF_XL with LPF2_XL_EN (datasheet Table 68)
SELF_TEST_MG = 800.0  # datasheet Table 3 allows 90 to 1700 mg; one value inside, for every part
_SELF_TEST_SIGN = (0, 1, -1, 0)  # CTRL5_C.ST_XL; 3 is not allowed


@dataclass(frozen=True)
class AccelerometerSettings:
    """What the registers say about the accelerometer."""

    odr_hz: float
    scale: int  # FS_XL code
    noise_rms_factor: float  # mg RMS for each ug/sqrt(Hz) of the part's noise density
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
        if low_power:
            factor = _LOW_POWER_RMS_FACTOR[scale] / 80
        else:
            factor = _NOISE_FACTOR[scale] * math.sqrt(_bandwidth(mem[CTRL8_XL.addr], odr)) / 1000
        return cls(
            odr_hz=odr,
            scale=scale,
            noise_rms_factor=factor,
            self_test=_SELF_TEST_SIGN[CTRL5_C.ST_XL.get(mem[CTRL5_C.addr])],
            user_offset_mg=_user_offset(mem),
        )


def _odr(code: int, *, high_performance: bool) -> float:
    if code == _ODR_LOWEST_CODE:
        return 12.5 if high_performance else 1.6
    return ODR_HZ[code] if code < len(ODR_HZ) else 0  # 12 to 15 are not allowed; nothing is measured


def _bandwidth(ctrl8: int, odr_hz: float) -> float:
    if ctrl8 & CTRL8_XL.LPF2_XL_EN.mask:
        return odr_hz / _LPF2_DIVISOR[CTRL8_XL.HPCF_XL.get(ctrl8)]
    return odr_hz / 2


def _user_offset(mem: bytearray) -> tuple[float, float, float]:
    """X and Y are added to the output, Z is subtracted (AN5040 4.6; datasheet 9.91 to 9.93)."""
    weight_mg = 1000 / (64 if mem[CTRL6_C.addr] & CTRL6_C.USR_OFF_W.mask else 1024)
    x, y, z = np.frombuffer(mem, dtype=np.int8, count=3, offset=X_OFS_USR.addr).tolist()
    return x * weight_mg, y * weight_mg, -z * weight_mg


class Accelerometer:
    """Produces blocks of accelerometer samples; ``acceleration_g``: specific force in the sensor's axes."""

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
        self.settings = AccelerometerSettings(0, 0, 0.0, 0, (0.0, 0.0, 0.0))

    @property
    def rate(self) -> Fraction:
        """Output data rate in Hz; 0 in power-down."""
        return Fraction(self.settings.odr_hz).limit_denominator(10)

    def produce(self, number: int, t_s: Times) -> bytes:
        """Samples as little-endian X, Y, Z int16."""
        settings = self.settings
        mg = self._deviation.apply(1000 * self._acceleration_g(t_s), t_s, self._temperature_degc)
        if self._density:
            mg += self._density * settings.noise_rms_factor * self._noise.block(number, len(t_s))
        shift = np.array(settings.user_offset_mg) + settings.self_test * SELF_TEST_MG
        if shift.any():
            mg += shift.reshape(3, 1)
        return words(mg / MG_PER_LSB[settings.scale])


CONFIGURATION = (CTRL1_XL, CTRL3_C, CTRL5_C, CTRL6_C, CTRL8_XL)
"""The registers that change what the accelerometer puts out."""
