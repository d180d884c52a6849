"""Durations as people write them, on the command line and in scenario files: a number with its unit.

Decision: a unit is required and a bare number is an error. A ``for = 50`` that one reader takes for seconds
and the next for milliseconds cannot be found by looking at it.
"""

from __future__ import annotations

import re
from decimal import Decimal
from typing import Any, Final

from emulator.time.clock import PS_PER_MS, PS_PER_S, PS_PER_US

_PS_PER_UNIT = {
    "us": PS_PER_US,
    "ms": PS_PER_MS,
    "s": PS_PER_S,
    "min": 60 * PS_PER_S,
    "h": 3600 * PS_PER_S,
}
NUMBER: Final = (
    r"[0-9]{1,9}(?:\.[0-9]{1,12})?"  # bounded: no number of a million digits reaches the arithmetic
)
DURATION: Final = rf"({NUMBER}) ?({'|'.join(_PS_PER_UNIT)})"
_HELP = 'give a number and a unit (us, ms, s, min, h), such as "50ms" or "1.5s"'
_LONGEST_PS = 1_000_000 * PS_PER_S  # eleven days of virtual time
_SHOWN = 40  # characters of a bad value that a message repeats


def shown(value: object) -> str:
    """A value as messages repeat it: its beginning if it is long."""
    try:
        text = repr(value)
    except ValueError:  # an integer of more digits than Python prints
        return "a number of thousands of digits"
    return text if len(text) <= _SHOWN else text[:_SHOWN] + "..."


def parse_duration(value: Any) -> int:
    """A duration in ps; the ValueError's text says what is wrong and what would be right."""
    if isinstance(value, int | float) and not isinstance(value, bool):
        raise ValueError(f"is the bare number {shown(value)}; {_HELP} in quotes")
    match = re.fullmatch(DURATION, value) if isinstance(value, str) else None
    if isinstance(value, str) and re.fullmatch(f"-{DURATION}", value):
        raise ValueError(f'is {shown(value)}; it cannot be negative, give a time such as "50ms" or "1.5s"')
    if match is None:
        raise ValueError(f"is {shown(value)}; {_HELP}")
    duration_ps = int(Decimal(match[1]) * _PS_PER_UNIT[match[2]])
    if duration_ps > _LONGEST_PS:
        raise ValueError(f"is {shown(value)}; the longest is {_LONGEST_PS // _PS_PER_UNIT['h']}h")
    return duration_ps


def format_duration(duration_ps: int) -> str:
    """A duration as it stands in a file, exact to a picosecond."""
    for unit in ("min", "s", "ms"):
        if duration_ps and duration_ps % _PS_PER_UNIT[unit] == 0:
            return f"{duration_ps // _PS_PER_UNIT[unit]}{unit}"
    return f"{Decimal(duration_ps) / PS_PER_S:f}s"


def seconds(at_ps: int) -> str:
    """A time as messages show it."""
    return f"{at_ps / PS_PER_S:.6g} s"
