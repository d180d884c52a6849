"""Numbers with units in scenario files: durations ("50ms") and bus speeds ("400kHz")."""

from __future__ import annotations

import re
from decimal import Decimal
from typing import Annotated, Any

from pydantic import PlainSerializer, PlainValidator, WithJsonSchema

from emulator.time.clock import PS_PER_US
from emulator.time.durations import DURATION, NUMBER, format_duration, parse_duration, shown

_HZ_PER_UNIT = {"Hz": 1, "kHz": 1000, "MHz": 1_000_000}
_FREQUENCY = rf"({NUMBER}) ?({'|'.join(_HZ_PER_UNIT)})"
_FREQUENCY_HELP = 'give a number and a unit (Hz, kHz, MHz) in quotes, such as "400kHz"'
SLOWEST_BUS_HZ = 10_000
FASTEST_BUS_HZ = 1_000_000


def parse_length(value: Any) -> int:
    """A duration in ps of what must take some time."""
    length_ps = parse_duration(value)
    if length_ps < PS_PER_US:
        raise ValueError(f'is {shown(value)}; give at least "1us"')
    return length_ps


def parse_bus_speed(value: Any) -> int:
    """A bus speed in Hz, 10 kHz to 1 MHz; ValueError says what would be right."""
    if isinstance(value, int | float) and not isinstance(value, bool):
        raise ValueError(f"is the bare number {shown(value)}; {_FREQUENCY_HELP}")
    match = re.fullmatch(_FREQUENCY, value) if isinstance(value, str) else None
    if match is None:
        raise ValueError(f"is {shown(value)}; {_FREQUENCY_HELP}")
    hertz = int(Decimal(match[1]) * _HZ_PER_UNIT[match[2]])
    if not SLOWEST_BUS_HZ <= hertz <= FASTEST_BUS_HZ:
        raise ValueError(f'is {shown(value)}; give a speed from "10kHz" to "1MHz"')
    return hertz


def _json_string(pattern: str, example: str) -> WithJsonSchema:
    return WithJsonSchema({"type": "string", "pattern": f"^{pattern}$", "examples": [example]})


Duration = Annotated[
    int, PlainValidator(parse_duration), PlainSerializer(format_duration), _json_string(DURATION, "50ms")
]
Length = Annotated[
    int, PlainValidator(parse_length), PlainSerializer(format_duration), _json_string(DURATION, "50ms")
]
BusSpeed = Annotated[
    int,
    PlainValidator(parse_bus_speed),
    PlainSerializer(lambda hertz: f"{hertz}Hz"),
    _json_string(_FREQUENCY, "400kHz"),
]
