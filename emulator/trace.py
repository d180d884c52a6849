"""The run's diary: append-only, typed events, to memory, to JSON-lines files and to whoever subscribes.

What is rare and what a user must not miss (faults, late and lost ticks, GPIO edges, functions that are not
modelled) is always kept. What happens thousands of times a second (bus transfers, register writes, terminal
bytes) is recorded only while somebody wants it; until then its producers see ``trace.detailed`` False and do
not even build the event, so a trace that is off costs nothing.

A line of a JSON-lines file has the time, the kind, and the event's fields in their order: times in seconds as
exact decimal strings, bytes in hexadecimal. Lines are put together from the fields' own texts: 3,200 bus
transfers a second of virtual time would cost more through a general encoder than the run itself.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, fields
from functools import lru_cache
from json.encoder import encode_basestring_ascii as quoted
from pathlib import Path
from typing import Any, ClassVar, TypeAlias, TypeVar

from fcu_emulator.emulator.errors import OutputError
from fcu_emulator.emulator.host.files import BoundedFile
from fcu_emulator.emulator.time.clock import PS_PER_S


@dataclass(frozen=True, slots=True)
class TraceEvent:
    """Something that happened at ``t_ps``; ``kind`` names the type in files."""

    kind: ClassVar[str] = "event"
    t_ps: int

    @property
    def t_s(self) -> float:
        """When it happened, in seconds since power-on."""
        return self.t_ps / PS_PER_S


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

    @property
    def end_s(self) -> float:
        """When it ended, in seconds since power-on."""
        return self.end_ps / PS_PER_S


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

    @property
    def late_s(self) -> float:
        """How late, in seconds."""
        return self.late_ps / PS_PER_S


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


def line(event: TraceEvent) -> str:
    """The event as a line, its end included."""
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
    """The line of a :class:`BusTransfer` with these fields."""
    begin, end = _of_transfers(bus, address, device, register, written, result)
    times = f'"t_s":{_seconds(t_ps)},"kind":"bus","end_s":{_seconds(end_ps)}'
    return f'{{{times},{begin},"read":"{read.hex()}",{end}}}\n'


@lru_cache(maxsize=1024)
def _of_transfers(
    bus: str, address: int, device: str, register: str, written: bytes, result: str
) -> tuple[str, str]:
    """What lines of the same transfer have in common: before and after the bytes read."""
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


_TEXTS: dict[type, Callable[[Any], str]] = {
    int: str,
    str: quoted,
    bytes: _hexadecimal,
    bytearray: _hexadecimal,
}
_NAMES = {
    kind: tuple(field.name for field in fields(kind) if field.name != "t_ps")
    for kind in TraceEvent.__subclasses__()
}


_KEPT = 200_000  # rare events in memory; older ones are dropped and counted
_KEPT_IN_DETAIL = 4_000_000  # after record_all(), several minutes of the lab's firmware
LARGEST_FILE = 4 << 30
"""Bytes of a file unless another bound is given: some two hours of the lab's firmware."""

EventT = TypeVar("EventT", bound=TraceEvent)
Subscriber: TypeAlias = Callable[[TraceEvent], None]
"""Is called with each event, in the order of the trace; it must not run the board."""


class Trace:
    """A run's events; iterate over it, or ask :meth:`of` for one type.

    ``detailed``: whether somebody wants the frequent events; producers ask before they build one.
    ``observed``: whether events are written or handed to a subscriber. Until then a producer may keep events
    in another form and add them when the trace is read (:meth:`draw_from`).
    """

    def __init__(self) -> None:
        self.detailed = False
        self.observed = False
        self.dropped = 0
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
        """The kept events of one type, in order."""
        self._draw()
        return [event for event in self._events if isinstance(event, kind)]

    def record_all(self) -> None:
        """Keep every event in memory from now on, bus transfers and terminal bytes included."""
        self._draw()
        self._keep_detail = True
        self._look_who_listens()

    def draw_from(self, source: Callable[[], None]) -> None:
        """Call ``source()`` before the trace is read, or another event added: it adds what it has kept.

        It does so by :meth:`add_kept`.
        """
        self._sources.append(source)

    def add_kept(self, events: Sequence[TraceEvent], dropped: int) -> None:
        """Add rare events that a source has kept, and the number of those before that it has dropped."""
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
        """How many events are kept in memory."""
        return _KEPT_IN_DETAIL if self._keep_detail else _KEPT

    def _draw(self) -> None:
        for source in self._sources:
            source()

    def subscribe(self, subscriber: Subscriber, *, detail: bool = True) -> Callable[[], None]:
        """Call ``subscriber(event)`` for each event from now on, the frequent ones only with ``detail``.

        Returns what ends the subscription.
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
        """Write every event from now on to a JSON-lines file. Raises LinkError if it cannot be opened.

        What cannot be written later, or would make the file larger than ``most_bytes``, is an OutputError
        that comes out of the run.
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
        """Record a frequent event; only to be built and passed when ``detailed`` is set."""
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
        """Record a transfer by the fields of its event, of which most are: files do not need the event."""
        fields = t_ps, end_ps, bus, address, device, register, written, read, result
        if result != "ok":
            self.add(BusTransfer(*fields))
        elif self._keep_detail or self._subscribers:
            self.add_detail(BusTransfer(*fields))
        elif self._files:
            text = transfer_line(*fields)
            for file in self._files:
                self._write(file, text)

    def close(self) -> None:
        """Close the files that are being written. Raises OutputError."""
        files, self._files = self._files, []
        self._look_who_listens()
        for file in files:
            file.close()

    def snapshot(self) -> int:
        """How many events there have been; for :mod:`fcu_emulator.emulator.assembly.snapshot`."""
        self._draw()
        return len(self._events) + self.dropped

    def restore(self, state: int) -> None:
        """Forget the events that came after these; who observes goes on, and files keep what they have."""
        self._draw()
        for _ in range(min(len(self._events) + self.dropped - state, len(self._events))):
            self._events.pop()

    def _look_who_listens(self) -> None:
        subscribed = any(detail for _, detail in self._subscribers)
        self.detailed = self._keep_detail or subscribed or bool(self._files)
        self.observed = self.detailed or bool(self._subscribers)

    def _hand_on(self, event: TraceEvent, *, detail: bool) -> None:
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
