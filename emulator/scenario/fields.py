"""Field types of scenario tables: strict types, quantities with units, files, patterns.

A scenario may be untrusted, and its error messages quote files. Therefore file names must be
relative, without ``..`` or a link out of the folder. The largest recording needs 180 MB and ten
seconds.

A compiled pattern needs 500 bytes for each repetition of an element (``regex`` 2026). At the limit,
a scenario's patterns need 50 MB and 0.1 s.
"""

from __future__ import annotations

import difflib
import math
import re
import time
from collections.abc import Callable, Collection, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from decimal import Decimal
from pathlib import Path, PurePosixPath, PureWindowsPath
from typing import Annotated, Any, ClassVar, Generic, Self, TypeVar

import regex
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

from fcu_emulator.emulator.boards.description import BoardDescription
from fcu_emulator.emulator.boards.fcu001v1 import FCU001V1
from fcu_emulator.emulator.clock import (
    DURATION,
    NUMBER,
    PS_PER_US,
    format_duration,
    parse_duration,
    seconds,
)
from fcu_emulator.emulator.errors import RecordingError
from fcu_emulator.emulator.renamed import with_current_keys
from fcu_emulator.emulator.text import shown
from fcu_emulator.emulator.world import Recording, limits, load_recording
from fcu_emulator.emulator.world.limits import Range

# -- A table, and the board it is for -----------------------------------------------------------------------


class Table(BaseModel):
    """Base class of tables: strings are not converted, and NaN, infinity and unknown keys are refused."""

    model_config = ConfigDict(extra="forbid", strict=True, frozen=True, allow_inf_nan=False)

    RENAMED: ClassVar[Mapping[str, str]] = {}
    """Current names of renamed keys, by their previous names."""
    MISPLACED: ClassVar[Mapping[str, str]] = {}
    """The correct tables of keys that are often written in this table by mistake."""

    @model_validator(mode="before")
    @classmethod
    def _refuse_unknown_keys(cls, data: Any) -> Any:
        """Replace renamed keys, and refuse unknown keys."""
        if not isinstance(data, dict):
            return data
        if data.keys() & cls.RENAMED.keys():
            data = with_current_keys(data, cls.RENAMED)
        known = [field.alias or name for name, field in cls.model_fields.items()]
        for key in data:
            if key not in known:
                near = difflib.get_close_matches(str(key)[:40], known, n=1)
                hint = f"did you mean {near[0]}? " if near else ""
                problem = f"unknown key; {hint}known here: {', '.join(known)}"
                if key in cls.MISPLACED:
                    problem = f"must not be in this table; write {cls.MISPLACED[key]}"
                raise PydanticCustomError("unknown_key", "{problem}", {"key": str(key), "problem": problem})
        return data


LED_NAMES, PART_NAMES = ["a LED of the board"], ["a part of the board"]
"""Placeholders in the JSON schema for a board's names."""


def board_of(info: ValidationInfo) -> BoardDescription:
    """Return the board for which a scenario is checked."""
    board: BoardDescription = (info.context or {}).get("board", FCU001V1)
    return board


# -- Numbers ------------------------------------------------------------------------------------------------


def within(allowed: Range) -> FieldInfo:
    """Return a field that accepts the same range as the world."""
    info: FieldInfo = Field(ge=allowed.low, le=allowed.high)
    return info


# TOML has arrays, but no tuples: Strict(False) accepts an array for the tuple. The elements stay strict.
Vector = Annotated[tuple[float, float, float], Strict(False)]


class FieldTable(Table):
    """A magnetic field vector: north, east and down, in uT."""

    north_ut: Annotated[float, within(limits.FIELD)]
    east_ut: Annotated[float, within(limits.FIELD)]
    down_ut: Annotated[float, within(limits.FIELD)]


# -- Durations ("50ms"), and a part of a run ----------------------------------------------------------------


def parse_length(value: Any) -> int:
    """Return a duration of at least 1 us, in ps."""
    length_ps = parse_duration(value)
    if length_ps < PS_PER_US:
        raise ValueError(f'must be at least "1us", not {shown(value)}')
    return length_ps


def _json_string(pattern: str, example: str) -> WithJsonSchema:
    return WithJsonSchema({"type": "string", "pattern": f"^{pattern}$", "examples": [example]})


Duration = Annotated[
    int, PlainValidator(parse_duration), PlainSerializer(format_duration), _json_string(DURATION, "50ms")
]
Length = Annotated[
    int, PlainValidator(parse_length), PlainSerializer(format_duration), _json_string(DURATION, "50ms")
]


class Window(Table):
    """A part of a run, by default until the run's end."""

    from_: Duration = Field(0, alias="from")
    to: Duration | None = None

    @model_validator(mode="after")
    def _in_order(self) -> Self:
        if self.to is not None and self.to <= self.from_:
            raise ValueError("'to' must be later than 'from'")
        return self

    def covers(self, at_ps: int) -> bool:
        return self.from_ <= at_ps and (self.to is None or at_ps <= self.to)

    def window_text(self) -> str:
        """Describe the window. The text is empty for the whole run."""
        if self.from_ == 0 and self.to is None:
            return ""
        end = "the end" if self.to is None else seconds(self.to)
        return f" from {seconds(self.from_)} to {end}"


# -- Frequencies ("400kHz"), and addresses on a bus ---------------------------------------------------------


_HZ_PER_UNIT = {"Hz": 1, "kHz": 1000, "MHz": 1_000_000}
_FREQUENCY = rf"({NUMBER}) ?({'|'.join(_HZ_PER_UNIT)})"


def parse_frequency(value: Any, lowest: str, highest: str, example: str) -> int:
    """Return a frequency within limits in Hz. Raises ValueError."""
    right = f'a number and a unit (Hz, kHz, MHz) in quotes, such as "{example}"'
    if isinstance(value, int | float) and not isinstance(value, bool):
        raise ValueError(f"must be {right}, not the bare number {shown(value)}")
    hertz = _hertz_of(value) if isinstance(value, str) else None
    if hertz is None:
        raise ValueError(f"must be {right}, not {shown(value)}")
    if not (_hertz_of(lowest) or 0) <= hertz <= (_hertz_of(highest) or 0):
        raise ValueError(f'must be from "{lowest}" to "{highest}", not {shown(value)}')
    return hertz


def _hertz_of(text: str) -> int | None:
    match = re.fullmatch(_FREQUENCY, text)
    return int(Decimal(match[1]) * _HZ_PER_UNIT[match[2]]) if match else None


def format_frequency(hertz: int) -> str:
    """Return a frequency in the notation of scenario files."""
    unit = next(one for one in ("MHz", "kHz", "Hz") if hertz % _HZ_PER_UNIT[one] == 0)
    return f"{hertz // _HZ_PER_UNIT[unit]}{unit}"


def parse_bus_speed(value: Any) -> int:
    """Return a bus speed in Hz, 10 kHz to 1 MHz. Raises ValueError."""
    return parse_frequency(value, "10kHz", "1MHz", "400kHz")


def parse_crystal(value: Any) -> int:
    """Return a crystal's frequency in Hz, 4 to 26 MHz (STM32F401xB/C datasheet). Raises ValueError."""
    return parse_frequency(value, "4MHz", "26MHz", "16MHz")


_IN_HERTZ = PlainSerializer(lambda hertz: f"{hertz}Hz")
BusSpeed = Annotated[int, PlainValidator(parse_bus_speed), _IN_HERTZ, _json_string(_FREQUENCY, "400kHz")]
CrystalFrequency = Annotated[int, PlainValidator(parse_crystal), _IN_HERTZ, _json_string(_FREQUENCY, "16MHz")]


def _parse_address(value: object, info: ValidationInfo) -> int:
    """Return a 7-bit address from a number or the name of a sensor. Raises ValueError."""
    known = board_of(info).addresses
    if isinstance(value, str) and value in known:
        return known[value]
    if isinstance(value, int) and not isinstance(value, bool) and 0 <= value <= 0x7F:
        return value
    names = ", ".join(f'"{name}"' for name in known)
    raise ValueError(f"must be {names}, or a 7-bit address such as 0x6B, not {shown(value)}")


Address = Annotated[
    int,
    PlainValidator(_parse_address),
    WithJsonSchema({"anyOf": [{"enum": PART_NAMES}, {"type": "integer"}]}),
]


# -- Limits while a scenario is read ------------------------------------------------------------------------


_MAX_FILE_BYTES = 1 << 20  # in one text file
_MAX_TOTAL_BYTES = 64 << 20  # in all files of a scenario
_MAX_ELEMENTS = 10_000  # in one pattern
_MAX_TOTAL_ELEMENTS = 100_000  # in all patterns of a scenario


class Resources:
    """Files next to a scenario, with limits. All methods raise ValueError."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._bytes_left = _MAX_TOTAL_BYTES
        self._elements_left = _MAX_TOTAL_ELEMENTS
        self._texts: dict[Path, bytes] = {}
        self._recordings: dict[Path, Recording] = {}

    def text(self, name: str, what: str) -> bytes:
        """Return the contents of a small file. ``what`` describes the file in errors."""
        path = self._inside(name)
        if path not in self._texts:
            self._count(path, name)
            self._texts[path] = read_bounded(path, name, what)
        return self._texts[path]

    def recording(self, name: str) -> Recording:
        """Return a CSV recording. Each file is loaded only one time."""
        path = self._inside(name)
        if path not in self._recordings:
            self._count(path, name)
            try:
                self._recordings[path] = load_recording(path, name)
            except RecordingError as error:
                raise ValueError(str(error)) from error
        return self._recordings[path]

    def allow_pattern(self, pattern: str) -> None:
        """Count the elements of a pattern before it is compiled."""
        elements = _elements(pattern)
        self._elements_left -= elements
        if elements > _MAX_ELEMENTS:
            raise ValueError(
                f"a pattern must repeat at most {_MAX_ELEMENTS} elements; {shown(pattern)} repeats more"
            )
        if self._elements_left < 0:
            raise ValueError(
                f"{shown(pattern)} exceeds the limit for all patterns together; give fewer patterns"
            )

    def _inside(self, name: str) -> Path:
        if "\0" in name:
            raise ValueError(f'must be a path in quotes, such as "golden.txt", not {shown(name)}')
        for flavour in (
            PurePosixPath(name),
            PureWindowsPath(name),
        ):  # the result is the same on every system
            if flavour.is_absolute() or flavour.anchor or ".." in flavour.parts:
                raise ValueError(f"must be a file in the scenario's folder, not {shown(name)}")
        try:
            path = (self._folder / name).resolve()
            inside = path.is_relative_to(self._folder.resolve())
        except (OSError, RuntimeError) as error:  # RuntimeError: a link that leads to itself
            raise ValueError(f"cannot read {shown(name)}: {error}") from error
        if not inside:
            raise ValueError(f"must be a file in the scenario's folder, not the link {shown(name)}")
        return path

    def _count(self, path: Path, name: str) -> None:
        try:
            size = path.stat().st_size
        except OSError:
            return  # a later read reports the error
        self._bytes_left -= size
        if self._bytes_left < 0:
            most = f"{_MAX_TOTAL_BYTES >> 20} MiB"
            raise ValueError(f"the scenario's files must have at most {most}; {shown(name)} exceeds it")


def resources_of(info: ValidationInfo) -> Resources:
    """Return the resources of the scenario, by default of the working directory."""
    resources = (info.context or {}).get("resources")
    return resources if isinstance(resources, Resources) else Resources(Path())


def read_bounded(path: Path, name: str, what: str) -> bytes:
    """Return the contents of a regular file of at most 1 MiB. Raises ValueError."""
    try:
        if path.exists() and not path.is_file():  # opening a pipe or a terminal would block
            raise ValueError(f"{name} must be a regular file: {what}")
        with path.open("rb") as stream:
            data = stream.read(_MAX_FILE_BYTES + 1)
    except OSError as error:
        raise ValueError(f"cannot read {name}: {error.strerror or error}; give {what}") from error
    if len(data) > _MAX_FILE_BYTES:
        raise ValueError(f"{name} must have at most {_MAX_FILE_BYTES >> 20} MiB: {what}")
    return data


# -- A file that a scenario names ---------------------------------------------------------------------------


Content = TypeVar("Content")


@dataclass(frozen=True, eq=False)
class Named(Generic[Content]):
    """A file's contents, and its name in the scenario."""

    path: str
    content: Content


def _named_text(value: object, info: ValidationInfo) -> Named[bytes]:
    name = _name(value, "golden.txt")
    return Named(name, resources_of(info).text(name, "the expected text of the terminal"))


def _named_recording(value: object, info: ValidationInfo) -> Named[Recording]:
    name = _name(value, "walk.csv")
    return Named(name, resources_of(info).recording(name))


def _name(value: object, example: str) -> str:
    if not isinstance(value, str):
        raise ValueError(f'must be a path in quotes, such as "{example}", not {shown(value)}')
    return value


_AS_WRITTEN = PlainSerializer(lambda named: named.path)
_SCHEMA = WithJsonSchema({"type": "string"})
TextFile = Annotated[Named[bytes], PlainValidator(_named_text), _AS_WRITTEN, _SCHEMA]
RecordingFile = Annotated[Named[Recording], PlainValidator(_named_recording), _AS_WRITTEN, _SCHEMA]


# -- Patterns -----------------------------------------------------------------------------------------------


_LONGEST_PATTERN = 500
_LINE_PATIENCE_S = 0.5  # for each line; a search usually takes microseconds
_RUN_PATIENCE_S = 10.0  # for each run

_COUNT = re.compile(r"(\)?)\{(\d+)")  # a group's end, minimum count
_SCATTERED = re.compile(r"\(\?(#|[\w-]*x)")  # may separate a group and its count


def _elements(pattern: str) -> int:
    """Return an upper bound of the number of compiled elements."""
    counts = [(bool(group), max(int(count), 1)) for group, count in _COUNT.findall(pattern)]
    if _SCATTERED.search(pattern):
        counts = [(True, count) for _, count in counts]
    nested = math.prod(count for of_group, count in counts if of_group)
    return nested * (len(pattern) + sum(count for of_group, count in counts if not of_group))


class TimeBudget:
    """Remaining wall time for searches with untrusted patterns."""

    def __init__(self, clock_s: Callable[[], float] = time.monotonic) -> None:
        self._clock_s = clock_s
        self._left_s = _RUN_PATIENCE_S

    @property
    def exhausted(self) -> bool:
        return self._left_s <= 0.0

    @contextmanager
    def limited(self) -> Iterator[float]:
        """Yield the time limit of the search in seconds. Raises TimeoutError if no time is left."""
        if self.exhausted:
            raise TimeoutError
        began_s = self._clock_s()
        try:
            yield min(_LINE_PATIENCE_S, self._left_s)
        finally:
            self._left_s -= self._clock_s() - began_s


class TextPattern:
    """A regular expression with its source text."""

    def __init__(self, text: str) -> None:
        self.text = text
        self._compiled = regex.compile(text)

    def found_in(self, line: str, patience: TimeBudget) -> bool:
        """Return whether one line contains the pattern. Raises TimeoutError."""
        with patience.limited() as timeout_s:
            return self._compiled.search(line, timeout=timeout_s) is not None

    @property
    def groups(self) -> Collection[str]:
        names: Mapping[str, int] = self._compiled.groupindex
        return names.keys()

    def group_in(self, line: str, name: str, patience: TimeBudget) -> str | None:
        """Return the text of a group, or None without a match. Raises TimeoutError."""
        with patience.limited() as timeout_s:
            match = self._compiled.search(line, timeout=timeout_s)
        return None if match is None else match[name]


def _parse_pattern(value: object, info: ValidationInfo) -> TextPattern:
    if not isinstance(value, str) or len(value) > _LONGEST_PATTERN:
        longest = f"of at most {_LONGEST_PATTERN} characters"
        raise ValueError(f"must be a regular expression {longest}, not {shown(value)}")
    resources_of(info).allow_pattern(value)
    try:
        return TextPattern(value)
    except (regex.error, OverflowError, RecursionError) as error:
        raise ValueError(f"must be a regular expression, not {shown(value)}: {error}") from error


PatternText = Annotated[
    TextPattern,
    PlainValidator(_parse_pattern),
    PlainSerializer(lambda pattern: pattern.text),
    WithJsonSchema({"type": "string", "format": "regex", "maxLength": _LONGEST_PATTERN}),
]
