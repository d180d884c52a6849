"""The LSM6DSL's thermometer (datasheet Table 4; AN5040 section 9): 256 LSB/degC, 0 is 25 degC."""

from __future__ import annotations

from fractions import Fraction

import numpy as np

from sensors.lsm6dsl.registers import CTRL6_C
from sensors.part import Signal
from sensors.sampling import SampleStream, Times, to_int16

LSB_PER_DEGC = 256
ZERO_DEGC = 25.0  # the temperature that reads 0
_RATE_HZ = Fraction(52)


class Thermometer:
    """The thermometer and its ``stream`` of samples; ``offset_degc`` is its error."""

    def __init__(self, temperature_degc: Signal, offset_degc: float) -> None:
        self._temperature_degc = temperature_degc
        self._offset_degc = offset_degc
        self.stream = SampleStream(2, self.produce)

    def produce(self, number: int, t_s: Times) -> bytes:
        """Samples as little-endian int16."""
        del number
        degc = np.broadcast_to(self._temperature_degc(t_s), t_s.shape) + self._offset_degc
        return to_int16((degc - ZERO_DEGC) * LSB_PER_DEGC).tobytes()


def thermometer_rate(mem: bytearray, xl_hz: float, *, gyroscope_on: bool) -> Fraction:
    """Nominally 52 Hz, or the rate of an accelerometer alone at 12.5 or 26 Hz in low power (AN5040 9)."""
    if gyroscope_on or not xl_hz:
        return _RATE_HZ if gyroscope_on else Fraction(0)
    low_power = bool(mem[CTRL6_C.addr] & CTRL6_C.XL_HM_MODE.mask)
    return Fraction(xl_hz) if low_power and xl_hz in (12.5, 26) else _RATE_HZ
