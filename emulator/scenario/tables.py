"""What the tables of a scenario file have in common: strict types, unknown keys refused by name, units."""

from __future__ import annotations

import difflib
import re
from decimal import Decimal
from typing import Annotated, Any, Self

from pydantic import (
    BaseModel,
    ConfigDict,
    Field,
    PlainSerializer,
    PlainValidator,
    Strict,
    ValidationInfo,
    WithJsonSchema,
    model_validator,
)
from pydantic.fields import FieldInfo
from pydantic_core import PydanticCustomError

from emulator.boards.description import BoardDescription
from emulator.boards.fcu001v1 import FCU001V1
from emulator.text import shown
from emulator.time.clock import DURATION, NUMBER, PS_PER_US, format_duration, parse_duration, seconds
from emulator.world import limits
from emulator.world.limits import Range


class Table(BaseModel):
    """One table. Strict: no string becomes a number; NaN, infinity and unknown keys are errors."""

    model_config = ConfigDict(extra="forbid", strict=True, frozen=True, allow_inf_nan=False)

    @model_validator(mode="before")
    @classmethod
    def _refuse_unknown_keys(cls, data: Any) -> Any:
        """The library's own message does not say which keys there are."""
        if not isinstance(data, dict):
            return data
        known = [field.alias or name for name, field in cls.model_fields.items()]
        for key in data:
            if key not in known:
                near = difflib.get_close_matches(str(key)[:40], known, n=1)
                hint = f"did you mean {near[0]}? " if near else ""
                problem = f"unknown key; {hint}known here: {', '.join(known)}"
                raise PydanticCustomError("unknown_key", "{problem}", {"key": str(key), "problem": problem})
        return data


def within(allowed: Range) -> FieldInfo:
    """The world's own range of a quantity, so that file and world accept the same."""
    info: FieldInfo = Field(ge=allowed.low, le=allowed.high)
    return info


# TOML has arrays, not tuples: the outer type alone is taken leniently, its elements stay strict.
Vector = Annotated[tuple[float, float, float], Strict(False)]


class FieldTable(Table):
    """A magnetic field, NED in uT."""

    north_ut: Annotated[float, within(limits.FIELD)]
    east_ut: Annotated[float, within(limits.FIELD)]
    down_ut: Annotated[float, within(limits.FIELD)]


LED_NAMES, PART_NAMES = ["a LED of the board"], ["a part of the board"]
"""Stand for the names of a board's file in the JSON schema, until it is known which board it is for."""


def board_of(info: ValidationInfo) -> BoardDescription:
    """The board that a file is for."""
    board: BoardDescription = (info.context or {}).get("board", FCU001V1)
    return board


# -- Durations ("50ms") and bus speeds ("400kHz") -----------------------------------------------------------


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


class Window(Table):
    """A part of a run; without ``to`` it lasts until the end."""

    from_: Duration = Field(0, alias="from")
    to: Duration | None = None

    @model_validator(mode="after")
    def _in_order(self) -> Self:
        if self.to is not None and self.to <= self.from_:
            raise ValueError("has a window that ends before it begins; give a later to")
        return self

    def covers(self, at_ps: int) -> bool:
        """Whether this moment counts."""
        return self.from_ <= at_ps and (self.to is None or at_ps <= self.to)

    def window_text(self) -> str:
        """The window for messages; empty when it is the whole run."""
        if self.from_ == 0 and self.to is None:
            return ""
        end = "the end" if self.to is None else seconds(self.to)
        return f" from {seconds(self.from_)} to {end}"


def parse_address(value: object, info: ValidationInfo) -> int:
    """A part's name, or a 7-bit address -> the address. ValueError says what would be right."""
    known = board_of(info).addresses
    if isinstance(value, str) and value in known:
        return known[value]
    if isinstance(value, int) and not isinstance(value, bool) and 0 <= value <= 0x7F:
        return value
    names = ", ".join(f'"{name}"' for name in known)
    raise ValueError(f"is {shown(value)}; give {names}, or a 7-bit address such as 0x6B")


Address = Annotated[
    int,
    PlainValidator(parse_address),
    WithJsonSchema({"anyOf": [{"enum": PART_NAMES}, {"type": "integer"}]}),
]
