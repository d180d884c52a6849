"""What the LPS22HB draws (datasheet DocID027083 Rev 6, Table 3).

Approximation: the datasheet gives 1 uA in power-down and the figures at 1 Hz, 12 uA in low noise and 3 uA in
low current. What a measurement adds is taken to be the same at every rate, so that 25 Hz draw 25 times as
much above power-down. One-shot measurements are not counted.
"""

from __future__ import annotations

from sensors.lps22hb.barometer import BarometerSettings

_POWER_DOWN_UA = 1.0
_AT_1_HZ_UA = {False: 12.0, True: 3.0}  # by low current


def supply_current_ua(settings: BarometerSettings) -> float:
    """Mean supply current in microampere for these settings."""
    return _POWER_DOWN_UA + (_AT_1_HZ_UA[settings.low_current] - _POWER_DOWN_UA) * float(settings.rate)
