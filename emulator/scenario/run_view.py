"""The scenario's view of a board and its printed lines.

A line is malformed if only its beginning fits a format. The truth is the output of perfect sensors,
firmware and formulas, with yaw from magnetic north.

Decision: a scenario knows a board only as a ``Protocol``, because the board itself loads the scenario.

Decision: blanks and carriage returns around a line are ignored, because terminals do not show them.

Decision: the time of a line is computed from the UART's frames, because an event for each byte
would also record every bus transfer.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from typing import Any, NamedTuple, Protocol, TypeAlias

import numpy as np

from fcu_emulator.emulator.buses.gpio import Led
from fcu_emulator.emulator.buses.i2c import I2CMaster
from fcu_emulator.emulator.buses.uart import Uart, decoded
from fcu_emulator.emulator.clock import PS_PER_MS, PS_PER_S, Periodic, TickCounts
from fcu_emulator.emulator.links.runner import RunnableBoard, SerialEnd
from fcu_emulator.emulator.trace import Trace
from fcu_emulator.emulator.world import World
from fcu_emulator.emulator.world.track import Array

# -- A board ------------------------------------------------------------------------------------------------


class TerminalView(SerialEnd, Protocol):
    """The terminal's end of the serial line, with all received text."""

    uart: Uart

    @property
    def text(self) -> str:
        """Return all text since power-on, in Latin-1."""
        ...


class BoardView(RunnableBoard, Protocol):
    """The parts of a board that a scenario uses."""

    world: World
    trace: Trace

    def i2c(self) -> I2CMaster:
        """The controller of the first I2C bus, for faults."""
        ...

    def led(self, name: str) -> Led: ...

    @property
    def terminal(self) -> TerminalView: ...

    @property
    def timer(self) -> TickCounts: ...

    def press_button(self, pin: str, level: int, seconds: float) -> None:
        """Connect a pin to ground or to the supply for some seconds."""
        ...

    def motor_duties(self) -> tuple[float, ...]:
        """Return each motor's PWM duty, 0 to 1."""
        ...

    def variable(self, name: str) -> Any:
        """Return the firmware's global variable. Raises KeyError."""
        ...


# -- The formats of lines -----------------------------------------------------------------------------------


_LONGEST_MEANT = 200  # characters of a line in which a field's name is searched
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
    """Format of a line: format string, label and fields."""

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
        """Return whether a number follows a field's name."""
        return self._meant.search(line[:_LONGEST_MEANT]) is not None

    def parse(self, line: str) -> dict[str, float] | None:
        match = self._pattern.fullmatch(line)
        return dict(zip(self.fields, map(float, match.groups()), strict=True)) if match else None


FORMATS = tuple(LineFormat(text, fields) for text, fields in _FORMATS)
FORMAT_OF_FIELD = {field: line_format for line_format in FORMATS for field in line_format.fields}
FIELDS = tuple(FORMAT_OF_FIELD)

_BANNER = re.compile(r"STEVAL-FCU001V1 FW(?= rev\.)")


def same_banner(text: str) -> str:
    """Replace "FW" in ST's banner by "FH", as on the slides."""
    return _BANNER.sub("STEVAL-FCU001V1 FH", text)


def escaped(text: str) -> str:
    """Return a line with escapes for control characters, backslashes and non-ASCII characters."""
    return text.encode("unicode_escape").decode("ascii")


# -- The truth ----------------------------------------------------------------------------------------------


_Law: TypeAlias = Callable[[World, Array], Array]
MOVING_G = "moving"  # not a printed field; shows whether the accelerometer measures tilt


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
"""Quantities by name, for numbers and conditions. ``pitch``, ``roll``: inclinations of the X and Y axes."""


class TiltSample(NamedTuple):
    """Pitch and roll in degrees, by the slides' formulas."""

    at_ps: int
    pitch: float
    roll: float


TILT_STEP_PS = SAMPLE_STEP_PS = 10 * PS_PER_MS


def tilts_of(world: World, at_ps: Sequence[int]) -> list[TiltSample]:
    """Return the inclination at moments in the world's history."""
    if not at_ps:
        return []
    pitch, roll = lab_angles(world.specific_force_g(np.array(at_ps) / PS_PER_S))
    return [TiltSample(*one) for one in zip(at_ps, pitch.tolist(), roll.tolist(), strict=True)]


def lab_angles(force: Array, mu: float = 1.0) -> tuple[Array, Array]:
    """Return pitch and roll in degrees for forces (N, 3). ``mu`` is the weight of X in the roll."""
    x, y, z = force.T
    pitch = np.degrees(np.arctan2(-x, np.hypot(y, z)))
    roll = np.degrees(np.arctan2(y, np.sqrt(mu * x * x + z * z)))
    return pitch, roll


def deviation(field: str, printed: float, wanted: float) -> float:
    """Return ``printed`` minus ``wanted``. A difference of angles is within +-180 degrees."""
    difference = printed - wanted
    return (difference + 180.0) % 360.0 - 180.0 if field in ANGLES else difference


def settle_text(settle_ps: int) -> str:
    """Describe the time from which :meth:`PrintedLine.error` takes true values."""
    return f"in the last {settle_ps / PS_PER_MS:g} ms"


def unit_of(field: str) -> str:
    """Return the unit of a field. The lab's lines write mg for mgauss."""
    return "mgauss" if field.startswith("MAG") else FORMAT_OF_FIELD[field].text.split()[-1]


# -- Time of printing ---------------------------------------------------------------------------------------


_COLLECT_PS = Fraction(PS_PER_S)
_TRUTH_STEPS = 21  # number of instants in a settling time
MAX_SETTLE_PS = PS_PER_S  # the world remembers 5 s


@dataclass(frozen=True)
class PrintedLine:
    """A line without surrounding blanks, and the whole millisecond in which its printing began."""

    number: int  # counted from 1
    text: str
    at_ps: int
    truth: Mapping[str, tuple[Array, Array]] = field(default_factory=dict)
    """By field: instants (N,) in s up to printing, and true values (N,)."""

    def error(self, name: str, printed: float, settle_ps: int) -> float:
        """Return the smallest deviation from the truth in the time ``settle_ps`` before printing."""
        t_s, values = self.truth[name]
        recent = values[t_s >= t_s[-1] - settle_ps / PS_PER_S - 1e-9]
        return min((deviation(name, printed, float(value)) for value in recent), key=abs)


class Wanted(NamedTuple):
    """A quantity recorded with each line that ``is_begun_by`` accepts."""

    quantity: str
    settle_ps: int
    is_begun_by: Callable[[str], bool]


class Recorder:
    """Recorder of a board's lines and true values until ``until_ps``.

    ``wanted``: quantities recorded with lines. ``tilts``: record the inclination. ``sampled``:
    quantities recorded every ``SAMPLE_STEP_PS``.
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
        self._times = self._uart.arrival_times()
        self._collected = 0  # bytes since power-on
        self._stopped = False
        self._tilts: list[TiltSample] | None = [] if tilts else None
        self._samples: dict[str, list[float]] = {name: [] for name in sampled}
        self._watching = Periodic(self._clock, 0, _COLLECT_PS, self._collect)
        self._clock.schedule(until_ps, self._stop, last=True)

    def lines(self) -> list[PrintedLine]:
        """Return the complete lines so far."""
        if not self._stopped:
            self._collect()
        return self._lines

    def tilts(self) -> Sequence[TiltSample]:
        if not self._stopped:
            self._collect()
        return self._tilts or ()

    def samples(self) -> Mapping[str, Sequence[float]]:
        """Return true quantities in steps of ``SAMPLE_STEP_PS``."""
        if not self._stopped:
            self._collect()
        return self._samples

    def _stop(self) -> None:
        self._collect()
        self._stopped = True
        self._watching.cancel()
        self._uart.release_times(self._times)

    def _collect(self) -> None:
        if self._tilts is not None:
            next_ps = self._tilts[-1].at_ps + TILT_STEP_PS if self._tilts else 0
            self._tilts += tilts_of(self._world, range(next_ps, self._clock.now_ps + 1, TILT_STEP_PS))
        for name, values in self._samples.items():
            at_ps = range(len(values) * SAMPLE_STEP_PS, self._clock.now_ps + 1, SAMPLE_STEP_PS)
            if at_ps:
                values.extend(QUANTITIES[name](self._world, np.array(at_ps) / PS_PER_S).tolist())
        data = bytes(self._uart.received()[self._uart.index_of(self._collected) :])
        self._collected = self._uart.received_count() - len(data)
        *complete, _ = data.split(b"\n")
        for raw in complete:
            self._add(raw, self._collected)
            self._collected += len(raw) + 1
        self._times.forget(self._collected)

    def _add(self, raw: bytes, position: int) -> None:
        """Add one line; the return of "\n\r" is not part of the next line."""
        begin = position + len(raw) - len(raw.lstrip(b"\r"))
        at_ps = max((self._times.ps(begin) - 1) // PS_PER_MS, 0) * PS_PER_MS
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


# -- Printed numbers compared with the truth ----------------------------------------------------------------


_MOST_ROWS = 12
_STILL_G = 0.05


def against_truth(field: str, lines: Sequence[PrintedLine], settle_ps: int, window: str = "") -> list[str]:
    """Return a table of prints, truth and error, and a summary. ``window`` is a part of the title.

    Decision: the table has the error at the moment of printing, because this error shows how old the printed number is.
    Expectations use the nearest truth; if this gives another largest error, an extra line shows it.
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
        return [f"{field} compared with the truth{window}: the firmware printed no {field}"]
    title = f"{field} when it was printed, compared with the truth at this time{window}"
    table = [title, f"{'t':>9} {'printed':>12} {'truth':>12} {'error':>12}"]
    worst = max(range(len(rows)), key=lambda row: abs(rows[row][3]) if math.isfinite(rows[row][3]) else -1.0)
    for index in _chosen(len(rows), worst):
        t_s, printed, truth, error, flag = rows[index]
        table.append(f"{t_s:>7.3f} s {printed:>12.3f} {truth:>12.3f} {error:>+12.3f}{flag}")
    count = "1 printed value" if len(rows) == 1 else f"{len(rows)} printed values"
    first, last, largest = rows[0][3], rows[-1][3], _largest(row[3] for row in rows)
    shown = "" if len(rows) <= _MOST_ROWS else f", {_MOST_ROWS} of them in the table"
    table.append(f"error: first {first:+.3f}, last {last:+.3f}, largest {largest:+.3f}, {count}{shown}")
    counted = f"{_largest(judged):+.3f}"
    if counted != f"{largest:+.3f}":
        table.append(
            f"the expectations compare with the true values {settle_text(settle_ps)}: largest error {counted}"
        )
    return table


def _largest(errors: Iterable[float]) -> float:
    """Return the error that is farthest from 0, or NaN without a finite error."""
    return max(filter(math.isfinite, errors), key=abs, default=math.nan)


def _flag(field: str, line: PrintedLine) -> str:
    """Return a note for an angle printed while the board accelerated.

    The slides' check of the modulus does not detect sideways acceleration: an acceleration of 0.36
    g turns the vertical by 20 degrees, but the modulus is 1.06 g.
    """
    if field not in ANGLES:
        return ""
    moving_g = float(line.truth[MOVING_G][1][-1])
    return "" if moving_g <= _STILL_G else f"   accelerated by {moving_g:.2f} g: tilt is not measurable"


def _chosen(count: int, worst: int) -> list[int]:
    """Return a dozen rows: the first, the last, ``worst``, and evenly spaced rows."""
    if count <= _MOST_ROWS:
        return list(range(count))
    chosen = [index * (count - 1) // (_MOST_ROWS - 1) for index in range(_MOST_ROWS)]
    if worst not in chosen:
        inner = min(chosen[1:-1], key=lambda index: abs(index - worst))
        chosen[chosen.index(inner)] = worst
    return sorted(chosen)
