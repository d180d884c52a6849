"""What can happen in a run: the events of the trace, each a type of its own."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar


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
