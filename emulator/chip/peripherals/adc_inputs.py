"""What the ADC measures on this board: battery, inner temperature sensor, reference (RM0368 11.9, 11.10).

Voltages are taken at the moment a conversion ends. An input that nothing is connected to reads 0 V, on the
board it floats.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeAlias

Volts: TypeAlias = Callable[[], float]

VDDA_V = 3.3
FULL_SCALE = 4095

_BATTERY_CHANNEL, _VREFINT_CHANNEL, _TEMPERATURE_CHANNEL = 9, 17, 18
_VREFINT_V = 1.21  # STM32F401xB/C datasheet: 1.18 to 1.24 V
_V25_V, _SLOPE_V_PER_DEGC = 0.76, 0.0025
_DIVIDER = 20 / 30  # 10k over 20k (board facts, section 2)


class AdcInputs:
    """Voltages by channel. ``battery_v`` is the battery's own voltage, one lithium cell by default."""

    def __init__(self, battery_v: float = 3.7, die_degc: float = 30.0) -> None:
        self.battery_v = battery_v
        self.die_degc = die_degc
        self._pins: dict[int, Volts] = {_BATTERY_CHANNEL: lambda: self.battery_v * _DIVIDER}

    def connect(self, channel: int, volts: Volts) -> None:
        """Connect input 0 to 15 to something outside the chip."""
        self._pins[channel] = volts

    def sample(self, channel: int, *, sensors: bool, vbat: bool) -> int:
        """The 12-bit result of a channel now.

        ``sensors``: CCR.TSVREFE switches temperature sensor and reference on; ``vbat``: CCR.VBATE gives
        channel 18 to a quarter of the backup supply instead.
        """
        code = round(self._volts(channel, sensors, vbat) / VDDA_V * FULL_SCALE)
        return min(max(code, 0), FULL_SCALE)

    def _volts(self, channel: int, sensors: bool, vbat: bool) -> float:
        if channel == _VREFINT_CHANNEL:
            return _VREFINT_V if sensors else 0.0
        if channel == _TEMPERATURE_CHANNEL:
            if vbat:
                return VDDA_V / 4
            return _V25_V + _SLOPE_V_PER_DEGC * (self.die_degc - 25) if sensors else 0.0
        source = self._pins.get(channel)
        return 0.0 if source is None else source()
