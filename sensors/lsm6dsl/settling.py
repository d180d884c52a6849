"""How many samples are to be discarded after a change of mode or rate (AN5040 Rev 3, 3.9, Tables 12 to 16).

Drivers discard them, and CTRL4_C.DRDY_MASK hides their data-ready. Where a table gives a range, the larger
number is taken. Decisions where the tables are silent: the accelerometer changing its rate within low power,
or its bandwidth, is taken as a turn-on; the gyroscope out of sleep into low power as out of power-down.
"""

from __future__ import annotations

from typing import NamedTuple

_WIDE, _NARROW_OR_SLOPE = 0, 1  # columns of Table 13: LPF1_BW_SEL = 0, and = 1 or slope filter

# Accelerometer in high performance by rate in Hz (Table 13); everything else is 0 or 1.
_XL_TURN_ON = {52.0: (1, 1), 1666.0: (2, 2), 3332.0: (3, 4), 6664.0: (13, 13)}
_XL_TURN_ON_104_TO_833 = (1, 2)
_XL_TURN_ON_OTHERS = (0, 1)
_XL_MIDDLE_FROM_HZ, _XL_MIDDLE_TO_HZ = 104, 833
_XL_FROM_FAST_TO_FAST = 5  # Table 12: high performance above 833 Hz before and after
_XL_CHANGE = 1  # Table 12: beyond those of a turn-on

# Gyroscope in high performance by rate in Hz (Table 16): LPF1 off, LPF1 on.
_G_TURN_ON = {
    12.5: (2, 2),
    26.0: (3, 3),
    52.0: (3, 3),
    104.0: (3, 4),
    208.0: (3, 5),
    416.0: (3, 6),
    833.0: (3, 9),
    1666.0: (135, 135),
    3332.0: (270, 270),
    6664.0: (540, 540),
}
_G_LOW_POWER, _G_CHANGE = 1, 2  # Table 14: beyond the drive's start; change in high performance


class Mode(NamedTuple):
    """A sensor's mode as the tables tell them apart; ``odr_hz`` is 0 in power-down and sleep.

    ``column``: of Table 13 or 16, whether the second one holds.
    """

    odr_hz: float
    high_performance: bool
    column: bool

    @property
    def fast(self) -> bool:
        """High performance above 833 Hz."""
        return self.high_performance and self.odr_hz > _XL_MIDDLE_TO_HZ


def accelerometer_discards(old: Mode, new: Mode) -> int:
    """Samples to discard from ``old`` to ``new``, none if they are the same."""
    if new == old or not new.odr_hz:
        return 0
    if old.fast and new.fast:
        return _XL_FROM_FAST_TO_FAST
    row = _XL_TURN_ON_OTHERS
    if new.high_performance and _XL_MIDDLE_FROM_HZ <= new.odr_hz <= _XL_MIDDLE_TO_HZ:
        row = _XL_TURN_ON_104_TO_833
    elif new.high_performance:
        row = _XL_TURN_ON.get(new.odr_hz, row)
    turn_on = row[_NARROW_OR_SLOPE if new.column else _WIDE]
    changed = old.odr_hz and old[:2] != new[:2] and (old.high_performance or new.high_performance)
    return turn_on + _XL_CHANGE if changed else turn_on


def gyroscope_discards(old: Mode, new: Mode) -> int:
    """Samples to discard from ``old`` to ``new`` once the drive runs, none if they are the same."""
    if new == old or not new.odr_hz:
        return 0
    if not new.high_performance:
        return _G_LOW_POWER
    return _G_CHANGE if old.odr_hz else _G_TURN_ON[new.odr_hz][new.column]
