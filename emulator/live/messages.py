"""Commands and events between a page and a session.

Each message is a JSON object. The object's ``type`` is the class name in snake case, without the ending
Command or Event. The other members are the fields of the class. Times are virtual seconds, and angles are
degrees. Terminal bytes are Latin-1.
"""

from __future__ import annotations

import binascii
import dataclasses
import json
import re
import types
import typing
from base64 import b64decode
from dataclasses import dataclass, field
from functools import cache
from typing import Any, Literal

from fcu_emulator.emulator.errors import InputError, failure_text
from fcu_emulator.emulator.text import visible

MOST_VARIABLES = 16  # watched by one page
LARGEST_FIRMWARE = 8 << 20  # bytes; ST's stock firmware with full debug information has 4 MB
LONGEST_COMMAND = 64 << 10  # characters of any command except an upload
LONGEST_UPLOAD = LARGEST_FIRMWARE * 4 // 3 + 4096  # characters of an upload in base64
# maximum number of commas, quotes and brackets in a message longer than a command; this limits the time to read
# its JSON; an upload has 15
_MOST_PIECES = 1000
FIRMWARE_FILES = (".elf", ".axf", ".out", ".hex", ".bin")
_LONGEST_NAME = 200


class MessageError(InputError):
    """A page's message is invalid."""


# -- To the session -----------------------------------------------------------------------------------------


@dataclass(frozen=True)
class PageCommand:
    """Base class of page commands. Raises MessageError for invalid values."""


@dataclass(frozen=True)
class Do(PageCommand):
    """Perform a timeline entry, which must not have the key ``at``. ``State.done`` confirms its ``id``."""

    entry: dict[str, Any]
    id: int = 0


@dataclass(frozen=True)
class Run(PageCommand):
    """Continue at the current speed."""


@dataclass(frozen=True)
class Pause(PageCommand):
    """Pause the running board."""


@dataclass(frozen=True)
class StepCommand(PageCommand):
    """Run to the next timer tick or line of text, or for one second, then pause."""

    of: Literal["tick", "line", "second"]


@dataclass(frozen=True)
class Speed(PageCommand):
    """Set the ratio of virtual to wall time, 0.01 to 10. Null removes the limit."""

    factor: float | None

    def __post_init__(self) -> None:
        if self.factor is not None and not 0.01 <= self.factor <= 10:
            raise MessageError(
                f"speed must be a factor from 0.01 to 10, or null for max, not {self.factor:g}"
            )


@dataclass(frozen=True)
class Reset(PageCommand):
    """Restart from power-on. Without a scenario, keep the board's position."""


@dataclass(frozen=True)
class FirmwareCommand(PageCommand):
    """Restart with a shipped firmware."""

    name: str


@dataclass(frozen=True)
class Upload(PageCommand):
    """Restart with firmware ``data`` in base64. The suffix of ``name`` is the file type."""

    name: str
    data: str

    def __post_init__(self) -> None:
        if len(self.name) > _LONGEST_NAME or not self.name.lower().endswith(FIRMWARE_FILES):
            raise MessageError(f"{self.name[:40]!r} must be an ELF, HEX or BIN file")

    def content(self) -> bytes:
        """Return the file. Raises MessageError for invalid base64 or an oversized file."""
        try:
            content = b64decode(self.data, validate=True)
        except (binascii.Error, ValueError) as error:
            raise MessageError(f"the upload must be base64: {error}") from error
        if len(content) > LARGEST_FIRMWARE:
            raise MessageError(f"{self.name} must have at most {LARGEST_FIRMWARE >> 20} MiB")
        return content


@dataclass(frozen=True)
class Play(PageCommand):
    """Restart with a shipped scenario, or without a scenario."""

    scenario: str | None


@dataclass(frozen=True)
class Watch(PageCommand):
    """Watch variables (``acc.AXIS_X``), registers of a sensor or peripheral, bus, and pins."""

    variables: list[str] = field(default_factory=list)
    registers: str | None = None
    bus: bool = False
    pins: bool = False

    def __post_init__(self) -> None:
        if len(self.variables) > MOST_VARIABLES or any(len(one) > _LONGEST_NAME for one in self.variables):
            raise MessageError(f"variables must be at most {MOST_VARIABLES} names")


@dataclass(frozen=True)
class RecordCommand(PageCommand):
    """Request the session since power-on as a scenario."""


@dataclass(frozen=True)
class CheckCommand(PageCommand):
    """Judge the firmware in parallel. :class:`Checked` is the answer."""

    exercise: str


# -- From the session ---------------------------------------------------------------------------------------


@dataclass(frozen=True)
class SessionEvent:
    """Base class of session events."""


@dataclass(frozen=True)
class Hello(SessionEvent):
    """Constant data, sent first. See :func:`fcu_emulator.emulator.live.transfers.outputs`."""

    board: str
    version: str
    leds: list[str]
    firmware: dict[str, str]
    scenarios: dict[str, str]
    parts: list[str]
    outputs: list[dict[str, Any]]
    ways: list[str]
    """Commands that open the serial port and the debugger from other programs."""
    gestures: list[dict[str, Any]]
    """See :func:`fcu_emulator.emulator.live.gestures.buttons`."""
    exercises: list[dict[str, Any]]
    """See :class:`fcu_emulator.emulator.live.exercises.Exercises`."""


@dataclass(frozen=True)
class StatusEvent(SessionEvent):
    """Description of the board, sent initially and after each change.

    ``run`` counts power-ons. ``sources``: paths of the source files beside the firmware file, keyed by name.
    ``state``: ``running``, ``paused``, ``failed`` or ``halted`` by a debugger.
    """

    run: int
    firmware: str
    file: str
    sources: dict[str, str]
    wiring: str
    scenario: str
    question: str
    duration_s: float
    state: str
    speed: float | None
    problem: str
    notes: list[str]
    variables: list[str]
    """Names of the firmware's global variables."""
    peripherals: list[str]
    """Names of the chip's peripherals; empty for firmware in Python."""
    recording: str


@dataclass(frozen=True)
class State(SessionEvent):
    """Current state of the board, sent 50 times a second.

    ``samples``: the firmware's latest readings, keyed by output id. ``done``: id of the latest
    :class:`Do`.
    """

    run: int
    t_s: float
    pace: float
    leds: dict[str, bool]
    truth: dict[str, Any]
    samples: dict[str, list[float]]
    variables: dict[str, float]
    load: dict[str, float]
    done: int


@dataclass(frozen=True)
class Text(SessionEvent):
    """Terminal output, starting at byte ``position``."""

    run: int
    position: int
    text: str


@dataclass(frozen=True)
class PrintedEvent(SessionEvent):
    """Numbers of a printed line, with their true values."""

    t_s: float
    values: dict[str, float]
    truth: dict[str, float]


@dataclass(frozen=True)
class PastEvent(SessionEvent):
    """Earlier states and printed numbers, for a new client."""

    run: int
    states: list[dict[str, Any]]
    prints: list[dict[str, Any]]


@dataclass(frozen=True)
class Unknown(SessionEvent):
    """Unknown or non-numeric names in a :class:`Watch`."""

    variables: list[str]


@dataclass(frozen=True)
class Checked(SessionEvent):
    """Result of judging an exercise.

    ``state``: ``checking``, ``done``, ``begun``, ``not yet``, ``unjudged`` or ``error``. ``checks``
    have title, outcome, expected, seen, hint. ``causes`` have kind, summary, details, fatal, data.
    ``outdated``: another firmware has been loaded since the judging began.
    """

    exercise: str
    state: str
    points: float = 0.0
    max_points: float = 0.0
    checks: list[dict[str, str]] = field(default_factory=list)
    causes: list[dict[str, Any]] = field(default_factory=list)
    problem: str = ""
    outdated: bool = False


@dataclass(frozen=True)
class Declared(SessionEvent):
    """Registers, as ``registers.declaration`` returns them."""

    part: dict[str, Any]


@dataclass(frozen=True)
class RegistersEvent(SessionEvent):
    """Hexadecimal register values, keyed by name. ``note`` is for the user."""

    part: str
    values: dict[str, str]
    note: str


@dataclass(frozen=True)
class Pins(SessionEvent):
    """Pin levels, as :func:`fcu_emulator.emulator.live.pins.pins` returns them."""

    pins: list[dict[str, Any]]


@dataclass(frozen=True)
class BusEvent(SessionEvent):
    """The latest transfers: time, device, register, direction, bytes, meaning, result."""

    transfers: list[dict[str, Any]]


@dataclass(frozen=True)
class Verdicts(SessionEvent):
    """Current state of the scenario's expectations."""

    verdicts: list[dict[str, str]]
    over: bool


@dataclass(frozen=True)
class Findings(SessionEvent):
    """Problems of the firmware, the most severe first."""

    findings: list[dict[str, Any]]


@dataclass(frozen=True)
class Recorded(SessionEvent):
    """The session as a scenario file."""

    text: str


@dataclass(frozen=True)
class Notice(SessionEvent):
    """Text for the user, with escaped control characters. ``kind``: ``error`` or ``info``."""

    kind: str
    text: str

    def __post_init__(self) -> None:
        object.__setattr__(self, "text", visible(self.text, lines=True))


# -- As JSON ------------------------------------------------------------------------------------------------


def encode(event: SessionEvent) -> str:
    """Return an event as JSON."""
    fields = {one.name: getattr(event, one.name) for one in dataclasses.fields(event)}
    return json.dumps({"type": _snake(type(event)), **fields}, separators=(",", ":"))


def decode(text: str) -> PageCommand:
    """Return a command from JSON. Raises MessageError."""
    is_long = len(text) > LONGEST_COMMAND
    if len(text) > LONGEST_UPLOAD or (is_long and _pieces(text) > _MOST_PIECES):
        raise _too_long(text)
    try:
        table = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise MessageError(f"a message must be JSON: {str(error)[:80]}") from error
    if not isinstance(table, dict):
        raise MessageError("a message must be an object with a type")
    kind = commands().get(str(table.pop("type", ""))[:40])
    if kind is None:
        raise MessageError(f"unknown type; known: {', '.join(commands())}")
    if is_long and kind is not Upload:
        raise _too_long(text)
    hints = typing.get_type_hints(kind)
    for name, value in table.items():
        if name not in hints:
            raise MessageError(f"{_snake(kind)}: unknown field {name[:40]!r}; known: {', '.join(_own(kind))}")
        if not _fits(value, hints[name]):
            raise MessageError(f"{_snake(kind)}: {name} has the wrong type")
    try:
        return kind(**table)
    except TypeError as error:
        raise MessageError(f"{_snake(kind)}: {error}") from error


def failure(error: Exception) -> Notice:
    """Return the notice for a failed command."""
    return Notice("error", failure_text(error))


def _too_long(text: str) -> MessageError:
    problem = f"a message must have at most {LONGEST_COMMAND} characters, not {len(text)}"
    return MessageError(f"{problem}; an upload {LONGEST_UPLOAD}")


def _pieces(text: str) -> int:
    return sum(text.count(sign) for sign in ',"[{')


@cache
def commands() -> dict[str, type[PageCommand]]:
    """Return all commands, keyed by message type."""
    return {_snake(kind): kind for kind in PageCommand.__subclasses__()}


def _own(kind: type[PageCommand]) -> list[str]:
    return [one.name for one in dataclasses.fields(kind)]


def _snake(kind: type[object]) -> str:
    """Return the message type, such as "step" for StepCommand."""
    name = re.sub(r"(Command|Event|Message)$", "", kind.__name__)
    return re.sub(r"(?<!^)(?=[A-Z])", "_", name).lower()


def _fits(value: Any, hint: Any) -> bool:
    origin, arguments = typing.get_origin(hint), typing.get_args(hint)
    if origin is Literal:
        return isinstance(value, str) and value in arguments
    if origin in (types.UnionType, typing.Union):
        return any(_fits(value, one) for one in arguments)
    if origin is list:
        return isinstance(value, list) and all(_fits(one, arguments[0]) for one in value)
    if hint in (int, float):
        kinds = (int,) if hint is int else (int, float)
        return isinstance(value, kinds) and not isinstance(value, bool) and abs(value) < 1 << 53
    return isinstance(value, origin or hint)
