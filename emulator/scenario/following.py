"""Lines that follow a condition: printed again and again while it holds, and not otherwise."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import pairwise
from typing import ClassVar, Literal

from pydantic import Field, model_validator

from fcu_emulator.emulator.scenario.conditions import Condition, Followed, Stretch
from fcu_emulator.emulator.scenario.expectations import Miss, Seen, Windowed, shown_line
from fcu_emulator.emulator.scenario.observed import PrintedLine, escaped, same_banner
from fcu_emulator.emulator.scenario.tables import Duration, Length, PatternText
from fcu_emulator.emulator.text import visible
from fcu_emulator.emulator.time.clock import PS_PER_MS, seconds

_DIFF_LINES = 3  # wrong lines that a finding shows


class ExpectLineFollows(Windowed):
    """A line is printed at least every ``max_gap`` while a condition holds, and never otherwise.

    The line has exactly the ``text``, or matches the ``pattern``. For ``settle`` after the condition has
    changed, and within its margin, the line may be printed or not.
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
            raise ValueError("needs either text = ... or pattern = ...")
        return self

    def wording(self) -> str:
        """The line, how often, and when."""
        every = f"at least every {seconds(self.max_gap)} while {self.when.text()}, and not otherwise"
        return f"{self._line()} {every}{self.window_text()}"

    def judge(self, seen: Seen) -> Miss | None:
        """The first line that is missing, or else the first that is printed at another time."""
        lines = [line for line in self.lines_in_window(seen) if self._is_it(line, seen)]
        stretches = list(self._settled(seen))
        wrong = [
            line
            for begin_ps, end_ps, holds in stretches
            for line in lines
            if holds is False and begin_ps <= line.at_ps < end_ps
        ]
        missing = self._longest_silence(stretches, lines)
        if missing is not None:
            return self._missing(seen, missing, lines)
        if not wrong:
            return None
        when = f"{seconds(wrong[0].at_ps)}{self.when.value_text(seen, wrong[0].at_ps)}"
        text = f"printed {len(wrong)} times otherwise, first at {when}"
        diff = tuple(f"+{escaped(line.text)}  at {seconds(line.at_ps)}" for line in wrong[:_DIFF_LINES])
        return Miss("wrong value", self.wording(), text, diff, for_good=True)

    def followed(self, seen: Seen) -> Followed:
        """When the line is printed, and when it has to be, margin and settling aside."""
        at_ps = (line.at_ps for line in seen.lines if self._is_it(line, seen))
        shown = tuple((one, one) for one in at_ps)
        return Followed(self._line(), self.when.text(), self.when.held(seen), shown)

    def _settled(self, seen: Seen) -> list[Stretch]:
        """The parts of the window in which the line has to be printed, or not to be."""
        last_ps = seen.end_ps if self.to is None else min(self.to, seen.end_ps)
        cut = (
            Stretch(max(one.begin_ps + self.settle, self.from_), min(one.end_ps, last_ps), one.holds)
            for one in self.when.stretches(seen)
            if one.holds is not None
        )
        return [one for one in cut if one.begin_ps < one.end_ps]

    def _longest_silence(self, stretches: list[Stretch], lines: list[PrintedLine]) -> tuple[int, int] | None:
        """(length, begin) of the longest time without the line while the condition holds; None if short."""
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

    def _missing(self, seen: Seen, silence: tuple[int, int], lines: list[PrintedLine]) -> Miss:
        length_ps, since_ps = silence
        where = f"none for {seconds(length_ps)} from {seconds(since_ps)} on"
        value = self.when.value_text(seen, since_ps + length_ps // 2)
        count = f"; {len(lines)} in all" if lines else "; never printed"
        return Miss("missing", self.wording(), f"{where}{value}{count}", for_good=True)

    def _is_it(self, line: PrintedLine, seen: Seen) -> bool:
        if self.text is not None:
            return same_banner(line.text) == same_banner(self.text.strip())
        return self.pattern is not None and self.pattern.found_in(line.text, seen.patience)

    def _line(self) -> str:
        if self.text is not None:
            return f"the line {shown_line(self.text.strip())}"
        return f'a match of "{visible(self.pattern.text if self.pattern else "")}"'
