"""What a run has printed and lit, with the truth of the same moments: what hints about numbers are made of.

A value on the terminal is a little old when it is printed: the firmware has filtered, computed and perhaps
waited. So the truth of a line is a range, from the smallest to the largest value of the last
:data:`SETTLE_S`.

Decision: the terminal is looked at every 4.87 ms of virtual time, not at each byte; a line of the lab takes
that long on the wire. Only the latest lines are kept, however long the run is.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction

import numpy as np

from fcu_emulator.emulator.assembly.board import Board
from fcu_emulator.emulator.scenario.run_view import FORMATS, TRUTH, lab_angles
from fcu_emulator.emulator.time.clock import PS_PER_MS, Periodic

SETTLE_S = 0.15
_LOOK_PS = Fraction(487 * PS_PER_MS, 100)
"""No multiple of the callback's period, so that looks fall anywhere in it."""
_INSTANTS = 9
_LINES_KEPT, _LIGHTS_KEPT = 1_000, 4_000
_LIGHTS_EVERY = 10  # looks
_FAULTS = {"HardFault", "MemManage", "BusFault", "UsageFault"}  # ARMv7-M ARM B1.5.2
LABELS = tuple(line_format.label for line_format in FORMATS)


@dataclass(frozen=True)
class ValueRange:
    """What a value may be: from ``low`` to ``high``."""

    low: float
    high: float

    @property
    def middle(self) -> float:
        return (self.low + self.high) / 2

    def distance(self, value: float) -> float:
        """How far ``value`` is outside; 0 inside."""
        return max(self.low - value, value - self.high, 0.0)

    def scaled(self, factor: float) -> ValueRange:
        """Return the range times ``factor``."""
        ends = self.low * factor, self.high * factor
        return ValueRange(min(ends), max(ends))


@dataclass(frozen=True)
class LabLine:
    """A line of the lab: its numbers, None where the format is another, and the truth of its fields."""

    label: str
    text: str
    at_s: float
    values: Mapping[str, float] | None
    truth: Mapping[str, ValueRange]


@dataclass(frozen=True)
class Lights:
    """The LEDs at a moment, and pitch and roll in degrees as the lab computes them from the true force."""

    at_s: float
    pitch: float
    roll: float
    force_g: float
    """The true force's modulus: near 1 where the angles are those of a board at rest."""
    lit: Mapping[str, bool]
    """By the LED's name."""

    @property
    def on(self) -> tuple[bool, ...]:
        """Whether each is lit, in the board's order."""
        return tuple(self.lit.values())


class TruthRecorder:
    """Watches ``board`` from now on."""

    def __init__(self, board: Board) -> None:
        self.board = board
        self.lines: deque[LabLine] = deque(maxlen=_LINES_KEPT)
        self.lights: deque[Lights] = deque(maxlen=_LIGHTS_KEPT)
        self._position = board.terminal.uart.received_count()
        self._rest = b""
        self._began_s = board.now_s
        self._looks = 0
        self.looks_at_callback = 0
        """How often built firmware was looked at while the timer ticked and no fault was handled."""
        self.callback_seen = 0
        """How often of these the timer's interrupt was being handled."""
        self._watching = Periodic(board.clock, board.clock.now_ps, _LOOK_PS, self._look)

    def close(self) -> None:
        """Stop the observation of the board."""
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
        """Its interrupt stays active below a fault that it has caused: that is no time of its own."""
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
