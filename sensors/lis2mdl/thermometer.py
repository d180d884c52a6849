"""The LIS2MDL's thermometer (datasheet 8.16): 12 bits, sign-extended, one value with each sample."""

from __future__ import annotations

from sensors.part import Signal
from sensors.sampling import Times, to_int16

DEGC_PER_LSB = 1 / 8
ZERO_DEGC = 25.0  # the temperature that reads 0
COUNTS = 2048  # either way


class Thermometer:
    """Produces blocks of samples; ``offset_degc`` is its error."""

    def __init__(self, temperature_degc: Signal, offset_degc: float) -> None:
        self._temperature_degc = temperature_degc
        self._offset_degc = offset_degc

    def produce(self, number: int, t_s: Times) -> bytes:
        """Samples as little-endian int16."""
        del number
        counts = (self._temperature_degc(t_s) + self._offset_degc - ZERO_DEGC) / DEGC_PER_LSB
        return to_int16(counts.clip(-COUNTS, COUNTS - 1)).tobytes()
