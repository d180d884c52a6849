"""The LIS2MDL's measurement: from magnetic field to counts (datasheet Table 3; AN5069 sections 3 and 9).

Approximation: the set and reset pulses are not modelled one by one; offset cancellation lowers the noise as
Table 3 says, and the offset error is the one it leaves.
"""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction

import numpy as np

from sensors.errors import Deviation, to_int16, words
from sensors.lis2mdl.errors import LIS2MDLErrors
from sensors.lis2mdl.registers import CFG_REG_A, CFG_REG_B, CFG_REG_C, OFFSET_X_REG
from sensors.noise import NoiseSource, noise_key
from sensors.part import Signal
from sensors.sampling import PS_PER_S, Times

MGAUSS_PER_LSB = 1.5
SELF_TEST_MGAUSS = 150.0  # datasheet Table 3 allows +15 to +500 mgauss; one value inside, for every part
_ODR_HZ = (10, 20, 50, 100)
_NOISE_FACTOR = {  # Table 3's RMS noise over 4.5 mgauss, by (low power, filtered)
    (False, False): 4.5 / 4.5,
    (False, True): 3.0 / 4.5,
    (True, False): 9.0 / 4.5,
    (True, True): 6.0 / 4.5,
}


@dataclass(frozen=True)
class MagnetometerSettings:
    """What the registers say about a measurement."""

    rate: Fraction  # Hz
    turn_on_ps: int  # also the time of a single measurement (AN5069 Table 8)
    noise_factor: float
    self_test: bool
    offset_counts: tuple[int, int, int]

    @classmethod
    def decode(cls, mem: bytearray) -> MagnetometerSettings:
        """Read the settings out of the registers."""
        config, filters = mem[CFG_REG_A.addr], mem[CFG_REG_B.addr]
        low_power = bool(config & CFG_REG_A.LP.mask)
        cancelling = bool(filters & CFG_REG_B.OFF_CANC.mask)
        rate = Fraction(_ODR_HZ[CFG_REG_A.ODR.get(config)])
        turn_on_us = 6400 if low_power else 9400
        offsets = np.frombuffer(mem, dtype="<i2", count=3, offset=OFFSET_X_REG.addr).tolist()
        return cls(
            rate=rate,
            turn_on_ps=turn_on_us * PS_PER_S // 10**6 + (int(PS_PER_S / rate) if cancelling else 0),
            noise_factor=_NOISE_FACTOR[low_power, cancelling or bool(filters & CFG_REG_B.LPF.mask)],
            self_test=bool(mem[CFG_REG_C.addr] & CFG_REG_C.Self_test.mask),
            offset_counts=(offsets[0], offsets[1], offsets[2]),
        )


class Magnetometer:
    """Produces blocks of samples; ``magnetic_field_mgauss`` in the sensor's axes."""

    def __init__(
        self, magnetic_field_mgauss: Signal, temperature_degc: Signal, errors: LIS2MDLErrors, seed: int
    ) -> None:
        self._field_mgauss = magnetic_field_mgauss
        self._temperature_degc = temperature_degc
        self._noise_mgauss = errors.noise_mgauss
        self._noise = NoiseSource(noise_key(seed, "LIS2MDL"), 3)
        self._deviation = Deviation(
            errors.bias_mgauss,
            errors.scale_percent,
            errors.bias_drift_mgauss_per_degc,
            errors.scale_drift_percent_per_degc,
        )
        self.settings: MagnetometerSettings

    def produce(self, number: int, t_s: Times) -> bytes:
        """Samples as little-endian X, Y, Z int16, the hard-iron offset registers subtracted (AN5069 9)."""
        settings = self.settings
        field = self._deviation.apply(self._field_mgauss(t_s), t_s, self._temperature_degc)
        if self._noise_mgauss:
            field += self._noise_mgauss * settings.noise_factor * self._noise.block(number, len(t_s))
        if settings.self_test:
            field += SELF_TEST_MGAUSS
        counts = field / MGAUSS_PER_LSB
        if any(settings.offset_counts):
            counts = to_int16(counts) - np.array(settings.offset_counts, dtype=np.float64).reshape(3, 1)
        return words(counts)
