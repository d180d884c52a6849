"""Expectation for lines that follow a condition."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from itertools import pairwise
from typing import ClassVar, Literal

from pydantic import Field, model_validator

from fcu_emulator.emulator.clock import PS_PER_MS, seconds
from fcu_emulator.emulator.scenario.conditions import Condition, Followed, Stretch
from fcu_emulator.emulator.scenario.expectations import RunView, Windowed, shown_line
from fcu_emulator.emulator.scenario.fields import Duration, Length, PatternText
from fcu_emulator.emulator.scenario.rests import Rest, is_printed, mistake, resting
from fcu_emulator.emulator.scenario.result import ExpectationResult
from fcu_emulator.emulator.scenario.run_view import SAMPLE_STEP_PS, PrintedLine, escaped, same_banner
from fcu_emulator.emulator.text import visible

_DIFF_LINES = 3  # lines in a finding


class ExpectLineFollows(Windowed):
    """While a condition is true, a line is printed at intervals of at most ``max_gap``; otherwise, never.

    The line equals ``text`` or matches ``pattern``. The line is optional within the margin, and for
    the time ``settle`` after a change.
    """

    RENAMED: ClassVar[Mapping[str, str]] = {"longest_gap": "max_gap"}

    kind: Literal["line_follows"]
    text: str | None = Field(None, min_length=1, max_length=255)
    pattern: PatternText | None = None
    when: Condition
    max_gap: Length
    settle: Duration = 300 * PS_PER_MS

    @model_validator(mode="after")
    def _one_line(self) -> ExpectLineFollows:
        if (self.text is None) == (self.pattern is None):
            raise ValueError("must have either text = ... or pattern = ...")
        return self

    def describe(self) -> str:
        """Describe line, interval and condition."""
        every = (
            f"is printed at least every {seconds(self.max_gap)} while {self.when.text()}, and never otherwise"
        )
        return f"{self._line()} {every}{self.window_text()}"

    def evaluate(self, run: RunView) -> ExpectationResult:
        """Report the longest time without the line, or else the first wrong line."""
        lines = [line for line in self.lines_in_window(run) if self._is_it(line, run)]
        stretches = list(self._settled(run))
        wrong = [
            line
            for begin_ps, end_ps, holds in stretches
            for line in lines
            if holds is False and begin_ps <= line.at_ps < end_ps
        ]
        missing = self._longest_silence(stretches, lines)
        if missing is None and not wrong:
            return self.met()
        nearly = self._nearly(run) if missing is not None and not lines else None
        if nearly is not None:
            return nearly
        mistake, more = self._mistake(run, stretches, lines)
        if missing is not None:
            text = self._missing(run, missing, lines) + more
            return self.failed("missing", text, final=True, mistake=mistake)
        when = f"{seconds(wrong[0].at_ps)}{self.when.value_text(run, wrong[0].at_ps)}"
        times = "once" if len(wrong) == 1 else f"{len(wrong)} times"
        text = f"printed {times} in other conditions, first at {when}{more}"
        diff = tuple(f"+{escaped(line.text)}  at {seconds(line.at_ps)}" for line in wrong[:_DIFF_LINES])
        return self.failed("wrong value", text, diff, final=True, mistake=mistake)

    def followed(self, run: RunView) -> Followed:
        """Return the times of the lines, and the periods in which the condition is true."""
        at_ps = (line.at_ps for line in run.lines if self._is_it(line, run))
        shown = tuple((one, one) for one in at_ps)
        return Followed(self._line(), self.when.text(), self.when.held(run), shown)

    def _settled(self, run: RunView) -> list[Stretch]:
        """Return periods in which the line is mandatory or forbidden."""
        last_ps = run.end_ps if self.to is None else min(self.to, run.end_ps)
        cut = (
            Stretch(max(one.begin_ps + self.settle, self.from_), min(one.end_ps, last_ps), one.holds)
            for one in self.when.stretches(run)
            if one.holds is not None
        )
        return [one for one in cut if one.begin_ps < one.end_ps]

    def _longest_silence(self, stretches: list[Stretch], lines: list[PrintedLine]) -> tuple[int, int] | None:
        """Return (length, begin) of the longest silence, or None if this silence is short enough."""
        silences = [
            (after - before, before)
            for begin_ps, end_ps, holds in stretches
            if holds
            for before, after in pairwise(
                [begin_ps, *(line.at_ps for line in lines if begin_ps <= line.at_ps < end_ps), end_ps]
            )
        ]
        longest = max(silences, default=(0, 0))
        return longest if longest[0] > self.max_gap else None

    def _missing(self, run: RunView, silence: tuple[int, int], lines: list[PrintedLine]) -> str:
        length_ps, since_ps = silence
        where = f"none for {seconds(length_ps)} after {seconds(since_ps)}"
        value = self.when.value_text(run, since_ps + length_ps // 2)
        count = f"; {len(lines)} in total" if lines else "; never printed"
        return f"{where}{value}{count}"

    def _nearly(self, run: RunView) -> ExpectationResult | None:
        if self.text is None:
            return None
        lines = [same_banner(line.text) for line in self.lines_in_window(run)]
        nearly = self.nearly_printed(same_banner(self.text.strip()), lines, run.patience)
        return None if nearly is None else replace(nearly, is_final=True)

    def _mistake(self, run: RunView, stretches: list[Stretch], lines: list[PrintedLine]) -> tuple[str, str]:
        """Return the kind and the text of the mistake, or "" for both if unknown."""
        if self.when.quantity is None:
            return "", ""
        at_ps = [line.at_ps for line in lines]
        rests = [
            Rest(
                value,
                self._other(run, begin_ps),
                bool(stretch.holds),
                is_printed(at_ps, begin_ps, end_ps, self.max_gap),
            )
            for stretch in stretches
            for value, begin_ps, end_ps in resting(run.samples[self.when.quantity], stretch)
            if end_ps - begin_ps > self.max_gap
        ]
        return mistake(rests, self.when)

    def _other(self, run: RunView, at_ps: int) -> float:
        """Return roll for pitch, pitch for roll, and 0 for other quantities."""
        other = {"pitch": "roll", "roll": "pitch"}.get(self.when.quantity or "")
        return run.samples[other][at_ps // SAMPLE_STEP_PS] if other is not None else 0.0

    def _is_it(self, line: PrintedLine, run: RunView) -> bool:
        if self.text is not None:
            return same_banner(line.text) == same_banner(self.text.strip())
        return self.pattern is not None and self.pattern.found_in(line.text, run.patience)

    def _line(self) -> str:
        if self.text is not None:
            return f"the line {shown_line(self.text.strip())}"
        return f'a match of "{visible(self.pattern.text if self.pattern else "")}"'
