"""What a run did, as sequences: one for each thing that can be seen from outside.

The lines on the terminal, the register writes of each sensor, the edges of each LED, and how the run ended;
:mod:`emulator.analysis.compare` compares them between runs.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass

from emulator.board.board import Board
from emulator.buses.uart import Uart
from emulator.errors import FirmwareError, InputError
from emulator.links.runner import Runner
from emulator.time.clock import NEVER_PS
from emulator.trace import GpioEdge, RegisterWrite, TerminalBytes, Trace

TERMINAL, END = "terminal", "end of the run"
REGISTERS = " registers"
"""How the name of a sensor's sequence ends, after the part's name."""


@dataclass(frozen=True)
class Entry:
    """Something that happened at ``at_ps``; ``cut``: the end of the run cut its text short."""

    at_ps: int
    text: str
    cut: bool = False


@dataclass(frozen=True)
class Observation:
    """One run until ``end_ps``: what happened in each sequence, in order."""

    end_ps: int
    sequences: Mapping[str, Sequence[Entry]]


def observe(board: Board, end_ps: int, exceeded: Callable[[float], str] = lambda _wall_s: "") -> Observation:
    """Run a board from power-on to ``end_ps`` and keep what it does.

    ``exceeded`` as of :class:`Runner`. A firmware that fails, or runs into a limit, ends its run with that.
    Raises InputError when the run does more than can be kept.
    """
    board.trace.record_all()
    runner = Runner(board, [], end_ps, None, exceeded)
    ending = []
    try:
        runner.run()
    except FirmwareError as error:
        ending.append(Entry(board.clock.now_ps, str(error)))
    if runner.limit:
        ending.append(Entry(board.clock.now_ps, f"stopped by the limit of {runner.limit}"))
    if board.trace.dropped:
        raise InputError(f"{board.now_s:.0f} s of this firmware are too much to compare; give a shorter time")
    return Observation(
        board.clock.now_ps if runner.limit else end_ps,
        {
            TERMINAL: lines_of(bytes_sent(board.trace, board.terminal.uart)),
            **{part.NAME + REGISTERS: _writes(board.trace, part.NAME) for part in board.sensors.parts},
            **{led: edges_of(board.trace, pin) for led, pin in led_pins(board).items()},
            END: ending,
        },
    )


def is_led(name: str) -> bool:
    """Whether a sequence is a LED's: it is none of the others."""
    return name not in (TERMINAL, END) and not name.endswith(REGISTERS)


def led_pins(board: Board) -> dict[str, str]:
    """Names of the LEDs' sequences, and their pins."""
    return {name: led.pin for name, led in board.leds.items()}


def bytes_sent(trace: Trace, uart: Uart) -> Iterator[tuple[int, int]]:
    """When each byte of text began on the line, and the byte."""
    for event in trace.of(TerminalBytes):
        if event.direction == "tx":
            for number, byte in enumerate(event.data):
                yield event.t_ps + uart.frames_ps(number), byte


def lines_of(text: Iterable[tuple[int, int]]) -> list[Entry]:
    """Bytes with their times -> lines with their LF, each at its first byte that is not the last one's CR.

    What was printed after the last LF is the last entry.
    """
    lines: list[Entry] = []
    line, began_ps = bytearray(), NEVER_PS
    for at_ps, byte in text:
        line.append(byte)
        if began_ps == NEVER_PS and byte != ord("\r"):
            began_ps = at_ps
        if byte == ord("\n"):
            lines.append(Entry(began_ps, line.decode("latin-1")))
            line, began_ps = bytearray(), NEVER_PS
    if began_ps < NEVER_PS:
        lines.append(Entry(began_ps, line.decode("latin-1"), cut=True))
    return lines


def edges_of(trace: Trace, pin: str) -> list[Entry]:
    """Edges of a LED's pin; the board's LEDs are lit while it is low."""
    return [
        Entry(event.t_ps, "off" if event.level else "on") for event in trace.of(GpioEdge) if event.pin == pin
    ]


def _writes(trace: Trace, device: str) -> list[Entry]:
    return [
        Entry(event.t_ps, f"{event.register} = 0x{event.new:02X}")
        for event in trace.of(RegisterWrite)
        if event.device == device
    ]
