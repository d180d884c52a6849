"""Trace of a run: typed events for memory, JSON-lines files and subscribers.

Rare events (faults, late and lost ticks, GPIO edges, notes) are always kept. Frequent events (bus
transfers, register writes, terminal bytes) are built only on request. A JSON line has the time, the
kind, and the event's fields. Times are exact decimal strings in seconds, and bytes are hexadecimal.
"""

from __future__ import annotations

import json
from collections import deque
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, fields
from functools import lru_cache
from json.encoder import encode_basestring_ascii as quoted
from pathlib import Path
from typing import Any, ClassVar, TypeAlias, TypeVar

from fcu_emulator.emulator.clock import PS_PER_S
from fcu_emulator.emulator.errors import OutputError
from fcu_emulator.emulator.host.files import BoundedFile

NoteValue: TypeAlias = int | float | str


@dataclass(frozen=True, slots=True)
class TraceEvent:
    """An event at ``t_ps``. Files contain its ``kind``."""

    kind: ClassVar[str] = "event"
    t_ps: int

    @property
    def t_s(self) -> float:
        """Time in seconds since power-on."""
        return self.t_ps / PS_PER_S


@dataclass(frozen=True, slots=True)
class BusTransfer(TraceEvent):
    """One bus transfer, from start ``t_ps`` to stop ``end_ps``.

    ``register`` is the first register's name, and ``result`` is "ok" or the failure.
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

    @property
    def end_s(self) -> float:
        """End in seconds since power-on."""
        return self.end_ps / PS_PER_S


@dataclass(frozen=True, slots=True)
class RegisterWrite(TraceEvent):
    """A write to a sensor's register."""

    kind: ClassVar[str] = "register"
    device: str
    register: str
    old: int
    new: int


@dataclass(frozen=True, slots=True)
class DeviceNote(TraceEvent):
    """An access that a device refuses, forbids or does not model. ``what`` is the kind of access.

    ``problem`` is a stable identifier such as "scl-too-fast". ``data`` contains the values in
    ``text``, keyed by name.
    """

    kind: ClassVar[str] = "note"
    device: str
    what: str
    text: str
    problem: str = ""
    data: Mapping[str, NoteValue] = field(default_factory=dict, hash=False)


@dataclass(frozen=True, slots=True)
class GpioEdge(TraceEvent):
    """A level change of an output pin."""

    kind: ClassVar[str] = "gpio"
    pin: str
    level: int


@dataclass(frozen=True, slots=True)
class TickLate(TraceEvent):
    """A timer callback that started ``late_ps`` late, because the previous callback was running."""

    kind: ClassVar[str] = "tick_late"
    timer: str
    late_ps: int

    @property
    def late_s(self) -> float:
        """Delay of the callback in seconds."""
        return self.late_ps / PS_PER_S


@dataclass(frozen=True, slots=True)
class TickLost(TraceEvent):
    """Ticks that were lost because the previous tick's flag was still set."""

    kind: ClassVar[str] = "tick_lost"
    timer: str
    count: int


@dataclass(frozen=True, slots=True)
class TerminalBytes(TraceEvent):
    """Bytes on the serial line. ``t_ps`` is the start of the first start bit."""

    kind: ClassVar[str] = "terminal"
    direction: str
    data: bytes


@dataclass(frozen=True, slots=True)
class Fault(TraceEvent):
    """An injected fault or a byte lost by the UART."""

    kind: ClassVar[str] = "fault"
    where: str
    text: str


def line(event: TraceEvent) -> str:
    """Return the event's JSON line with line end."""
    if isinstance(event, BusTransfer):
        return transfer_line(
            event.t_ps,
            event.end_ps,
            event.bus,
            event.address,
            event.device,
            event.register,
            event.written,
            event.read,
            event.result,
        )
    texts = [f'"t_s":{_seconds(event.t_ps)}', f'"kind":{quoted(event.kind)}']
    for name in _NAMES[type(event)]:
        value = getattr(event, name)
        if name.endswith("_ps"):
            texts.append(f'"{name[:-3]}_s":{_seconds(value)}')
        else:
            texts.append(f'"{name}":{_TEXTS[type(value)](value)}')
    return f"{{{','.join(texts)}}}\n"


def transfer_line(
    t_ps: int,
    end_ps: int,
    bus: str,
    address: int,
    device: str,
    register: str,
    written: bytes,
    read: bytes,
    result: str,
) -> str:
    """Return the line of a :class:`BusTransfer`."""
    begin, end = _of_transfers(bus, address, device, register, written, result)
    times = f'"t_s":{_seconds(t_ps)},"kind":"bus","end_s":{_seconds(end_ps)}'
    return f'{{{times},{begin},"read":"{read.hex()}",{end}}}\n'


@lru_cache(maxsize=1024)
def _of_transfers(
    bus: str, address: int, device: str, register: str, written: bytes, result: str
) -> tuple[str, str]:
    begin = (
        f'"bus":{quoted(bus)},"address":{address},"device":{quoted(device)},'
        f'"register":{quoted(register)},"written":"{written.hex()}"'
    )
    return begin, f'"result":{quoted(result)}'


def _seconds(t_ps: int) -> str:
    digits = f"{t_ps:013d}"
    return f'"{digits[:-12]}.{digits[-12:]}"'


def _hexadecimal(value: bytes) -> str:
    return f'"{value.hex()}"'


def _compact(value: Mapping[str, NoteValue]) -> str:
    return json.dumps(value, separators=(",", ":"))


_TEXTS: dict[type, Callable[[Any], str]] = {
    int: str,
    str: quoted,
    bytes: _hexadecimal,
    bytearray: _hexadecimal,
    dict: _compact,
}
_NAMES = {
    kind: tuple(field.name for field in fields(kind) if field.name != "t_ps")
    for kind in TraceEvent.__subclasses__()
}


_KEPT = 200_000  # rare events in memory; older events are dropped and counted
_KEPT_IN_DETAIL = 4_000_000  # after record_all(), several minutes of the lab's firmware
LARGEST_FILE = 4 << 30
"""Default maximum size of a file in bytes: about two hours of the lab's firmware."""

EventT = TypeVar("EventT", bound=TraceEvent)
Subscriber: TypeAlias = Callable[[TraceEvent], None]
"""A function that is called with each event, in order. It must not run the board."""


class Trace:
    """The events of a run. Iteration yields all events, and :meth:`of` returns one type.

    ``detailed``: whether frequent events are requested. ``observed``: whether any events are requested.
    """

    def __init__(self) -> None:
        self.detailed = False
        self.observed = False
        self.dropped = 0
        self.replaying = False
        """Whether the board repeats its past. In this case, subscribers and files receive no events."""
        self._sources: list[Callable[[], None]] = []
        self._events: deque[TraceEvent] = deque()
        self._keep_detail = False
        self._subscribers: list[tuple[Subscriber, bool]] = []
        self._files: list[BoundedFile] = []

    def __len__(self) -> int:
        self._draw()
        return len(self._events)

    def __iter__(self) -> Iterator[TraceEvent]:
        self._draw()
        return iter(tuple(self._events))

    def of(self, kind: type[EventT]) -> list[EventT]:
        """Return the kept events of one type, in order."""
        self._draw()
        return [event for event in self._events if isinstance(event, kind)]

    def record_all(self) -> None:
        """Keep every event in memory from now on."""
        self._draw()
        self._keep_detail = True
        self._look_who_listens()

    def draw_from(self, source: Callable[[], None]) -> None:
        """Call ``source()`` before rare events are read or added. The source calls :meth:`add_kept`."""
        self._sources.append(source)

    def add_kept(self, events: Sequence[TraceEvent], dropped: int) -> None:
        """Add a source's rare events, and the number of events that it dropped."""
        most = self.kept_at_most
        dropped += max(0, len(events) - most)
        events = events[-most:]
        too_many = max(0, len(self._events) + len(events) - most) if not dropped else len(self._events)
        for _ in range(too_many):
            self._events.popleft()
        self.dropped += dropped + too_many
        self._events.extend(events)

    @property
    def kept_at_most(self) -> int:
        """Maximum number of events in memory."""
        return _KEPT_IN_DETAIL if self._keep_detail else _KEPT

    def _draw(self) -> None:
        for source in self._sources:
            source()

    def subscribe(self, subscriber: Subscriber, *, detail: bool = True) -> Callable[[], None]:
        """Call ``subscriber(event)`` for later rare events and, with ``detail``, for later frequent events.

        Return a function that unsubscribes.
        """
        self._draw()
        entry = subscriber, detail
        self._subscribers.append(entry)
        self._look_who_listens()

        def unsubscribe() -> None:
            if entry in self._subscribers:
                self._subscribers.remove(entry)
                self._look_who_listens()

        return unsubscribe

    def write_to(self, path: str | Path, most_bytes: int = LARGEST_FILE) -> None:
        """Write later events to a JSON-lines file. Raises LinkError if the file cannot be opened.

        A write error, or more than ``most_bytes``, raises OutputError during the run.
        """
        self._draw()
        self._files.append(BoundedFile(path, f"trace file {path}", most_bytes))
        self._look_who_listens()

    def add(self, event: TraceEvent) -> None:
        """Record a rare event."""
        self._draw()
        self._keep(event)
        self._hand_on(event, detail=False)

    def add_detail(self, event: TraceEvent) -> None:
        """Record a frequent event. Build the event only if ``detailed`` is set."""
        if self._keep_detail:
            self._keep(event)
        self._hand_on(event, detail=True)

    def add_transfer(
        self,
        t_ps: int,
        end_ps: int,
        bus: str,
        address: int,
        device: str,
        register: str,
        written: bytes,
        read: bytes,
        result: str,
    ) -> None:
        """Record a transfer without an event object if only files need it."""
        fields = t_ps, end_ps, bus, address, device, register, written, read, result
        if result != "ok":
            self.add(BusTransfer(*fields))
        elif self._keep_detail or self._subscribers:
            self.add_detail(BusTransfer(*fields))
        elif self._files and not self.replaying:
            text = transfer_line(*fields)
            for file in self._files:
                self._write(file, text)

    def close(self) -> None:
        """Close all open files. Raises OutputError."""
        files, self._files = self._files, []
        self._look_who_listens()
        for file in files:
            file.close()

    def snapshot(self) -> int:
        self._draw()
        return len(self._events) + self.dropped

    def restore(self, state: int) -> None:
        """Drop events after this state. Observers and files do not change."""
        self._draw()
        for _ in range(min(len(self._events) + self.dropped - state, len(self._events))):
            self._events.pop()

    def _look_who_listens(self) -> None:
        subscribed = any(detail for _, detail in self._subscribers)
        self.detailed = self._keep_detail or subscribed or bool(self._files)
        self.observed = self.detailed or bool(self._subscribers)

    def _hand_on(self, event: TraceEvent, *, detail: bool) -> None:
        if self.replaying:
            return
        if self._files:
            text = line(event)
            for file in tuple(self._files):
                self._write(file, text)
        for subscriber, wants_detail in tuple(self._subscribers):
            if wants_detail or not detail:
                subscriber(event)

    def _write(self, file: BoundedFile, text: str) -> None:
        try:
            file.write(text)
        except OutputError:
            self._files.remove(file)
            self._look_who_listens()
            raise

    def _keep(self, event: TraceEvent) -> None:
        if len(self._events) >= self.kept_at_most:
            self._events.popleft()
            self.dropped += 1
        self._events.append(event)
