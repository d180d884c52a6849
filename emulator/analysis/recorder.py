"""Printed lines and LEDs of a run, with the truth at the same times: a range, because printed values are old.

Decision: the recorder reads the terminal every 4.87 ms of virtual time, not at each byte, because a line of
the lab takes that long on the wire.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction

import numpy as np

from fcu_emulator.emulator.assembly.board import Board
from fcu_emulator.emulator.clock import PS_PER_MS, Periodic
from fcu_emulator.emulator.scenario.run_view import FORMATS, TRUTH, lab_angles

SETTLE_S = 0.15
_LOOK_PS = Fraction(487 * PS_PER_MS, 100)
"""Not a multiple of the callback's period."""
_INSTANTS = 9
_LINES_KEPT, _LIGHTS_KEPT = 1_000, 4_000
_LIGHTS_EVERY = 10  # polls
_FAULTS = {"HardFault", "MemManage", "BusFault", "UsageFault"}  # ARMv7-M ARM B1.5.2
LABELS = tuple(line_format.label for line_format in FORMATS)


@dataclass(frozen=True)
class ValueRange:
    """The range of a true value."""

    low: float
    high: float

    @property
    def middle(self) -> float:
        return (self.low + self.high) / 2

    def distance(self, value: float) -> float:
        """Return the distance of ``value`` from the range; 0 inside."""
        return max(self.low - value, value - self.high, 0.0)

    def scaled(self, factor: float) -> ValueRange:
        ends = self.low * factor, self.high * factor
        return ValueRange(min(ends), max(ends))


@dataclass(frozen=True)
class LabLine:
    """A line of the lab: its numbers, None for another format, and the truth of its fields."""

    label: str
    text: str
    at_s: float
    values: Mapping[str, float] | None
    truth: Mapping[str, ValueRange]


@dataclass(frozen=True)
class Lights:
    """The LEDs at one time, and pitch and roll in degrees by the lab's formulas from the true force."""

    at_s: float
    pitch: float
    roll: float
    force_g: float
    """Modulus of the true force: near 1 at rest."""
    lit: Mapping[str, bool]
    """State of each LED by its name."""

    @property
    def on(self) -> tuple[bool, ...]:
        return tuple(self.lit.values())


class TruthRecorder:
    """Recorder of the lines and LEDs of ``board`` from now on."""

    def __init__(self, board: Board) -> None:
        self.board = board
        self.lines: deque[LabLine] = deque(maxlen=_LINES_KEPT)
        self.lights: deque[Lights] = deque(maxlen=_LIGHTS_KEPT)
        self._position = board.terminal.uart.received_count()
        self._rest = b""
        self._began_s = board.now_s
        self._looks = 0
        self.looks_at_callback = 0
        """Number of polls of built firmware while the timer ticked and no fault was handled."""
        self.callback_seen = 0
        """Number of these polls during the timer's interrupt."""
        self._watching = Periodic(board.clock, board.clock.now_ps, _LOOK_PS, self._look)

    def close(self) -> None:
        self._watching.cancel()

    def _look(self) -> None:
        board = self.board
        if board.terminal.uart.received_count() > self._position:
            data, self._position = board.terminal.since(self._position)
            began_s = self._began_s
            *complete, rest = (self._rest + data).split(b"\n")
            for number, raw in enumerate(complete):
                self._add(raw, began_s if number == 0 and self._rest else board.now_s)
            if complete or not self._rest:
                self._began_s = board.now_s
            self._rest = rest[-4096:]
        self._looks += 1
        if board.chip is not None and board.timer.ticks:
            self._look_at_callback(board.chip.handled(), board.timer.name)
        if self._looks % _LIGHTS_EVERY == 0:
            force = board.world.specific_force_g(np.array([board.now_s]))
            pitch, roll = lab_angles(force)
            lit = {name: led.on for name, led in board.leds.items()}
            force_g = float(np.linalg.norm(force))
            self.lights.append(Lights(board.now_s, float(pitch[0]), float(roll[0]), force_g, lit))

    def _look_at_callback(self, handled: Sequence[str], timer: str) -> None:
        """Count a poll of the callback, except during faults, below which its interrupt stays active."""
        if _FAULTS.isdisjoint(handled):
            self.looks_at_callback += 1
            self.callback_seen += any(timer in name for name in handled)

    def _add(self, raw: bytes, at_s: float) -> None:
        text = raw.decode("latin-1").strip(" \r\t")
        for line_format in FORMATS:
            if text.startswith(line_format.label):
                truth = self._truth(line_format.fields, at_s)
                self.lines.append(LabLine(line_format.label, text, at_s, line_format.parse(text), truth))

    def _truth(self, fields: tuple[str, ...], at_s: float) -> dict[str, ValueRange]:
        t_s = np.linspace(max(at_s - SETTLE_S, 0.0), at_s, _INSTANTS)
        if fields[0] == "Pitch":
            force = self.board.world.specific_force_g(t_s)
            pitch, roll = lab_angles(force)
            _, calm = lab_angles(force, 0.01)
            values = {
                "Pitch": pitch,
                "Roll": np.concatenate((roll, calm)),
                "Yaw": TRUTH["Yaw"](self.board.world, t_s),
            }
        else:
            values = {name: TRUTH[name](self.board.world, t_s) for name in fields}
        return {name: ValueRange(float(one.min()), float(one.max())) for name, one in values.items()}
