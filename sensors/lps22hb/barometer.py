"""The LPS22HB's measurement: from pressure and temperature to counts (datasheet Tables 3 and 4).

Approximation: the datasheet gives the noise for one setting only (0.0075 hPa RMS at 75 Hz, low noise, filter
at ODR/20). Other settings are scaled by the square root of their bandwidth relative to the rate; low current
is taken as twice as noisy. The filter does not delay the signal.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from fractions import Fraction

import numpy as np

from sensors.errors import to_int16
from sensors.lps22hb.errors import LPS22HBErrors
from sensors.lps22hb.registers import CTRL_REG1, RES_CONF, RPDS
from sensors.noise import NoiseSource, noise_key
from sensors.part import Signal
from sensors.sampling import Times

COUNTS_PER_HPA = 4096
COUNTS_PER_DEGC = 100
RPDS_COUNTS_PER_LSB = 256  # 1/16 hPa (sensor facts DIS-15; inferred from ST's AN4450 for the LPS25H)
_ODR_HZ = (0, 1, 10, 25, 50, 75)  # CTRL_REG1.ODR; 6 and 7 are not defined and measure nothing
_QUIETEST_BANDWIDTH = 1 / 20
_LOW_CURRENT_FACTOR = 2.0


@dataclass(frozen=True)
class BarometerSettings:
    """What the registers say about a measurement."""

    rate: Fraction  # Hz; 0 is power-down, where ONE_SHOT works
    noise_factor: float
    low_current: bool
    offset_counts: int

    @classmethod
    def decode(cls, mem: bytearray) -> BarometerSettings:
        """Read the settings out of the registers."""
        control = mem[CTRL_REG1.addr]
        code = CTRL_REG1.ODR.get(control)
        low_current = bool(mem[RES_CONF.addr] & RES_CONF.LC_EN.mask)
        bandwidth = 1 / 2
        if control & CTRL_REG1.EN_LPFP.mask:
            bandwidth = 1 / 20 if control & CTRL_REG1.LPFP_CFG.mask else 1 / 9
        offset = int.from_bytes(mem[RPDS.addr : RPDS.addr + 2], "little", signed=True)
        return cls(
            rate=Fraction(_ODR_HZ[code] if code < len(_ODR_HZ) else 0),
            noise_factor=math.sqrt(bandwidth / _QUIETEST_BANDWIDTH)
            * (_LOW_CURRENT_FACTOR if low_current else 1.0),
            low_current=low_current,
            offset_counts=offset * RPDS_COUNTS_PER_LSB,
        )


class Barometer:
    """Produces blocks of samples; ``pressure_hpa`` and ``temperature_degc`` have shape (n,)."""

    def __init__(
        self, pressure_hpa: Signal, temperature_degc: Signal, errors: LPS22HBErrors, seed: int
    ) -> None:
        self._pressure_hpa = pressure_hpa
        self._temperature_degc = temperature_degc
        self._errors = errors
        self._noise = NoiseSource(noise_key(seed, "LPS22HB"), 1)
        self.settings: BarometerSettings

    def produce(self, number: int, t_s: Times) -> bytes:
        """Samples as 24-bit pressure and 16-bit temperature, little-endian: five bytes each."""
        settings, errors = self.settings, self._errors
        hpa = self._pressure_hpa(t_s) + errors.pressure_bias_hpa
        if errors.pressure_noise_hpa:
            noise = self._noise.block(number, len(t_s))[0]
            hpa = hpa + errors.pressure_noise_hpa * settings.noise_factor * noise
        counts = np.rint(hpa * COUNTS_PER_HPA) - settings.offset_counts
        pressure = np.clip(counts, -(1 << 23), (1 << 23) - 1).astype("<i4")
        degc = self._temperature_degc(t_s) + errors.temperature_bias_degc
        samples = np.empty((len(t_s), 5), dtype=np.uint8)
        samples[:, :3] = pressure.view(np.uint8).reshape(-1, 4)[:, :3]
        samples[:, 3:] = to_int16(degc * COUNTS_PER_DEGC).view(np.uint8).reshape(-1, 2)
        return samples.tobytes()
