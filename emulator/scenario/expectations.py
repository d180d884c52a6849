"""Expectations: what the terminal shows, which numbers it prints, what the hardware does.

Schema and judgement of a kind of expectation stand in one class, so that a new kind is one class and its name
in the union at the end.
"""

from __future__ import annotations

import difflib
import math
import re
from abc import ABC, abstractmethod
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import AfterValidator, Field, ValidationInfo, model_validator

from emulator.scenario.observed import (
    FIELDS,
    FORMAT_OF_FIELD,
    MAX_SETTLE_PS,
    BoardView,
    PrintedLine,
    deviation,
    escaped,
    nearest_truth,
    same_banner,
)
from emulator.scenario.tables import (
    LED_NAMES,
    Duration,
    Length,
    PatternText,
    SearchPatience,
    Table,
    TextFile,
    Window,
    board_of,
)
from emulator.text import shown, visible
from emulator.time.clock import NEVER_PS, PS_PER_MS, PS_PER_S, seconds
from emulator.trace import GpioEdge

# -- What every expectation has in common: how it is missed, a view of the run, a window --------------------


Fault = Literal["missing", "wrong value", "wrong format", "stopped"]
"""Not there at all; there with another value; there in another form; the run ended too soon."""


@dataclass(frozen=True)
class Miss:
    """How an expectation is not met."""

    fault: Fault
    expected: str
    seen: str
    diff: tuple[str, ...] = ()
    """Lines in the style of a unified diff: "-" expected, "+" printed, " " around them."""
    for_good: bool = False
    """Nothing that is printed or lit later can make up for it, so the verdict falls while the run is on."""

    def __str__(self) -> str:
        return f"expected {self.expected}; seen: {self.seen}"


@dataclass(frozen=True)
class Seen:
    """A run as expectations see it: its lines, and the board after ``end_ps``."""

    board: BoardView
    lines: list[PrintedLine]
    end_ps: int
    patience: SearchPatience = field(default_factory=SearchPatience)


class Expectation(Table, ABC):
    """One ``[[expect]]`` table: schema and judgement in one class."""

    @abstractmethod
    def wording(self) -> str:
        """What is expected, as verdicts and the page say it."""

    @abstractmethod
    def judge(self, seen: Seen) -> Miss | None:
        """How it is not met; None when it is."""


class Windowed(Window, Expectation):
    """Looks at a part of the run only: lines whose printing began in the window."""

    def lines_in_window(self, seen: Seen) -> list[PrintedLine]:
        """The lines that count."""
        return [line for line in seen.lines if self.covers(line.at_ps)]


# -- The terminal's text: a line, a pattern, a pattern never, the whole text --------------------------------


class ExpectLine(Windowed):
    """A line with exactly this text appears; with ``count`` exactly so often."""

    kind: Literal["line"]
    text: str = Field(max_length=255)  # what PRINTF can send at once
    count: int | None = Field(None, ge=1)

    def wording(self) -> str:
        """The line, and how often."""
        times = "" if self.count is None else " once" if self.count == 1 else f" {self.count} times"
        return f"the line {shown_line(same_banner(self.text.strip()))}{times}{self.window_text()}"

    def judge(self, seen: Seen) -> Miss | None:
        """Compares whole lines, blanks around them aside."""
        wanted = same_banner(self.text.strip())
        lines = [same_banner(line.text) for line in self.lines_in_window(seen)]
        found = lines.count(wanted)
        if found == self.count or (found and self.count is None):
            return None
        if found:
            too_often = found > (self.count or found)
            return Miss("wrong value", self.wording(), f"{found} times", for_good=too_often)
        near = None
        if not seen.patience.exhausted:
            with seen.patience.limited():
                near = nearest(wanted, lines)
        if near is None:
            return Miss("missing", self.wording(), f"{len(lines)} other lines")
        diff = (f"-{escaped(wanted)}", f"+{escaped(near)}")
        return Miss(fault_between(wanted, near), self.wording(), shown_line(near), diff)


class _Matching(Windowed):
    pattern: PatternText

    def matches(self, seen: Seen) -> list[PrintedLine]:
        """The lines in the window in which the pattern is found."""
        lines = self.lines_in_window(seen)
        return [line for line in lines if self._found_in(line.text, seen.patience)]

    def _found_in(self, line: str, patience: SearchPatience) -> bool:
        """The banner may be either."""
        texts = dict.fromkeys((line, same_banner(line)))
        return any(self.pattern.found_in(text, patience) for text in texts)


class ExpectRegex(_Matching):
    """The pattern is found in a line; ``count``: in exactly so many."""

    kind: Literal["regex"]
    count: int | None = Field(None, ge=1)

    def wording(self) -> str:
        """The pattern, and in how many lines."""
        times = "" if self.count is None else f" in {self.count} line{'s' * (self.count > 1)}"
        return f'a match of "{visible(self.pattern.text)}"{times}{self.window_text()}'

    def judge(self, seen: Seen) -> Miss | None:
        """Searches line by line."""
        found = len(self.matches(seen))
        if found == self.count or (found and self.count is None):
            return None
        too_many = found > (self.count or found)
        fault: Fault = "wrong value" if found else "missing"
        return Miss(fault, self.wording(), f"{found} matches", for_good=too_many)


class ExpectNever(_Matching):
    """The pattern is found in no line."""

    kind: Literal["never"]

    def wording(self) -> str:
        """The pattern."""
        return f'no match of "{visible(self.pattern.text)}"{self.window_text()}'

    def judge(self, seen: Seen) -> Miss | None:
        """Searches line by line."""
        found = self.matches(seen)
        if not found:
            return None
        first = found[0]
        seen_text = f"{len(found)} lines, first line {first.number} at {seconds(first.at_ps)}"
        return Miss("wrong value", self.wording(), seen_text, (f"+{escaped(first.text)}",), for_good=True)


class ExpectText(Expectation):
    """Everything printed equals a file, byte by byte; its path counts from the scenario's folder."""

    kind: Literal["text"]
    file: TextFile

    def wording(self) -> str:
        """The file and its size."""
        expected = same_banner(self.file.content.decode("latin-1"))
        lines = len(expected.split("\n"))
        return f"{self.file.path} ({lines} lines, {len(expected)} bytes)"

    def judge(self, seen: Seen) -> Miss | None:
        """Only the banner may differ."""
        expected = same_banner(self.file.content.decode("latin-1"))
        printed = same_banner(seen.board.terminal.text)
        if printed == expected:
            return None
        wanted_lines, printed_lines = expected.split("\n"), printed.split("\n")
        index = first_difference(wanted_lines, printed_lines)
        fault = fault_between(
            wanted_lines[index] if index < len(wanted_lines) else "",
            printed_lines[index] if index < len(printed_lines) else None,
        )
        count = f"{len(printed_lines)} lines, {len(printed)} bytes"
        ended = index < len(printed_lines) - 1  # the line that differs, which is not being printed any more
        return Miss(fault, self.wording(), count, difference(wanted_lines, printed_lines), for_good=ended)


def shown_line(text: str) -> str:
    """A line in a message."""
    return f'"{escaped(text)}"'


# -- Numbers and hardware: a printed field, a LED, the timer's ticks, the hard iron found -------------------


SETTLE_PS = 50 * PS_PER_MS  # one period of the slowest sensor (the LPS22HB at 25 Hz) and ten of the timer's
_DIFF_LINES = 3  # deviating lines that a finding shows


def _known_field(name: str) -> str:
    if name not in FIELDS:
        raise ValueError(f"is {shown(name)}; known: {', '.join(FIELDS)}")
    return name


FieldName = Annotated[str, AfterValidator(_known_field), Field(json_schema_extra={"enum": list(FIELDS)})]


class ExpectField(Windowed):
    """A number printed in the window is near ``value``, or near the truth, each time it is printed.

    Near the truth means: within ``tolerance`` of a value that the truth had in the time ``settle`` before the
    line's printing began, because what is printed was measured a little earlier (LPS22HB: 40 ms).
    """

    kind: Literal["field"]
    name: FieldName
    value: float | None = None
    truth: bool = False
    tolerance: float = Field(ge=0)
    settle: Duration = SETTLE_PS

    @model_validator(mode="after")
    def _one_reference(self) -> ExpectField:
        if (self.value is None) == (not self.truth):
            raise ValueError("needs either value = ... or truth = true")
        if self.settle > MAX_SETTLE_PS:
            raise ValueError(f'settle is {seconds(self.settle)}; give at most "1s"')
        return self

    def wording(self) -> str:
        """What the number is compared with, and how near it has to be."""
        reference = f"{self.value:g}" if self.value is not None else "the truth"
        if self.truth and self.settle:
            reference += f" ({nearest_truth(self.settle)})"
        return f"{self.name} within {self.tolerance:g} of {reference}{self.window_text()}"

    def judge(self, seen: Seen) -> Miss | None:
        """Missing when it is never printed; a line that begins like it in another format fails too."""
        line_format = FORMAT_OF_FIELD[self.name]
        lines = [line for line in self.lines_in_window(seen) if line.text.startswith(line_format.label)]
        if not lines:
            seen_text = f'no line "{line_format.text}" among {len(seen.lines)}'
            return Miss("missing", self.wording(), seen_text)
        numbers = [(line, line_format.parse(line.text)) for line in lines]
        malformed = [line for line, fields in numbers if fields is None]
        if malformed:
            seen_text = f"{len(malformed)} of {len(lines)} lines in another format"
            diff = (f"-{line_format.text}", *map(_printed, malformed[:_DIFF_LINES]))
            return Miss("wrong format", self.wording(), seen_text, diff, for_good=True)
        errors = [(line, self._error(line, fields[self.name])) for line, fields in numbers if fields]
        wrong = [(line, error) for line, error in errors if not abs(error) <= self.tolerance]
        if not wrong:
            return None
        sizes = [abs(error) for _, error in wrong if math.isfinite(error)]
        seen_text = f"{len(sizes)} of {len(lines)} prints off by up to {max(sizes):.6g}" if sizes else ""
        if len(sizes) < len(wrong):
            none = f"{len(wrong) - len(sizes)} of {len(lines)}"
            seen_text += f", {none} are nan or inf" if sizes else f"{none} prints are nan or inf"
        diff = tuple(f"{_printed(line)}  (off by {error:+.6g})" for line, error in wrong[:_DIFF_LINES])
        return Miss("wrong value", self.wording(), seen_text, diff, for_good=True)

    def _error(self, line: PrintedLine, printed: float) -> float:
        if self.value is not None:
            return deviation(self.name, printed, self.value)
        return line.error(self.name, printed, self.settle)


class ExpectPrinted(Windowed):
    """A field is printed, in the format of the slides, with never more than ``longest_gap`` between."""

    kind: Literal["printed"]
    name: FieldName
    longest_gap: Length

    def wording(self) -> str:
        """The line's format, and how often it comes."""
        every = f"at least every {seconds(self.longest_gap)}"
        return f'a line "{FORMAT_OF_FIELD[self.name].text}" {every}{self.window_text()}'

    def judge(self, seen: Seen) -> Miss | None:
        """From the window's begin to its end, or the run's."""
        line_format, expected = FORMAT_OF_FIELD[self.name], self.wording()
        lines = [line for line in self.lines_in_window(seen) if line.text.startswith(line_format.label)]
        if not lines:
            return Miss("missing", expected, f"none among {len(seen.lines)} lines")
        wrong = [line for line in lines if line_format.parse(line.text) is None]
        if wrong:
            diff = (f"-{line_format.text}", *map(_printed, wrong[:_DIFF_LINES]))
            return Miss("wrong format", expected, f"{len(wrong)} of {len(lines)} in another format", diff)
        end_ps = seen.end_ps if self.to is None else min(self.to, seen.end_ps)
        times = [self.from_, *(line.at_ps for line in lines), end_ps]
        gap, since = max((after - before, before) for before, after in pairwise(times))
        if gap <= self.longest_gap:
            return None
        return Miss("missing", expected, f"none for {seconds(gap)} from {seconds(since)} on")


class ExpectWithin(Windowed):
    """Each print of a field is a number from ``least`` to ``most``, and two of them are ``apart`` or more."""

    kind: Literal["within"]
    name: FieldName
    least: float
    most: float
    apart: float = Field(0.0, ge=0)

    def wording(self) -> str:
        """The range."""
        apart = f", two of them {self.apart:g} apart" if self.apart else ""
        return f"{self.name} from {self.least:g} to {self.most:g}{apart}{self.window_text()}"

    def judge(self, seen: Seen) -> Miss | None:
        """Missing when it is never printed."""
        line_format, expected = FORMAT_OF_FIELD[self.name], self.wording()
        parsed = [(line, line_format.parse(line.text)) for line in self.lines_in_window(seen)]
        values = [(line, fields[self.name]) for line, fields in parsed if fields is not None]
        if not values:
            return Miss("missing", expected, f'no line "{line_format.text}" among {len(seen.lines)}')
        wrong = [line for line, value in values if not self.least <= value <= self.most]
        if wrong:
            text, diff = f"{len(wrong)} of {len(values)} prints outside", map(_printed, wrong[:_DIFF_LINES])
            return Miss("wrong value", expected, text, tuple(diff), for_good=True)
        apart = np.ptp([value for _, value in values])
        if apart < self.apart:
            text = f"all {len(values)} within {apart:g}"
            return Miss("wrong value", expected, text, (_printed(values[0][0]),))
        return None


def _printed(line: PrintedLine) -> str:
    return f"+{escaped(line.text)}  at {seconds(line.at_ps)}"


def _known_led(name: str, info: ValidationInfo) -> str:
    known = [led.lower() for led in board_of(info).leds]
    if name not in known:
        raise ValueError(f"is {shown(name)}; give {' or '.join(map(repr, known))}")
    return name


LedName = Annotated[str, AfterValidator(_known_led), Field(json_schema_extra={"enum": LED_NAMES})]


class ExpectLed(Windowed):
    """A LED is on, or off, throughout the window."""

    kind: Literal["led"]
    led: LedName
    state: Literal["on", "off"]

    def wording(self) -> str:
        """The LED and its state."""
        return f"{self.led} {self.state}{self.window_text()}"

    def judge(self, seen: Seen) -> Miss | None:
        """From the edges of its pin in the trace; before the pin is set up the LED is dark."""
        wanted = self.state == "on"
        end_ps = seen.end_ps if self.to is None else min(self.to, seen.end_ps)
        for begin_ps, until_ps, lit in self._states(seen):
            first_ps, last_ps = max(begin_ps, self.from_), min(until_ps, end_ps)
            if first_ps < last_ps and lit is not wanted:
                seen_text = f"{'on' if lit else 'off'} from {seconds(first_ps)} to {seconds(last_ps)}"
                return Miss("wrong value", self.wording(), seen_text, for_good=True)
        return None

    def _states(self, seen: Seen) -> Iterator[tuple[int, int, bool]]:
        """(from, until, lit) one after the other."""
        pin = seen.board.led(self.led.upper()).pin
        begin_ps, lit = 0, False
        for edge in seen.board.trace.of(GpioEdge):
            if edge.pin == pin:
                yield begin_ps, edge.t_ps, lit
                begin_ps, lit = edge.t_ps, edge.level == 0
        yield begin_ps, NEVER_PS, lit


class ExpectTicks(Expectation):
    """How the timer's interrupt did: ticks late and lost, and its rate as configured."""

    kind: Literal["ticks"]
    late_min: int | None = Field(None, ge=0)
    late_max: int | None = Field(None, ge=0)
    lost_min: int | None = Field(None, ge=0)
    lost_max: int | None = Field(None, ge=0)
    rate_hz: float | None = Field(None, gt=0)
    rate_tolerance_hz: float = Field(0.01, ge=0)

    @model_validator(mode="after")
    def _something(self) -> ExpectTicks:
        if {self.late_min, self.late_max, self.lost_min, self.lost_max, self.rate_hz} == {None}:
            raise ValueError("needs one of late_min, late_max, lost_min, lost_max, rate_hz")
        return self

    def wording(self) -> str:
        """The rate, then what is asked of late and of lost ticks; a miss names only what is missed."""
        rate = [] if self.rate_hz is None else [f"ticks at {self.rate_hz:g} Hz"]
        bounds = (
            ("at least", self.late_min, "late"),
            ("at most", self.late_max, "late"),
            ("at least", self.lost_min, "lost"),
            ("at most", self.lost_max, "lost"),
        )
        return ", ".join(
            rate + [f"{which} {count} ticks {what}" for which, count, what in bounds if count is not None]
        )

    def judge(self, seen: Seen) -> Miss | None:
        """Of the callback's timer at the end of the run."""
        timer = seen.board.timer
        if timer.ticks == 0:
            return Miss("missing", f"ticks of {timer.name}", "the timer was never started")
        if self.rate_hz is not None and abs(timer.rate_hz - self.rate_hz) > self.rate_tolerance_hz:
            return Miss("wrong value", f"{timer.name} at {self.rate_hz:g} Hz", f"{timer.rate_hz:.6g} Hz")
        late = _outside("late", timer.late, self.late_min, self.late_max)
        return late or _outside("lost", timer.lost, self.lost_min, self.lost_max)


def _outside(what: str, count: int, low: int | None, high: int | None) -> Miss | None:
    if low is not None and count < low:
        return Miss("wrong value", f"at least {low} ticks {what}", f"{count}")
    if high is not None and count > high:
        return Miss("wrong value", f"at most {high} ticks {what}", f"{count}", for_good=True)
    return None


class ExpectHardIron(Expectation):
    """At the end MagCalibration's centre is the board's hard iron, on each axis."""

    kind: Literal["hard_iron"]
    within_mgauss: float = Field(ge=0)

    def wording(self) -> str:
        """How near the centre has to be."""
        return f"hard iron found within {self.within_mgauss:g} mgauss on each axis"

    def judge(self, seen: Seen) -> Miss | None:
        """(mag_min + mag_max) / 2 of the firmware's variables against the world."""
        expected = self.wording()
        try:
            low, high = (_axes(seen.board.variable(name)) for name in ("mag_min", "mag_max"))
        except (KeyError, AttributeError):
            return Miss("missing", expected, "the firmware has no variables mag_min and mag_max")
        centre = (low + high) / 2.0
        true = seen.board.world.hard_iron_mgauss(seen.end_ps / PS_PER_S)[0]
        if np.all(np.abs(centre - true) <= self.within_mgauss):
            return None
        return Miss("wrong value", expected, f"{_vector(centre)} where the board has {_vector(true)}")


def _axes(axes: Any) -> np.ndarray[Any, np.dtype[np.float64]]:
    return np.array([axes.AXIS_X, axes.AXIS_Y, axes.AXIS_Z], dtype=np.float64)


def _vector(values: np.ndarray[Any, np.dtype[np.float64]]) -> str:
    return f"({', '.join(f'{value:.1f}' for value in values)})"


# -- Showing how texts differ, in bounded time for texts of any length --------------------------------------


_CONTEXT = 3
_SHOWN = 6  # lines of each side after the first difference
_CANDIDATES = 500  # distinct lines among which a similar one is looked for
_LONGEST = 300  # characters of a line that are compared for similarity
_NUMBER = re.compile(r"-?\d+(?:\.\d+)?")


def first_difference(expected: Sequence[str], printed: Sequence[str]) -> int:
    """Index of the first line that differs."""
    common = min(len(expected), len(printed))
    return next((index for index in range(common) if expected[index] != printed[index]), common)


def difference(expected: Sequence[str], printed: Sequence[str]) -> tuple[str, ...]:
    """The place of the first difference, as a unified diff with a few lines of context."""
    index = first_difference(expected, printed)
    begin, end = max(index - _CONTEXT, 0), index + _SHOWN
    old, new = (list(map(escaped, side[begin:end])) for side in (expected, printed))
    hunks = difflib.unified_diff(old, new, n=_CONTEXT, lineterm="")
    return (f"@@ line {index + 1} @@", *(line for line in hunks if not line.startswith(("---", "+++", "@@"))))


def nearest(wanted: str, lines: Sequence[str]) -> str | None:
    """The line most like the wanted one, the same but for its numbers first; None when none is like it."""
    distinct = list(dict.fromkeys(line[:_LONGEST] for line in lines if line))[:_CANDIDATES]
    same_form = [line for line in distinct if _form(line) == _form(wanted)]
    folded = {line.casefold(): line for line in same_form or distinct}
    found = difflib.get_close_matches(wanted[:_LONGEST].casefold(), folded, n=1, cutoff=0.6)
    return folded[found[0]] if found else next(iter(same_form), None)


def fault_between(wanted: str, found: str | None) -> Fault:
    """Which of the faults it is that ``found`` stands in place of ``wanted``."""
    if found is None:
        return "missing"
    return "wrong value" if _form(wanted) == _form(found) else "wrong format"


def _form(line: str) -> str:
    return _NUMBER.sub("#", line)


Kinds = (
    ExpectLine
    | ExpectRegex
    | ExpectNever
    | ExpectField
    | ExpectLed
    | ExpectTicks
    | ExpectHardIron
    | ExpectText
    | ExpectPrinted
    | ExpectWithin
)
"""All kinds, told apart by ``kind``."""
