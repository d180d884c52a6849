"""The run's diary: append-only, typed events, to memory and to a JSON-lines file.

What is rare and what a user must not miss (faults, late and lost ticks, GPIO edges, functions that are not
modelled) is always kept. What happens thousands of times a second (bus transfers, register writes, terminal
bytes) is recorded only after :meth:`Trace.record_all`; until then its producers see ``trace.detailed`` False
and do not even build the event, so a trace that is off costs nothing.
"""

from __future__ import annotations

import io
import json
from collections import deque
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, ClassVar, TypeVar

from emulator.clock import PS_PER_S
from emulator.errors import LinkError

_KEPT = 200_000  # rare events in memory; older ones are dropped and counted
_KEPT_IN_DETAIL = 4_000_000  # after record_all(), several minutes of the lab's firmware


@dataclass(frozen=True, slots=True)
class TraceEvent:
    """Something that happened at ``t_ps``; ``kind`` names the type in files."""

    kind: ClassVar[str] = "event"
    t_ps: int


@dataclass(frozen=True, slots=True)
class BusTransfer(TraceEvent):
    """One transfer on a bus, from start to stop. ``t_ps`` is its start, ``end_ps`` its end.

    ``register`` is the datasheet's name of the first register; ``result`` is "ok" or what went wrong.
    """

    kind: ClassVar[str] = "bus"
    end_ps: int
    bus: str
    address: int
    device: str
    register: str
    written: bytes
    read: bytes
    result: str = "ok"


@dataclass(frozen=True, slots=True)
class RegisterWrite(TraceEvent):
    """A register of a part was written."""

    kind: ClassVar[str] = "register"
    device: str
    register: str
    old: int
    new: int


@dataclass(frozen=True, slots=True)
class DeviceNote(TraceEvent):
    """Firmware touched something a part refuses, forbids or does not model; ``what`` is which of these."""

    kind: ClassVar[str] = "note"
    device: str
    what: str
    text: str


@dataclass(frozen=True, slots=True)
class GpioEdge(TraceEvent):
    """An output pin changed its level."""

    kind: ClassVar[str] = "gpio"
    pin: str
    level: int


@dataclass(frozen=True, slots=True)
class TickLate(TraceEvent):
    """A timer callback started ``late_ps`` after its tick, because the one before was still running."""

    kind: ClassVar[str] = "tick_late"
    timer: str
    late_ps: int


@dataclass(frozen=True, slots=True)
class TickLost(TraceEvent):
    """Ticks were lost, seen when the handler came: the flag of the one before had not been cleared."""

    kind: ClassVar[str] = "tick_lost"
    timer: str
    count: int


@dataclass(frozen=True, slots=True)
class TerminalBytes(TraceEvent):
    """Bytes on the serial line; ``t_ps`` is the start of the first start bit."""

    kind: ClassVar[str] = "terminal"
    direction: str
    data: bytes


@dataclass(frozen=True, slots=True)
class Fault(TraceEvent):
    """Something was broken on purpose, or the UART lost a byte."""

    kind: ClassVar[str] = "fault"
    where: str
    text: str


EventT = TypeVar("EventT", bound=TraceEvent)


class Trace:
    """A run's events; iterate over it, or ask :meth:`of` for one type."""

    def __init__(self) -> None:
        self.detailed = False
        self.dropped = 0
        self._events: deque[TraceEvent] = deque()
        self._keep_detail = False
        self._file: io.TextIOBase | None = None
        self._path = ""

    def __len__(self) -> int:
        return len(self._events)

    def __iter__(self) -> Iterator[TraceEvent]:
        return iter(tuple(self._events))

    def of(self, kind: type[EventT]) -> list[EventT]:
        """The kept events of one type, in order."""
        return [event for event in self._events if isinstance(event, kind)]

    def record_all(self) -> None:
        """Keep every event in memory from now on, bus transfers and terminal bytes included."""
        self.detailed = self._keep_detail = True

    def write_to(self, path: str | Path) -> None:
        """Write every event from now on to a JSON-lines file. Raises LinkError if it cannot be opened."""
        self._path = str(path)
        try:
            self._file = Path(path).open("w", encoding="utf-8", newline="\n")
        except OSError as error:
            raise LinkError(
                f"trace file {path}: {error.strerror or error}; give a path that can be written"
            ) from error
        self.detailed = True

    def add(self, event: TraceEvent) -> None:
        """Record a rare event."""
        self._keep(event)
        self._write(event)

    def add_detail(self, event: TraceEvent) -> None:
        """Record a frequent event; only to be built and passed when ``detailed`` is set."""
        if self._keep_detail:
            self._keep(event)
        self._write(event)

    def close(self) -> None:
        """Close the file, if one is being written."""
        if self._file is not None:
            file, self._file = self._file, None
            try:
                file.close()
            except OSError as error:
                raise self._unwritable(error) from error

    def _unwritable(self, error: OSError) -> LinkError:
        self._file = None
        return LinkError(f"trace file {self._path}: {error.strerror or error}; the run was stopped")

    def _keep(self, event: TraceEvent) -> None:
        if len(self._events) >= (_KEPT_IN_DETAIL if self._keep_detail else _KEPT):
            self._events.popleft()
            self.dropped += 1
        self._events.append(event)

    def _write(self, event: TraceEvent) -> None:
        if self._file is not None:
            try:
                self._file.write(json.dumps(to_json(event), separators=(",", ":")) + "\n")
            except OSError as error:
                raise self._unwritable(error) from error


def to_json(event: TraceEvent) -> dict[str, Any]:
    """An event as JSON: time in seconds as an exact decimal string, bytes in hexadecimal."""
    fields = asdict(event)
    t_ps = fields.pop("t_ps")
    seconds = f"{t_ps // PS_PER_S}.{t_ps % PS_PER_S:012d}"
    return {
        "t_s": seconds,
        "kind": event.kind,
        **{name: value.hex() if isinstance(value, bytes) else value for name, value in fields.items()},
    }
