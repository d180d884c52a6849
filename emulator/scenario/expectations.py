"""Expectations about terminal output and printed numbers.

``schema.Kinds`` lists the classes of all kinds.
"""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Annotated, Any, ClassVar, Literal, Self

import numpy as np
from pydantic import AfterValidator, Field, model_validator

from fcu_emulator.emulator.buses.uart import decoded
from fcu_emulator.emulator.clock import PS_PER_MS, seconds
from fcu_emulator.emulator.scenario.fields import (
    Duration,
    Length,
    PatternText,
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
from fcu_emulator.emulator.scenario.result import ExpectationResult, Expected, Fault
from fcu_emulator.emulator.scenario.run_view import (
    FIELDS,
    MAX_SETTLE_PS,
    QUANTITIES,
    BoardView,
    PrintedLine,
    TiltSample,
    deviation,
    escaped,
    same_banner,
    settle_text,
    unit_of,
)
from fcu_emulator.emulator.scenario.text_diff import (
    difference,
    fault_between,
    first_difference,
    format_difference,
    nearest,
)
from fcu_emulator.emulator.text import choices, shown, visible

# -- Shared by all expectations: view of the run, evaluation, window -------------------------------------------


@dataclass(frozen=True)
class RunView:
    """The part of a run until ``end_ps``."""

    board: BoardView
    lines: list[PrintedLine]
    end_ps: int
    patience: TimeBudget = field(default_factory=TimeBudget)
    tilts: Sequence[TiltSample] = ()
    """Inclination of the board in steps of 10 ms, if an expectation needs it."""
    samples: Mapping[str, Sequence[float]] = field(default_factory=dict)
    """Quantities of conditions, in the same steps."""
    watched: Mapping[int, Any] = field(default_factory=dict)
    """Results of :meth:`Expectation.watch`, keyed by the ``id()`` of the expectation."""


class Expectation(Expected):
    """One ``[[expect]]`` table. ``ON_TERMINAL``: whether the result needs output. Output ends at a crash."""

    ON_TERMINAL: ClassVar[bool] = False

    @abstractmethod
    def evaluate(self, run: RunView) -> ExpectationResult: ...

    def result(self, run: RunView) -> ExpectationResult:
        """Evaluate the expectation. If a search takes too long, the result is "stopped"."""
        try:
            return self.evaluate(run)
        except TimeoutError:
            expected = "a pattern that can be searched in reasonable time"
            return self.failed("stopped", "the search took too long", expected=expected)


class Windowed(Window, Expectation):
    """Expectation about lines whose printing began in the window."""

    ON_TERMINAL = True

    def lines_in_window(self, run: RunView) -> list[PrintedLine]:
        return [line for line in run.lines if self.covers(line.at_ps)]

    def nearly_printed(
        self, wanted: str, lines: Sequence[str], patience: TimeBudget
    ) -> ExpectationResult | None:
        """Return a failure that shows the most similar line, or None."""
        near = None
        if not patience.exhausted:
            with patience.limited():
                near = nearest(wanted, lines)
        if near is None:
            return None
        diff = (f"-{escaped(wanted)}", f"+{escaped(near)}")
        return self.failed(fault_between(wanted, near), shown_line(near), diff)


# -- The terminal's text: a line, a pattern, no match of a pattern, the whole text --------------------------


class ExpectLine(Windowed):
    """A line has exactly this text. If ``count`` is given, exactly ``count`` lines have the text."""

    kind: Literal["line"]
    text: str = Field(max_length=255)  # size of PRINTF's buffer
    count: int | None = Field(None, ge=1)

    def describe(self) -> str:
        times = "" if self.count is None else " once" if self.count == 1 else f" {self.count} times"
        return f"the line {shown_line(same_banner(self.text.strip()))}{times}{self.window_text()}"

    def evaluate(self, run: RunView) -> ExpectationResult:
        wanted = same_banner(self.text.strip())
        lines = [same_banner(line.text) for line in self.lines_in_window(run)]
        found = lines.count(wanted)
        if found == self.count or (found and self.count is None):
            return self.met()
        if found:
            too_often = found > (self.count or found)
            return self.failed("wrong value", f"{found} times", final=too_often)
        nearly = self.nearly_printed(wanted, lines, run.patience)
        return nearly or self.failed("missing", f"{len(lines)} other lines")


class _Matching(Windowed):
    pattern: PatternText

    def matches(self, run: RunView) -> list[PrintedLine]:
        """Return the window's lines that contain the pattern."""
        lines = self.lines_in_window(run)
        return [line for line in lines if self._found_in(line.text, run.patience)]

    def _found_in(self, line: str, patience: TimeBudget) -> bool:
        texts = dict.fromkeys((line, same_banner(line)))
        return any(self.pattern.found_in(text, patience) for text in texts)


class ExpectRegex(_Matching):
    """A line contains the pattern. If ``count`` is given, exactly ``count`` lines contain the pattern."""

    kind: Literal["regex"]
    count: int | None = Field(None, ge=1)

    def describe(self) -> str:
        times = "" if self.count is None else f" in {self.count} line{'s' * (self.count > 1)}"
        return f'a match of "{visible(self.pattern.text)}"{times}{self.window_text()}'

    def evaluate(self, run: RunView) -> ExpectationResult:
        found = len(self.matches(run))
        if found == self.count or (found and self.count is None):
            return self.met()
        too_many = found > (self.count or found)
        fault: Fault = "wrong value" if found else "missing"
        return self.failed(fault, f"{found} matches", final=too_many)


class ExpectNever(_Matching):
    """No line contains the pattern."""

    kind: Literal["never"]

    def describe(self) -> str:
        return f'no match of "{visible(self.pattern.text)}"{self.window_text()}'

    def evaluate(self, run: RunView) -> ExpectationResult:
        found = self.matches(run)
        if not found:
            return self.met()
        first = found[0]
        seen = f"{len(found)} lines, first line {first.number} at {seconds(first.at_ps)}"
        return self.failed("wrong value", seen, (f"+{escaped(first.text)}",), final=True)


class ExpectText(Expectation):
    """The whole output equals a file in the scenario's folder."""

    ON_TERMINAL = True

    kind: Literal["text"]
    file: TextFile

    def describe(self) -> str:
        expected = same_banner(decoded(self.file.content))
        lines = len(expected.split("\n"))
        return f"{self.file.path} ({lines} lines, {len(expected)} bytes)"

    def evaluate(self, run: RunView) -> ExpectationResult:
        expected = same_banner(decoded(self.file.content))
        printed = same_banner(run.board.terminal.text)
        if printed == expected:
            return self.met()
        wanted_lines, printed_lines = expected.split("\n"), printed.split("\n")
        index = first_difference(wanted_lines, printed_lines)
        fault = fault_between(
            wanted_lines[index] if index < len(wanted_lines) else "",
            printed_lines[index] if index < len(printed_lines) else None,
        )
        count = f"{len(printed_lines)} lines, {len(printed)} bytes"
        ended = index < len(printed_lines) - 1  # whether the first different line is complete
        return self.failed(fault, count, difference(wanted_lines, printed_lines), final=ended)


def shown_line(text: str) -> str:
    """Return a line in the form that is used in messages."""
    return f'"{escaped(text)}"'


# -- Printed numbers ----------------------------------------------------------------------------------------


SETTLE_PS = 50 * PS_PER_MS  # a period of the slowest sensor (LPS22HB, 25 Hz) and several periods of the timer
_DIFF_LINES = 3  # lines in a finding


def _known_field(name: str) -> str:
    if name not in FIELDS:
        raise ValueError(f"must be {choices(FIELDS)}, not {shown(name)}")
    return name


def _known_quantity(name: str) -> str:
    if name not in QUANTITIES:
        raise ValueError(f"must be {choices(QUANTITIES)}, not {shown(name)}")
    return name


QuantityName = Annotated[
    str, AfterValidator(_known_quantity), Field(json_schema_extra={"enum": list(QUANTITIES)})
]
FieldName = Annotated[str, AfterValidator(_known_field), Field(json_schema_extra={"enum": list(FIELDS)})]


class _Number(Windowed):
    """A number of the slides by ``name``, or any number by ``format`` or ``pattern``.

    ``number``: index in the format, from 1.
    """

    name: FieldName | None = None
    format: FormatText | None = None
    number: int = Field(1, ge=1)
    pattern: NumberPattern | None = None

    @model_validator(mode="after")
    def _one_number(self) -> Self:
        if sum(one is not None for one in (self.name, self.format, self.pattern)) != 1:
            raise ValueError("must have exactly one of name, format and pattern")
        if self.format is not None:
            PrintfFormat(self.format, self.number)
        elif self.number != 1:
            raise ValueError("must not have number without format")
        return self

    def number_format(self, patience: TimeBudget | None = None) -> NumberFormat:
        if self.format is not None:
            return PrintfFormat(self.format, self.number, patience)
        return NamedFormat(self.name) if self.name else PatternFormat(self._pattern(), patience)

    @property
    def title(self) -> str:
        if self.name is not None:
            return self.name
        which = f" (number {self.number})" if self.number > 1 else ""
        return shown_format(self.format or self._pattern().text) + which

    def _not_printed(self, number: NumberFormat, run: RunView) -> ExpectationResult:
        lines = self.lines_in_window(run)
        near = [line for line in lines if number.is_meant_by(line.text)]
        if near:
            return self._malformed(number, near, len(near))
        text = f'no line "{number.text}" among {len(lines)} lines'
        outside = [line for line in run.lines if number.is_begun_by(line.text)]
        if outside:
            text += f"; the last such line outside of the time window is at {seconds(outside[-1].at_ps)}"
        return self.failed("missing", text)

    def _malformed(
        self, number: NumberFormat, wrong: Sequence[PrintedLine], count: int, final: bool = False
    ) -> ExpectationResult:
        what = format_difference(number.text, wrong[0].text)
        seen = f"{len(wrong)} of {count} lines have another format" + (f": {what}" if what else "")
        diff = (f"-{number.text}", *map(_printed, wrong[:_DIFF_LINES]))
        return self.failed("wrong format", seen, diff, final=final)

    def _pattern(self) -> TextPattern:
        assert self.pattern is not None  # the validator has checked this
        return self.pattern


class ExpectField(_Number):
    """Each printed number is near ``value``, or near the truth.

    The error of a printed number is its smallest distance from the truth in the time ``settle``
    before printing began. ``truth`` names a quantity. ``truth = true`` means the quantity with the
    number's name. The printed number is ``scale`` times the quantity.
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
            raise ValueError("must have either value = ... or truth = true")
        if self.truth is True and self.name is None:
            raise ValueError('must have truth = QUANTITY, such as truth = "Roll", because it has no name')
        if self.scale == 0 or (self.scale != 1 and not self.truth):
            raise ValueError("must have a scale above 0, together with truth")
        if self.settle > MAX_SETTLE_PS:
            raise ValueError(f'settle must be at most "1s", not {seconds(self.settle)}')
        return self

    @property
    def quantity(self) -> str:
        """Return the name of the true quantity, or "" if ``value`` is given."""
        return (self.name or "") if self.truth is True else self.truth or ""

    def describe(self) -> str:
        unit = f" {unit_of(self.name)}" if self.name else ""
        return f"{self.title} is within {self.tolerance:g}{unit} of {self._target()}{self.window_text()}"

    def _target(self) -> str:
        if self.value is not None:
            return f"{self.value:g}"
        name = "value" if self.truth is True and self.scale == 1 else self.quantity
        scaled = f" times {self.scale:g}" if self.scale != 1 else ""
        return f"the true {name}{scaled}" + (f" {settle_text(self.settle)}" if self.settle else "")

    def evaluate(self, run: RunView) -> ExpectationResult:
        """Fail if the number is not printed, or a line has another format."""
        line_format = self.number_format(run.patience)
        lines = [line for line in self.lines_in_window(run) if line_format.is_begun_by(line.text)]
        if not lines:
            return self._not_printed(line_format, run)
        numbers = [(line, line_format.number(line.text)) for line in lines]
        malformed = [line for line, number in numbers if number is None]
        if malformed:
            return self._malformed(line_format, malformed, len(lines), final=True)
        errors = [(line, number, self._error(line, number)) for line, number in numbers if number is not None]
        wrong = [one for one in errors if not abs(one[2]) <= self.tolerance]
        if not wrong:
            return self.met()
        wrong.sort(key=lambda one: -abs(one[2]) if math.isfinite(one[2]) else math.inf)
        finite = [one for one in wrong if math.isfinite(one[2])]
        seen = (
            f"{len(finite)} of {len(lines)} printed values are wrong, {self._compared(*finite[0])}"
            if finite
            else ""
        )
        if len(finite) < len(wrong):
            none = f"{len(wrong) - len(finite)} of {len(lines)}"
            seen += f"; {none} are nan or inf" if finite else f"{none} printed values are nan or inf"
        diff = tuple(
            f"{_printed(line)}  (wrong by {error:+.6g}{self._reference(printed, error)})"
            for line, printed, error in wrong[:_DIFF_LINES]
        )
        return self.failed("wrong value", seen, diff, final=True)

    def _compared(self, line: PrintedLine, printed: float, error: float) -> str:
        """Describe the printed number with the largest error, and its reference."""
        what = "the true value is" if self.truth else "expected"
        worst = f"{self.title} is {printed:.6g}, {what} {self._wanted(printed, error):.6g}"
        return f"the largest error is {abs(error):.6g} at {seconds(line.at_ps)}: {worst}"

    def _reference(self, printed: float, error: float) -> str:
        if not self.truth or not math.isfinite(error):
            return ""
        return f", the true value is {self._wanted(printed, error):.6g}"

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
    """A number is printed in its format, and the gaps between successive lines are at most ``max_gap``."""

    RENAMED: ClassVar[Mapping[str, str]] = {"longest_gap": "max_gap"}

    kind: Literal["printed"]
    max_gap: Length

    def describe(self) -> str:
        every = f"at least every {seconds(self.max_gap)}"
        return f'a line "{self.number_format().text}" {every}{self.window_text()}'

    def evaluate(self, run: RunView) -> ExpectationResult:
        line_format = self.number_format(run.patience)
        lines = [line for line in self.lines_in_window(run) if line_format.is_begun_by(line.text)]
        earlier = [line for line in run.lines if line.at_ps < self.from_]
        before = [line for line in earlier if line_format.number(line.text) is not None]
        if not lines and before:
            return self.failed("missing", f"none after {seconds(before[-1].at_ps)}")
        if not lines:
            return self._not_printed(line_format, run)
        wrong = [line for line in lines if line_format.number(line.text) is None]
        if wrong:
            return self._malformed(line_format, wrong, len(lines))
        end_ps = run.end_ps if self.to is None else min(self.to, run.end_ps)
        times = [self.from_, *(line.at_ps for line in lines), end_ps]
        gap, since = max((after - before, before) for before, after in pairwise(times))
        if gap <= self.max_gap:
            return self.met()
        return self.failed("missing", f"none for {seconds(gap)} after {seconds(since)}")


class ExpectWithin(_Number):
    """Each printed number is from ``min`` to ``max``. The largest and the smallest differ by at least
    ``min_difference``."""

    RENAMED: ClassVar[Mapping[str, str]] = {"least": "min", "most": "max", "apart": "min_difference"}

    kind: Literal["within"]
    min: float
    max: float
    min_difference: float = Field(0.0, ge=0)

    def describe(self) -> str:
        apart = (
            f", and its smallest and largest value differ by at least {self.min_difference:g}"
            if self.min_difference
            else ""
        )
        return f"{self.title} is from {self.min:g} to {self.max:g}{apart}{self.window_text()}"

    def evaluate(self, run: RunView) -> ExpectationResult:
        line_format = self.number_format(run.patience)
        parsed = [(line, line_format.number(line.text)) for line in self.lines_in_window(run)]
        values = [(line, number) for line, number in parsed if number is not None]
        if not values:
            return self._not_printed(line_format, run)
        wrong = [line for line, value in values if not self.min <= value <= self.max]
        if wrong:
            text, diff = (
                f"{len(wrong)} of {len(values)} printed values are outside",
                map(_printed, wrong[:_DIFF_LINES]),
            )
            return self.failed("wrong value", text, tuple(diff), final=True)
        apart = np.ptp([value for _, value in values])
        if apart < self.min_difference:
            text = f"all {len(values)} printed values differ by at most {apart:g}"
            return self.failed("wrong value", text, (_printed(values[0][0]),))
        return self.met()


def _printed(line: PrintedLine) -> str:
    return f"+{escaped(line.text)}  at {seconds(line.at_ps)}"
