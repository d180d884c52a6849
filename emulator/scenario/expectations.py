"""Expectations about terminal output, printed numbers and hardware.

One class holds the schema and the evaluation of a kind of expectation. To add a kind, write a class and add
its name to ``Kinds`` of :mod:`fcu_emulator.emulator.scenario.schema`. Expectations about LEDs and timers are
in :mod:`fcu_emulator.emulator.scenario.hardware`.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise
from typing import Annotated, Any, ClassVar, Literal, Self

import numpy as np
from pydantic import AfterValidator, Field, model_validator

from fcu_emulator.emulator.buses.uart import decoded
from fcu_emulator.emulator.scenario.fields import (
    Duration,
    Length,
    PatternText,
    Table,
    TextFile,
    TextPattern,
    TimeBudget,
    Window,
)
from fcu_emulator.emulator.scenario.formats import (
    FormatText,
    NamedFormat,
    NumberFormat,
    NumberPattern,
    PatternFormat,
    PrintfFormat,
    shown_format,
)
from fcu_emulator.emulator.scenario.run_view import (
    FIELDS,
    MAX_SETTLE_PS,
    QUANTITIES,
    BoardView,
    PrintedLine,
    TiltSample,
    deviation,
    escaped,
    nearest_truth,
    same_banner,
    unit_of,
)
from fcu_emulator.emulator.scenario.text_diff import (
    Fault,
    difference,
    fault_between,
    first_difference,
    format_difference,
    nearest,
)
from fcu_emulator.emulator.text import shown, visible
from fcu_emulator.emulator.time.clock import PS_PER_MS, seconds

# -- Shared by all expectations: failure, view of the run, window -------------------------------------------


@dataclass(frozen=True)
class Failure:
    """Reason for a failed expectation."""

    fault: Fault
    expected: str
    seen: str
    diff: tuple[str, ...] = ()
    """Lines in the style of a unified diff: "-" expected, "+" printed, " " around them."""
    for_good: bool = False
    """Whether the failure is final: no later output or LED state can correct it, so it is reported during the run."""
    finding: str = ""
    """Details beyond ``fault``: for a LED "never lit", "one side", "late" and so on. They select a rubric's hint."""

    @property
    def kind(self) -> str:
        """Return the finding, or the fault if there is no finding."""
        return self.finding or self.fault

    def __str__(self) -> str:
        return f"expected {self.expected}; seen: {self.seen}"


@dataclass(frozen=True)
class RunView:
    """A run as expectations see it: its lines, and the board after ``end_ps``."""

    board: BoardView
    lines: list[PrintedLine]
    end_ps: int
    patience: TimeBudget = field(default_factory=TimeBudget)
    tilts: Sequence[TiltSample] = ()
    """The board's inclination in steps of 10 ms, if an expectation needs it."""
    samples: Mapping[str, Sequence[float]] = field(default_factory=dict)
    """The quantities that conditions need, in the same steps."""
    watched: Mapping[int, Any] = field(default_factory=dict)
    """Results of :meth:`Expectation.watch`, by the identity of the expectation."""


class Expectation(Table, ABC):
    """One ``[[expect]]`` table: schema and evaluation in one class.

    ``ON_TERMINAL``: whether it reads terminal output, which ends with a crash.
    """

    ON_TERMINAL: ClassVar[bool] = False

    def watch(self, board: BoardView) -> Any:
        """Start watching at power-on, for expectations that observe the run; the result is kept in ``Seen.watched``."""
        del board
        return None

    @abstractmethod
    def wording(self) -> str:
        """Describe the expectation for verdicts and for the page."""

    @abstractmethod
    def judge(self, seen: RunView) -> Failure | None:
        """Return the failure, or None if the expectation is met."""


class Windowed(Window, Expectation):
    """Expectation about one part of the run: only lines whose printing began in the window count."""

    ON_TERMINAL = True

    def lines_in_window(self, seen: RunView) -> list[PrintedLine]:
        """Return the lines whose printing began in the window."""
        return [line for line in seen.lines if self.covers(line.at_ps)]


# -- The terminal's text: a line, a pattern, a pattern never, the whole text --------------------------------


class ExpectLine(Windowed):
    """A line with exactly this text appears; with ``count`` exactly so often."""

    kind: Literal["line"]
    text: str = Field(max_length=255)  # longest text of one PRINTF
    count: int | None = Field(None, ge=1)

    def wording(self) -> str:
        times = "" if self.count is None else " once" if self.count == 1 else f" {self.count} times"
        return f"the line {shown_line(same_banner(self.text.strip()))}{times}{self.window_text()}"

    def judge(self, seen: RunView) -> Failure | None:
        """Compare whole lines without leading and trailing blanks."""
        wanted = same_banner(self.text.strip())
        lines = [same_banner(line.text) for line in self.lines_in_window(seen)]
        found = lines.count(wanted)
        if found == self.count or (found and self.count is None):
            return None
        if found:
            too_often = found > (self.count or found)
            return Failure("wrong value", self.wording(), f"{found} times", for_good=too_often)
        nearly = nearly_printed(wanted, lines, self.wording(), seen.patience)
        return nearly or Failure("missing", self.wording(), f"{len(lines)} other lines")


def nearly_printed(wanted: str, lines: Sequence[str], expected: str, patience: TimeBudget) -> Failure | None:
    """Describe the difference to the most similar line; None if no line is similar."""
    near = None
    if not patience.exhausted:
        with patience.limited():
            near = nearest(wanted, lines)
    if near is None:
        return None
    diff = (f"-{escaped(wanted)}", f"+{escaped(near)}")
    return Failure(fault_between(wanted, near), expected, shown_line(near), diff)


class _Matching(Windowed):
    pattern: PatternText

    def matches(self, seen: RunView) -> list[PrintedLine]:
        """Return the lines in the window that contain the pattern."""
        lines = self.lines_in_window(seen)
        return [line for line in lines if self._found_in(line.text, seen.patience)]

    def _found_in(self, line: str, patience: TimeBudget) -> bool:
        texts = dict.fromkeys((line, same_banner(line)))
        return any(self.pattern.found_in(text, patience) for text in texts)


class ExpectRegex(_Matching):
    """A line contains the pattern; with ``count``, exactly so many lines contain it."""

    kind: Literal["regex"]
    count: int | None = Field(None, ge=1)

    def wording(self) -> str:
        """Describe the pattern and the number of lines."""
        times = "" if self.count is None else f" in {self.count} line{'s' * (self.count > 1)}"
        return f'a match of "{visible(self.pattern.text)}"{times}{self.window_text()}'

    def judge(self, seen: RunView) -> Failure | None:
        found = len(self.matches(seen))
        if found == self.count or (found and self.count is None):
            return None
        too_many = found > (self.count or found)
        fault: Fault = "wrong value" if found else "missing"
        return Failure(fault, self.wording(), f"{found} matches", for_good=too_many)


class ExpectNever(_Matching):
    """No line contains the pattern."""

    kind: Literal["never"]

    def wording(self) -> str:
        return f'no match of "{visible(self.pattern.text)}"{self.window_text()}'

    def judge(self, seen: RunView) -> Failure | None:
        found = self.matches(seen)
        if not found:
            return None
        first = found[0]
        seen_text = f"{len(found)} lines, first line {first.number} at {seconds(first.at_ps)}"
        return Failure("wrong value", self.wording(), seen_text, (f"+{escaped(first.text)}",), for_good=True)


class ExpectText(Expectation):
    """The whole output equals a file, byte by byte; the path is relative to the scenario's folder."""

    ON_TERMINAL = True

    kind: Literal["text"]
    file: TextFile

    def wording(self) -> str:
        expected = same_banner(decoded(self.file.content))
        lines = len(expected.split("\n"))
        return f"{self.file.path} ({lines} lines, {len(expected)} bytes)"

    def judge(self, seen: RunView) -> Failure | None:
        expected = same_banner(decoded(self.file.content))
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
        ended = index < len(printed_lines) - 1  # the first different line that is complete
        return Failure(fault, self.wording(), count, difference(wanted_lines, printed_lines), for_good=ended)


def shown_line(text: str) -> str:
    """Return a line as messages show it."""
    return f'"{escaped(text)}"'


# -- Printed numbers ----------------------------------------------------------------------------------------


SETTLE_PS = 50 * PS_PER_MS  # one period of the slowest sensor (the LPS22HB at 25 Hz) and ten of the timer's
_DIFF_LINES = 3  # deviating lines that a finding shows


def _known_field(name: str) -> str:
    if name not in FIELDS:
        raise ValueError(f"is {shown(name)}; known: {', '.join(FIELDS)}")
    return name


def _known_quantity(name: str) -> str:
    if name not in QUANTITIES:
        raise ValueError(f"is {shown(name)}; known: {', '.join(QUANTITIES)}")
    return name


QuantityName = Annotated[
    str, AfterValidator(_known_quantity), Field(json_schema_extra={"enum": list(QUANTITIES)})
]
FieldName = Annotated[str, AfterValidator(_known_field), Field(json_schema_extra={"enum": list(FIELDS)})]


class _Number(Windowed):
    """A printed number: a number of the slides by ``name``, or one of a lab by ``format`` string or ``pattern``.

    ``number``: index of the number in the format, counted from 1.
    """

    name: FieldName | None = None
    format: FormatText | None = None
    number: int = Field(1, ge=1)
    pattern: NumberPattern | None = None

    @model_validator(mode="after")
    def _one_number(self) -> Self:
        if sum(one is not None for one in (self.name, self.format, self.pattern)) != 1:
            raise ValueError("needs one of name, format and pattern")
        if self.format is not None:
            PrintfFormat(self.format, self.number)
        elif self.number != 1:
            raise ValueError("has number without format; leave it out")
        return self

    def number_format(self, patience: TimeBudget | None = None) -> NumberFormat:
        """Return the format that finds the number in a line."""
        if self.format is not None:
            return PrintfFormat(self.format, self.number, patience)
        return NamedFormat(self.name) if self.name else PatternFormat(self._pattern(), patience)

    @property
    def title(self) -> str:
        """Name the number for findings."""
        if self.name is not None:
            return self.name
        which = f" (number {self.number})" if self.number > 1 else ""
        return shown_format(self.format or self._pattern().text) + which

    def _pattern(self) -> TextPattern:
        assert self.pattern is not None  # guaranteed by the validator
        return self.pattern


class ExpectField(_Number):
    """Each print of a number in the window is near ``value``, or near the truth.

    Near the truth means: within ``tolerance`` of a true value in the time ``settle`` before printing began.
    The measurement is a little older than its print (LPS22HB: 40 ms). ``truth`` names a quantity, or is true
    for the quantity with the number's name. The printed number is ``scale`` times the quantity.
    """

    kind: Literal["field"]
    value: float | None = None
    truth: bool | QuantityName = False
    scale: float = 1.0
    tolerance: float = Field(ge=0)
    settle: Duration = SETTLE_PS

    @model_validator(mode="after")
    def _one_reference(self) -> ExpectField:
        if (self.value is None) == (not self.truth):
            raise ValueError("needs either value = ... or truth = true")
        if self.truth is True and self.name is None:
            raise ValueError('has truth = true without a name; give a quantity, such as truth = "Roll"')
        if self.scale == 0 or (self.scale != 1 and not self.truth):
            raise ValueError("has a scale that nothing can be compared by; give one above 0, and truth")
        if self.settle > MAX_SETTLE_PS:
            raise ValueError(f'settle is {seconds(self.settle)}; give at most "1s"')
        return self

    @property
    def quantity(self) -> str:
        """Return the name of the true quantity; "" for a comparison with a value."""
        return (self.name or "") if self.truth is True else self.truth or ""

    def wording(self) -> str:
        """Describe the reference and the tolerance."""
        unit = f" {unit_of(self.name)}" if self.name else ""
        return f"{self.title} within {self.tolerance:g}{unit} of {self._target()}{self.window_text()}"

    def _target(self) -> str:
        if self.value is not None:
            return f"{self.value:g}"
        recent = nearest_truth(self.settle) if self.settle else ""
        if self.truth is True and self.scale == 1:
            return recent or "the truth"
        scaled = f" times {self.scale:g}" if self.scale != 1 else ""
        return f"the true {self.quantity}{scaled}" + (f" ({recent})" if recent else "")

    def judge(self, seen: RunView) -> Failure | None:
        """Fail as missing if the number is never printed; also fail for a line that begins like it in another format."""
        line_format = self.number_format(seen.patience)
        lines = [line for line in self.lines_in_window(seen) if line_format.is_begun_by(line.text)]
        if not lines:
            return _not_printed(line_format, self.wording(), self.lines_in_window(seen), seen)
        numbers = [(line, line_format.number(line.text)) for line in lines]
        malformed = [line for line, number in numbers if number is None]
        if malformed:
            return replace(_malformed(line_format, self.wording(), malformed, len(lines)), for_good=True)
        errors = [(line, number, self._error(line, number)) for line, number in numbers if number is not None]
        wrong = [one for one in errors if not abs(one[2]) <= self.tolerance]
        if not wrong:
            return None
        wrong.sort(key=lambda one: -abs(one[2]) if math.isfinite(one[2]) else math.inf)
        finite = [one for one in wrong if math.isfinite(one[2])]
        seen_text = (
            f"{len(finite)} of {len(lines)} prints off, {self._compared(*finite[0])}" if finite else ""
        )
        if len(finite) < len(wrong):
            none = f"{len(wrong) - len(finite)} of {len(lines)}"
            seen_text += f", {none} are nan or inf" if finite else f"{none} prints are nan or inf"
        diff = tuple(
            f"{_printed(line)}  (off by {error:+.6g}{self._reference(printed, error)})"
            for line, printed, error in wrong[:_DIFF_LINES]
        )
        return Failure("wrong value", self.wording(), seen_text, diff, for_good=True)

    def _compared(self, line: PrintedLine, printed: float, error: float) -> str:
        """Return the worst print and its reference."""
        what = "the truth is" if self.truth else "expected is"
        worst = f"{self.title} is {printed:.6g} and {what} {self._wanted(printed, error):.6g}"
        return f"the worst by {abs(error):.6g} at {seconds(line.at_ps)}: {worst}"

    def _reference(self, printed: float, error: float) -> str:
        if not self.truth or not math.isfinite(error):
            return ""
        return f", the truth is {self._wanted(printed, error):.6g}"

    def _wanted(self, printed: float, error: float) -> float:
        wanted = printed - error
        half = 180 * abs(self.scale)
        around = (self.quantity or self.name) == "Yaw"
        rounded = round((wanted + half) % (2 * half) - half if around else wanted, 6)
        return rounded + 0.0  # not -0

    def _error(self, line: PrintedLine, printed: float) -> float:
        if self.value is not None:
            return deviation(self.name or "", printed, self.value)
        return self.scale * line.error(self.quantity, printed / self.scale, self.settle)


class ExpectPrinted(_Number):
    """A number is printed in its format at least every ``max_gap``."""

    RENAMED: ClassVar[Mapping[str, str]] = {"longest_gap": "max_gap"}

    kind: Literal["printed"]
    max_gap: Length

    def wording(self) -> str:
        """Describe the format of the line and its interval."""
        every = f"at least every {seconds(self.max_gap)}"
        return f'a line "{self.number_format().text}" {every}{self.window_text()}'

    def judge(self, seen: RunView) -> Failure | None:
        """Check from the window's begin to its end, or to the run's end."""
        line_format, expected = self.number_format(seen.patience), self.wording()
        lines = [line for line in self.lines_in_window(seen) if line_format.is_begun_by(line.text)]
        earlier = [line for line in seen.lines if line.at_ps < self.from_]
        before = [line for line in earlier if line_format.number(line.text) is not None]
        if not lines and before:
            return Failure("missing", expected, f"none after {seconds(before[-1].at_ps)}")
        if not lines:
            return _not_printed(line_format, expected, self.lines_in_window(seen), seen)
        wrong = [line for line in lines if line_format.number(line.text) is None]
        if wrong:
            return _malformed(line_format, expected, wrong, len(lines))
        end_ps = seen.end_ps if self.to is None else min(self.to, seen.end_ps)
        times = [self.from_, *(line.at_ps for line in lines), end_ps]
        gap, since = max((after - before, before) for before, after in pairwise(times))
        if gap <= self.max_gap:
            return None
        return Failure("missing", expected, f"none for {seconds(gap)} from {seconds(since)} on")


class ExpectWithin(_Number):
    """Each print of a number is from ``min`` to ``max``; two prints differ by ``min_difference`` or more."""

    RENAMED: ClassVar[Mapping[str, str]] = {"least": "min", "most": "max", "apart": "min_difference"}

    kind: Literal["within"]
    min: float
    max: float
    min_difference: float = Field(0.0, ge=0)

    def wording(self) -> str:
        apart = f", two of them {self.min_difference:g} apart" if self.min_difference else ""
        return f"{self.title} from {self.min:g} to {self.max:g}{apart}{self.window_text()}"

    def judge(self, seen: RunView) -> Failure | None:
        """Fail as missing if the number is never printed."""
        line_format, expected = self.number_format(seen.patience), self.wording()
        parsed = [(line, line_format.number(line.text)) for line in self.lines_in_window(seen)]
        values = [(line, number) for line, number in parsed if number is not None]
        if not values:
            return _not_printed(line_format, expected, self.lines_in_window(seen), seen)
        wrong = [line for line, value in values if not self.min <= value <= self.max]
        if wrong:
            text, diff = f"{len(wrong)} of {len(values)} prints outside", map(_printed, wrong[:_DIFF_LINES])
            return Failure("wrong value", expected, text, tuple(diff), for_good=True)
        apart = np.ptp([value for _, value in values])
        if apart < self.min_difference:
            text = f"all {len(values)} within {apart:g}"
            return Failure("wrong value", expected, text, (_printed(values[0][0]),))
        return None


def _not_printed(
    line_format: NumberFormat, expected: str, lines: Sequence[PrintedLine], seen: RunView
) -> Failure:
    """Report that no line of the window begins like the format: the output has another form, or none."""
    near = [line for line in lines if line_format.is_meant_by(line.text)]
    if not near:
        text = f'no line "{line_format.text}" among {len(lines)} lines'
        outside = [line for line in seen.lines if line_format.is_begun_by(line.text)]
        if outside:
            text += f", the last one is at {seconds(outside[-1].at_ps)}"
        return Failure("missing", expected, text)
    return _malformed(line_format, expected, near, len(near))


def _malformed(line_format: NumberFormat, expected: str, wrong: Sequence[PrintedLine], count: int) -> Failure:
    """Report lines with the format's beginning that do not follow it, and the difference."""
    what = format_difference(line_format.text, wrong[0].text)
    seen_text = f"{len(wrong)} of {count} lines in another format" + (f": {what}" if what else "")
    diff = (f"-{line_format.text}", *map(_printed, wrong[:_DIFF_LINES]))
    return Failure("wrong format", expected, seen_text, diff)


def _printed(line: PrintedLine) -> str:
    return f"+{escaped(line.text)}  at {seconds(line.at_ps)}"
