"""Printed lines and LEDs of a run, with the true values just before them.

The truth is a range, because a printed value is older than its line.

Decision: the recorder samples the callback every 4.87 ms of virtual time and the LEDs every 48.7
ms. The recorder reads the terminal and computes the truth once per 100 samples. If it did this for
each sample, this work would take as long as running the firmware. A line has the time of the first
sample after its first byte.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction

import numpy as np

from fcu_emulator.emulator.analysis.led_switches import LedSwitches
from fcu_emulator.emulator.assembly.board import Board
from fcu_emulator.emulator.clock import PS_PER_MS, PS_PER_S, Periodic
from fcu_emulator.emulator.scenario.run_view import FORMATS, TRUTH, lab_angles

SETTLE_S = 0.15
_LOOK_PS = Fraction(487 * PS_PER_MS, 100)
"""Interval of the samples, which is not a multiple of the callback's period."""
_INSTANTS = 9
_LINES_KEPT, _LIGHTS_KEPT = 1_000, 4_000
_REST_KEPT = 4096  # bytes
_LIGHTS_EVERY, _COLLECT_EVERY = 10, 100  # samples
_FAULTS = {"HardFault", "MemManage", "BusFault", "UsageFault"}  # ARMv7-M ARM B1.5.2
LABELS = tuple(line_format.label for line_format in FORMATS)


@dataclass(frozen=True)
class ValueRange:
    """Range of a true value."""

    low: float
    high: float

    @property
    def middle(self) -> float:
        return (self.low + self.high) / 2

    def distance(self, value: float) -> float:
        """Return the distance of ``value`` from the range, or 0 inside the range."""
        return max(self.low - value, value - self.high, 0.0)

    def scaled(self, factor: float) -> ValueRange:
        ends = self.low * factor, self.high * factor
        return ValueRange(min(ends), max(ends))


@dataclass(frozen=True)
class LabLine:
    """A line of the lab, its numbers (None if the format differs), and the true values of these numbers."""

    label: str
    text: str
    at_s: float
    values: Mapping[str, float] | None
    truth: Mapping[str, ValueRange]


@dataclass(frozen=True)
class Lights:
    """States of the LEDs, with pitch and roll in degrees, computed from the true force by the lab's formula."""

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
    """Recorder of lines and LEDs of ``board`` from now on."""

    def __init__(self, board: Board) -> None:
        self.board = board
        self._lines: deque[LabLine] = deque(maxlen=_LINES_KEPT)
        self._lights: deque[Lights] = deque(maxlen=_LIGHTS_KEPT)
        # times and LED states for which the true angles have not been computed yet
        self._lit: list[tuple[float, dict[str, bool]]] = []
        self._times = board.terminal.uart.arrival_times()
        self._position = board.terminal.uart.received_count()
        self._rest = b""
        self._start_ps = board.clock.now_ps
        self._looks = 0
        self._closed = False
        self.looks_at_callback = 0
        """Number of polls of compiled firmware while the timer ticked and no fault was handled."""
        self.callback_seen = 0
        """Number of these polls during the timer's interrupt."""
        self.switches = LedSwitches(board)
        self._watching = Periodic(board.clock, board.clock.now_ps, _LOOK_PS, self._look)

    @property
    def lines(self) -> Sequence[LabLine]:
        """The latest complete lines."""
        self._collect()
        return self._lines

    @property
    def lights(self) -> Sequence[Lights]:
        """The LEDs at the latest samples."""
        self._collect()
        return self._lights

    def close(self) -> None:
        self._collect()
        self._closed = True
        self._watching.cancel()
        self.board.terminal.uart.release_times(self._times)

    def _look(self) -> None:
        board = self.board
        self._looks += 1
        if board.chip is not None and board.timer.ticks:
            self._look_at_callback(board.chip.handled(), board.timer.name)
        if self._looks % _LIGHTS_EVERY == 0:
            self._lit.append((board.now_s, {name: led.on for name, led in board.leds.items()}))
        if self._looks % _COLLECT_EVERY == 0:
            self._collect()

    def _collect(self) -> None:
        if self._closed:
            return
        self._collect_lines()
        if self._lit:
            force = self.board.world.specific_force_g(np.array([at_s for at_s, _ in self._lit]))
            pitch, roll = (angle.tolist() for angle in lab_angles(force))
            force_g = np.linalg.norm(force, axis=1).tolist()
            for number, (at_s, lit) in enumerate(self._lit):
                self._lights.append(Lights(at_s, pitch[number], roll[number], force_g[number], lit))
            self._lit.clear()

    def _collect_lines(self) -> None:
        terminal = self.board.terminal
        data, end = terminal.since(self._position)
        if not data:
            return
        begin = end - len(data) - len(self._rest)
        *complete, rest = (self._rest + data).split(b"\n")
        self._rest = rest[-_REST_KEPT:]
        for raw in complete:
            self._add(raw, self._sampled_s(begin))
            begin += len(raw) + 1
        self._position = end
        self._times.forget(end - len(self._rest))

    def _sampled_s(self, number: int) -> float:
        """Return the time of the first sample after the arrival of byte ``number``."""
        late_ps = self._times.ps(number) - self._start_ps
        return float(self._start_ps - -late_ps // _LOOK_PS * _LOOK_PS) / PS_PER_S

    def _look_at_callback(self, handled: Sequence[str], timer: str) -> None:
        """Count a poll, except in fault handlers, because an interrupted callback remains active in a fault handler."""
        if _FAULTS.isdisjoint(handled):
            self.looks_at_callback += 1
            self.callback_seen += any(timer in name for name in handled)

    def _add(self, raw: bytes, at_s: float) -> None:
        text = raw.decode("latin-1").strip(" \r\t")
        for line_format in FORMATS:
            if text.startswith(line_format.label):
                truth = self._truth(line_format.fields, at_s)
                self._lines.append(LabLine(line_format.label, text, at_s, line_format.parse(text), truth))

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
