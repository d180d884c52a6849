"""A run's behaviour as sequences: terminal lines, register writes, LED edges, timer, end."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass

from fcu_emulator.emulator.assembly.board import Board
from fcu_emulator.emulator.buses.uart import Uart
from fcu_emulator.emulator.clock import NEVER_PS, TickCounts
from fcu_emulator.emulator.errors import FirmwareError, LimitError, NotJudgedError
from fcu_emulator.emulator.links.runner import Runner
from fcu_emulator.emulator.trace import EventT, GpioEdge, RegisterWrite, TerminalBytes, Trace, TraceEvent

TERMINAL, TIMER, END = "terminal", "timer", "end of the run"
REGISTERS = " registers"
"""Suffix in the name of a register sequence, after the sensor's name."""
MOST_EVENTS = 1_000_000
"""Maximum number of compared events of a run, about 100 MB. An hour of the lab's firmware has 400,000 events."""
_COMPARED = (GpioEdge, RegisterWrite, TerminalBytes)


@dataclass(frozen=True)
class ObservedItem:
    """An entry at ``at_ps``. ``cut``: the end of the run truncated the text."""

    at_ps: int
    text: str
    cut: bool = False


@dataclass(frozen=True)
class Observation:
    """A run until ``end_ps``. Each sequence is ordered by time."""

    end_ps: int
    sequences: Mapping[str, Sequence[ObservedItem]]


def observe(
    board: Board,
    end_ps: int,
    exceeded: Callable[[float], str] = lambda _wall_s: "",
    *,
    transfers: bool = False,
) -> Observation:
    """Run a board from power-on to ``end_ps`` and record its behaviour.

    If ``transfers`` is True, the trace keeps all events. The record ends at a firmware failure or
    exceeded limit. Raises NotJudgedError if the run has too many events or takes too long.
    """
    kept = _ComparedEvents(board.trace, transfers)
    runner = Runner(board, [], end_ps, None, lambda wall_s: kept.exceeded() or exceeded(wall_s))
    ending = []
    try:
        runner.run()
    except FirmwareError as error:
        if isinstance(error, LimitError) and error.limit == "wall_s":
            raise
        ending.append(ObservedItem(board.clock.now_ps, str(error)))
    finally:
        kept.close()
    if kept.exceeded():
        raise NotJudgedError(
            f"{board.now_s:.3g} s of this firmware have too many events to compare; give a shorter time",
            kind="too_many_events",
        )
    if runner.limit.endswith("limits.wall"):
        raise NotJudgedError(f"the run was stopped: it exceeded {runner.limit}")
    if runner.limit:
        ending.append(ObservedItem(board.clock.now_ps, f"stopped at the limit of {runner.limit}"))
    return Observation(
        board.clock.now_ps if runner.limit else end_ps,
        {
            TERMINAL: lines_of(bytes_sent(kept.of(TerminalBytes), board.terminal.uart)),
            **{
                part.NAME + REGISTERS: _writes(kept.of(RegisterWrite), part.NAME)
                for part in board.sensors.parts
            },
            **{led: edges_of(kept.of(GpioEdge), pin) for led, pin in led_pins(board).items()},
            TIMER: _timer(board.timer, board.clock.now_ps),
            END: ending,
        },
    )


def _timer(timer: TickCounts, now_ps: int) -> list[ObservedItem]:
    if not timer.ticks:
        return []
    ticks = ObservedItem(now_ps, f"{timer.ticks} ticks, {timer.lost} lost")
    return [ObservedItem(0, f"{timer.name} at {timer.rate_hz:.3f} Hz"), ticks]


def is_led(name: str) -> bool:
    """Return whether a sequence belongs to an LED."""
    return name not in (TERMINAL, TIMER, END) and not name.endswith(REGISTERS)


def led_pins(board: Board) -> dict[str, str]:
    """Return the LEDs' pins, keyed by the name of the sequence."""
    return {name: led.pin for name, led in board.leds.items()}


class _ComparedEvents:
    """Recorder of the events to compare. Only a replay needs bus transfers."""

    def __init__(self, trace: Trace, transfers: bool) -> None:
        self._trace = trace
        self._events: list[TraceEvent] = []
        self._full = False
        self._transfers = transfers
        if transfers:
            trace.record_all()
        self.close = trace.subscribe(self._take)

    def exceeded(self) -> str:
        """Return the limit on the number of events if the run has reached it, or ""."""
        full = self._full or (self._transfers and self._trace.dropped)
        return f"{MOST_EVENTS} events" if full else ""

    def of(self, kind: type[EventT]) -> list[EventT]:
        return [event for event in self._events if isinstance(event, kind)]

    def _take(self, event: TraceEvent) -> None:
        if isinstance(event, _COMPARED):
            if len(self._events) < MOST_EVENTS:
                self._events.append(event)
            else:
                self._full = True


def bytes_sent(events: Iterable[TerminalBytes], uart: Uart) -> Iterator[tuple[int, int]]:
    """Yield each output byte's start time on the line, and its value."""
    for event in events:
        if event.direction == "tx":
            for number, byte in enumerate(event.data):
                yield event.t_ps + uart.frames_ps(number), byte


def lines_of(text: Iterable[tuple[int, int]]) -> list[ObservedItem]:
    """Convert timed bytes to lines. A line's time is the time of its first byte that is not CR."""
    lines: list[ObservedItem] = []
    line, began_ps = bytearray(), NEVER_PS
    for at_ps, byte in text:
        line.append(byte)
        if began_ps == NEVER_PS and byte != ord("\r"):
            began_ps = at_ps
        if byte == ord("\n"):
            lines.append(ObservedItem(began_ps, line.decode("latin-1")))
            line, began_ps = bytearray(), NEVER_PS
    if began_ps < NEVER_PS:
        lines.append(ObservedItem(began_ps, line.decode("latin-1"), cut=True))
    return lines


def edges_of(events: Iterable[GpioEdge], pin: str) -> list[ObservedItem]:
    """Return the edges of an LED's pin. The pin is low while the LED is lit."""
    return [ObservedItem(event.t_ps, "off" if event.level else "on") for event in events if event.pin == pin]


def _writes(events: Iterable[RegisterWrite], device: str) -> list[ObservedItem]:
    return [
        ObservedItem(event.t_ps, f"{event.register} = 0x{event.new:02X}")
        for event in events
        if event.device == device
    ]
