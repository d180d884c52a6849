"""The scenario's view of a board and its printed lines, for playing the timeline and evaluating the run.

:class:`BoardView` lists the parts of a board that are needed for this. A printed line has a format, numbers,
the time of printing and the truth at that time; a table for people compares the numbers with the truth.

A number is a field of a line that has its exact format from beginning to end, not any text that looks right:
"4" is not found in "164", and a sign cannot get lost. A line that begins like a format but does not follow it
is malformed, which is a different fault from a wrong value.

The truth is the value that the firmware would print if sensors, firmware and formulas were perfect: the
world's value in the printed unit, with yaw from magnetic north like a compass. The lab's firmware cannot
reach two of these: its roll stays within 90 degrees, and MAG (after MagCalibration) is the field without the
board's hard iron.

The board keeps text without times, and the world forgets its past when it is changed. So a recorder polls the
terminal every millisecond of virtual time (SysTick's period, a fraction of a line's time on the wire). It
takes the truth of new lines once a second, well within the world's memory. Polling changes nothing on the
board.

Decision: a scenario knows a board only as a protocol, because the board loads the scenario by its name and
passes itself to it. Rejected alternative: a board that knows a scenario only as a protocol. Then
``Board(scenario="stairs")`` would need a third package above both, only to turn the name into a file.

Decision: blanks and carriage returns around a line are ignored, because terminals do not show them. A
whole-text comparison checks every byte.

Decision: the length of the terminal's text is polled, because recording an event for every byte would also
record every bus transfer, a hundred times as many events.
"""

from __future__ import annotations

import math
import re
from bisect import bisect_right
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from typing import Any, NamedTuple, Protocol, TypeAlias

import numpy as np

from fcu_emulator.emulator.buses.gpio import Led
from fcu_emulator.emulator.buses.i2c import I2CMaster
from fcu_emulator.emulator.buses.uart import Uart, decoded
from fcu_emulator.emulator.links.runner import RunnableBoard, SerialEnd
from fcu_emulator.emulator.time.clock import PS_PER_MS, PS_PER_S, Periodic
from fcu_emulator.emulator.time.ticks import TickCounts
from fcu_emulator.emulator.trace import Trace
from fcu_emulator.emulator.world import World
from fcu_emulator.emulator.world.track import Array

# -- A board ------------------------------------------------------------------------------------------------


class TerminalView(SerialEnd, Protocol):
    """The end of the serial line, with all received text."""

    uart: Uart

    @property
    def text(self) -> str:
        """Return all text printed since power-on, in Latin-1."""
        ...


class BoardView(RunnableBoard, Protocol):
    """A board that plays a scenario; :class:`fcu_emulator.emulator.assembly.board.Board` is one."""

    world: World
    trace: Trace

    def i2c(self) -> I2CMaster:
        """The controller of the board's first I2C bus; a scenario may inject faults into it."""
        ...

    def led(self, name: str) -> Led:
        """Return a LED by its name in the board's file."""
        ...

    @property
    def terminal(self) -> TerminalView:
        """The terminal at the other end of the serial line."""
        ...

    @property
    def timer(self) -> TickCounts: ...

    def motor_duties(self) -> tuple[float, ...]:
        """Return the PWM duty of each motor, 0 to 1."""
        ...

    def variable(self, name: str) -> Any:
        """Return a global variable of the firmware by its C name. Raises KeyError."""
        ...


# -- The formats of lines -----------------------------------------------------------------------------------


_LONGEST_MEANT = 200  # characters of a line that are searched for a field's name
_CONVERSIONS = {"%d": r"(-?\d+)", "%f": r"(-?(?:\d+\.\d{6}|inf|nan))"}
ANGLES = frozenset({"Pitch", "Roll", "Yaw"})

_FORMATS: tuple[tuple[str, tuple[str, ...]], ...] = (
    ("ACC[x,y,z] %d mg %d mg %d mg", ("ACC.x", "ACC.y", "ACC.z")),
    ("GYR[x,y,z] %d mdps %d mdps %d mdps", ("GYR.x", "GYR.y", "GYR.z")),
    ("MAG[x,y,z] %d mg %d mg %d mg", ("MAG.x", "MAG.y", "MAG.z")),
    ("Pre: %f hPa", ("Pre",)),
    ("Pitch: %f deg Roll: %f deg Yaw: %f deg", ("Pitch", "Roll", "Yaw")),
    ("Altitude: %f m", ("Altitude",)),
)


class LineFormat:
    """Format of one kind of line: its format string, its beginning, and its fields."""

    def __init__(self, text: str, fields: tuple[str, ...]) -> None:
        self.text = text
        self.fields = fields
        self.label = text.split(" ", 1)[0]
        pattern = re.escape(text).replace(r"\ ", " ")
        for conversion, number in _CONVERSIONS.items():
            pattern = pattern.replace(conversion, number)
        self._pattern = re.compile(pattern, re.ASCII)
        names = "|".join(dict.fromkeys(field.partition(".")[0][:3] for field in fields))
        self._meant = re.compile(rf"\b(?:{names})\w*[^\w\n][^\n]*?\d", re.ASCII | re.IGNORECASE)

    def is_meant_by(self, line: str) -> bool:
        """Return whether a line has the name of one of the fields, and a number after it."""
        return self._meant.search(line[:_LONGEST_MEANT]) is not None

    def parse(self, line: str) -> dict[str, float] | None:
        """Return the values of the fields; None if the line does not follow the format."""
        match = self._pattern.fullmatch(line)
        return dict(zip(self.fields, map(float, match.groups()), strict=True)) if match else None


FORMATS = tuple(LineFormat(text, fields) for text, fields in _FORMATS)
FORMAT_OF_FIELD = {field: line_format for line_format in FORMATS for field in line_format.fields}
FIELDS = tuple(FORMAT_OF_FIELD)

_BANNER = re.compile(r"STEVAL-FCU001V1 FW(?= rev\.)")


def same_banner(text: str) -> str:
    """Replace ST's "FW" banner by the slides' "FH": every comparison accepts both."""
    return _BANNER.sub("STEVAL-FCU001V1 FH", text)


def escaped(text: str) -> str:
    """Return a line as an escaped string: all bytes are distinguishable, including backslashes."""
    return text.encode("unicode_escape").decode("ascii")


# -- The truth ----------------------------------------------------------------------------------------------


_Law: TypeAlias = Callable[[World, Array], Array]
MOVING_G = "moving"  # never printed; tells whether the accelerometer is a tilt sensor at that moment


def _compass(column: int) -> _Law:
    return lambda world, t_s: world.compass_deg(t_s)[:, column]


def _acc_mg(column: int) -> _Law:
    return lambda world, t_s: 1000.0 * world.specific_force_g(t_s)[:, column]


def _gyro_mdps(column: int) -> _Law:
    return lambda world, t_s: 1000.0 * world.angular_rate_dps(t_s)[:, column]


def _mag_mgauss(column: int) -> _Law:
    return lambda world, t_s: (world.magnetic_field_mgauss(t_s) - world.hard_iron_mgauss(t_s))[:, column]


TRUTH: dict[str, _Law] = {
    **{f"ACC.{axis}": _acc_mg(column) for column, axis in enumerate("xyz")},
    **{f"GYR.{axis}": _gyro_mdps(column) for column, axis in enumerate("xyz")},
    **{f"MAG.{axis}": _mag_mgauss(column) for column, axis in enumerate("xyz")},
    **{angle: _compass(column) for column, angle in enumerate(("Roll", "Pitch", "Yaw"))},
    "Pre": lambda world, t_s: world.pressure_hpa(t_s),
    "Altitude": lambda world, t_s: world.altitude_m(t_s),
    MOVING_G: lambda world, t_s: world.linear_acceleration_g(t_s),
}


def _inclination(column: int) -> _Law:
    return lambda world, t_s: lab_angles(world.specific_force_g(t_s))[column]


QUANTITIES: dict[str, _Law] = {
    **{name: law for name, law in TRUTH.items() if name != MOVING_G},
    "pitch": _inclination(0),
    "roll": _inclination(1),
}
"""Quantities for comparison with printed numbers and for conditions: the numbers of the slides by their names,
and the inclination of the X axis (``pitch``) and of the Y axis (``roll``) for LEDs.
"""


class TiltSample(NamedTuple):
    """Pitch and roll in degrees at a moment, from the true force by the slides' formulas."""

    at_ps: int
    pitch: float
    roll: float


TILT_STEP_PS = SAMPLE_STEP_PS = 10 * PS_PER_MS


def tilts_of(world: World, at_ps: Sequence[int]) -> list[TiltSample]:
    """Return the inclination at these moments, which must be within the world's memory."""
    if not at_ps:
        return []
    pitch, roll = lab_angles(world.specific_force_g(np.array(at_ps) / PS_PER_S))
    return [TiltSample(*one) for one in zip(at_ps, pitch.tolist(), roll.tolist(), strict=True)]


def lab_angles(force: Array, mu: float = 1.0) -> tuple[Array, Array]:
    """Return the lab's pitch and roll in degrees for forces (N, 3); ``mu`` weighs X in the roll."""
    x, y, z = force.T
    pitch = np.degrees(np.arctan2(-x, np.hypot(y, z)))
    roll = np.degrees(np.arctan2(y, np.sqrt(mu * x * x + z * z)))
    return pitch, roll


def deviation(field: str, printed: float, wanted: float) -> float:
    """Return ``printed`` minus ``wanted``, signed; for angles the shorter way round, within +-180 degrees."""
    difference = printed - wanted
    return (difference + 180.0) % 360.0 - 180.0 if field in ANGLES else difference


def nearest_truth(settle_ps: int) -> str:
    """Describe the reference value of :meth:`PrintedLine.error`."""
    return f"the truth of the last {settle_ps / PS_PER_MS:g} ms"


def unit_of(field: str) -> str:
    """Return a field's unit; the lab prints MAG in mgauss and calls it mg."""
    return "mgauss" if field.startswith("MAG") else FORMAT_OF_FIELD[field].text.split()[-1]


# -- Time of printing ---------------------------------------------------------------------------------------


_LOOK_PS = Fraction(PS_PER_MS)
_COLLECT_PS = Fraction(PS_PER_S)
_TRUTH_STEPS = 21  # instants at which the truth is taken in a settling time
MAX_SETTLE_PS = PS_PER_S  # the world remembers five seconds


@dataclass(frozen=True)
class PrintedLine:
    """A line of the terminal: its text without surrounding blanks, and the time at which its printing began."""

    number: int  # counted from 1
    text: str
    at_ps: int
    truth: Mapping[str, tuple[Array, Array]] = field(default_factory=dict)
    """For each field of interest: instants (N,) in s up to the moment of printing, and true values (N,)."""

    def error(self, name: str, printed: float, settle_ps: int) -> float:
        """Return the smallest deviation from the truth of the last ``settle_ps`` before the line was printed."""
        t_s, values = self.truth[name]
        recent = values[t_s >= t_s[-1] - settle_ps / PS_PER_S - 1e-9]
        return min((deviation(name, printed, float(value)) for value in recent), key=abs)


class Wanted(NamedTuple):
    """A quantity whose truth is recorded with each line that ``is_begun_by`` accepts."""

    quantity: str
    settle_ps: int
    is_begun_by: Callable[[str], bool]


class Recorder:
    """Recorder of one board until ``until_ps``; ``wanted``: quantities recorded with the lines.

    ``tilts``: whether to record the inclination. ``sampled``: quantities to record every ``SAMPLE_STEP_PS``.
    """

    def __init__(
        self,
        board: BoardView,
        until_ps: int,
        wanted: Sequence[Wanted],
        tilts: bool = False,
        sampled: Iterable[str] = (),
    ) -> None:
        self.until_ps = until_ps
        self._world, self._uart, self._clock = board.world, board.terminal.uart, board.clock
        self._wanted = wanted
        self._lines: list[PrintedLine] = []
        self._looks: list[tuple[int, int]] = [(0, 0)]  # (bytes received, time of the previous poll)
        self._last_look_ps = 0
        self._collected = 0  # bytes, counted from power-on
        self._stopped = False
        self._tilts: list[TiltSample] | None = [] if tilts else None
        self._samples: dict[str, list[float]] = {name: [] for name in sampled}
        self._watching = [
            Periodic(self._clock, 0, _LOOK_PS, self._look),
            Periodic(self._clock, 0, _COLLECT_PS, self._collect),
        ]
        self._clock.schedule(until_ps, self._stop, last=True)

    def lines(self) -> list[PrintedLine]:
        """Return the complete lines printed so far, until ``until_ps`` at the latest."""
        if not self._stopped:
            self._collect()
        return self._lines

    def tilts(self) -> Sequence[TiltSample]:
        """Return the inclination so far; empty if it is not recorded."""
        if not self._stopped:
            self._collect()
        return self._tilts or ()

    def samples(self) -> Mapping[str, Sequence[float]]:
        """Return the sampled quantities so far, from power-on in steps of ``SAMPLE_STEP_PS``."""
        if not self._stopped:
            self._collect()
        return self._samples

    def _stop(self) -> None:
        self._collect()
        self._stopped = True
        for periodic in self._watching:
            periodic.cancel()

    def _look(self) -> None:
        count = self._uart.received_count()
        if count > self._looks[-1][0]:
            self._looks.append((count, self._last_look_ps))
        self._last_look_ps = self._clock.now_ps

    def _collect(self) -> None:
        self._look()
        if self._tilts is not None:
            next_ps = self._tilts[-1].at_ps + TILT_STEP_PS if self._tilts else 0
            self._tilts += tilts_of(self._world, range(next_ps, self._clock.now_ps + 1, TILT_STEP_PS))
        for name, values in self._samples.items():
            at_ps = range(len(values) * SAMPLE_STEP_PS, self._clock.now_ps + 1, SAMPLE_STEP_PS)
            if at_ps:
                values.extend(QUANTITIES[name](self._world, np.array(at_ps) / PS_PER_S).tolist())
        start = max(self._collected - self._uart.dropped, 0)
        *complete, _ = bytes(self._uart.received()[start:]).split(b"\n")
        for raw in complete:
            self._add(raw, self._collected)
            self._collected += len(raw) + 1
        self._looks = [look for look in self._looks if look[0] > self._collected] or self._looks[-1:]

    def _add(self, raw: bytes, position: int) -> None:
        """Add one line. In "\\n\\r" the return comes before the next line, and is not part of it."""
        begin = position + len(raw) - len(raw.lstrip(b"\r"))
        first_seen = bisect_right(self._looks, begin, key=lambda look: look[0])
        at_ps = self._looks[first_seen][1]
        text = decoded(raw).strip(" \r\t")
        self._lines.append(PrintedLine(len(self._lines) + 1, text, at_ps, self._truth(text, at_ps)))

    def _truth(self, text: str, at_ps: int) -> dict[str, tuple[Array, Array]]:
        settle_ps: dict[str, int] = {}
        for one in self._wanted:
            if one.is_begun_by(text):
                settle_ps[one.quantity] = max(one.settle_ps, settle_ps.get(one.quantity, 0))
        if not ANGLES.isdisjoint(settle_ps):
            settle_ps[MOVING_G] = 0
        truth = {}
        at_s = at_ps / PS_PER_S
        for name, settle in settle_ps.items():
            law = TRUTH[name] if name in TRUTH else QUANTITIES[name]
            t_s = np.linspace(max(at_s - settle / PS_PER_S, 0.0), at_s, _TRUTH_STEPS)
            truth[name] = (t_s, law(self._world, t_s))
        return truth


# -- Printed numbers against the truth, for people ----------------------------------------------------------


_MOST_ROWS = 12
_STILL_G = 0.05


def against_truth(field: str, lines: Sequence[PrintedLine], settle_ps: int, window: str = "") -> list[str]:
    """Return a table of prints: time, printed, truth at that time, error (printed - truth); then a summary.

    ``window``: the part of the run that the lines are from, for the title.

    Decision: the error in the table is the error at the moment of printing, which shows the age of a moving
    board's number. Expectations use the nearest truth of the time ``settle_ps`` before instead. If that gives
    another largest error, an extra line says so. One definition for both would hide the delay, or blame a
    filter for it.
    """
    rows, judged = [], []
    for line in lines:
        fields = FORMAT_OF_FIELD[field].parse(line.text)
        if fields is not None:
            truth = round(float(line.truth[field][1][-1]), 3) + 0.0  # not -0.000
            error = line.error(field, fields[field], 0)
            rows.append((line.at_ps / PS_PER_S, fields[field], truth, error, _flag(field, line)))
            judged.append(line.error(field, fields[field], settle_ps))
    if not rows:
        return [f"{field} against the truth{window}: never printed"]
    title = f"{field} against the truth at the moment of printing{window}"
    table = [title, f"{'t':>9} {'printed':>12} {'truth':>12} {'error':>12}"]
    worst = max(range(len(rows)), key=lambda row: abs(rows[row][3]) if math.isfinite(rows[row][3]) else -1.0)
    for index in _chosen(len(rows), worst):
        t_s, printed, truth, error, flag = rows[index]
        table.append(f"{t_s:>7.3f} s {printed:>12.3f} {truth:>12.3f} {error:>+12.3f}{flag}")
    count = "1 print" if len(rows) == 1 else f"{len(rows)} prints"
    first, last, largest = rows[0][3], rows[-1][3], _largest(row[3] for row in rows)
    shown = "" if len(rows) <= _MOST_ROWS else f", {_MOST_ROWS} of them in the table"
    table.append(f"error: first {first:+.3f}, last {last:+.3f}, largest {largest:+.3f}, {count}{shown}")
    counted = f"{_largest(judged):+.3f}"
    if counted != f"{largest:+.3f}":
        which = nearest_truth(settle_ps)
        table.append(f"judged is the error against {which}: largest {counted}")
    return table


def _largest(errors: Iterable[float]) -> float:
    """Return the error farthest from 0, ignoring values that are not numbers; NaN if there are none."""
    return max(filter(math.isfinite, errors), key=abs, default=math.nan)


def _flag(field: str, line: PrintedLine) -> str:
    """Return a note for an angle that was printed while the board accelerated: the accelerometer measures no tilt then.

    The slides ("eCompass math") check the modulus, the only measure that firmware has. It hides sideways
    acceleration: 0.36 g turns the vertical by 20 degrees but makes the modulus only 1.06 g. Here the motion
    is known.
    """
    if field not in ANGLES:
        return ""
    moving_g = float(line.truth[MOVING_G][1][-1])
    return "" if moving_g <= _STILL_G else f"   accelerated by {moving_g:.2f} g: no tilt sensor now"


def _chosen(count: int, worst: int) -> list[int]:
    """Return the indices of at most a dozen rows: the first, the last, ``worst``, and evenly spaced ones."""
    if count <= _MOST_ROWS:
        return list(range(count))
    chosen = [index * (count - 1) // (_MOST_ROWS - 1) for index in range(_MOST_ROWS)]
    if worst not in chosen:
        inner = min(chosen[1:-1], key=lambda index: abs(index - worst))
        chosen[chosen.index(inner)] = worst
    return sorted(chosen)
