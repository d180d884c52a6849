"""What a run's checks found, for people and for programs; and a printed number against the truth."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Literal

from emulator.scenario.observed import ANGLES, FORMAT_OF_FIELD, MOVING_G, PrintedLine, nearest_truth
from emulator.time.clock import PS_PER_S

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


@dataclass(frozen=True)
class Finding:
    """A failed expectation: ``key`` is its place in the file, such as ``expect[2]``."""

    key: str
    kind: str
    miss: Miss

    @property
    def lines(self) -> list[str]:
        """For people."""
        miss = self.miss
        head = f"{self.key} ({self.kind}): {miss.fault}: expected {miss.expected}; seen: {miss.seen}"
        return [head, *(f"    {line}" for line in miss.diff)]

    def __str__(self) -> str:
        return "\n".join(self.lines)


Standing = Literal["open", "met", "failed"]


@dataclass(frozen=True)
class Verdict:
    """An expectation while the run is on: place, kind, what it says, how it stands, what was seen."""

    key: str
    kind: str
    says: str
    state: Standing
    found: str = ""


@dataclass(frozen=True)
class Result:
    """A run judged: ``checks`` is how many expectations there are, ``reports`` what to tell."""

    checks: int
    findings: tuple[Finding, ...]
    reports: tuple[str, ...] = ()

    @property
    def passed(self) -> bool:
        """Whether the run came to its end and met every expectation."""
        return not self.findings

    @property
    def judged(self) -> bool:
        """Whether every expectation could be looked at: the run came to its end, no search took too long."""
        return all(finding.miss.fault != "stopped" for finding in self.findings)

    @property
    def failed_count(self) -> int:
        """How many expectations are not met; a run that was stopped is none of them."""
        return sum(finding.miss.fault != "stopped" for finding in self.findings)

    @property
    def passed_count(self) -> int:
        """How many expectations are met."""
        return self.checks - self.failed_count

    @property
    def lines(self) -> list[str]:
        """The whole result for people: reports, findings, and the count last."""
        found = [line for finding in self.findings for line in finding.lines]
        return [*self.reports, *found, f"{self.passed_count} of {self.checks} expectations met"]


# -- Reports for people -------------------------------------------------------------------------------------


_MOST_ROWS = 12
_STILL_G = 0.05


def against_truth(field: str, lines: Sequence[PrintedLine], settle_ps: int, window: str = "") -> list[str]:
    """A table of prints: time, printed, truth at that time, error (printed - truth); then a summary.

    ``window``: which part of the run the lines are of, for the title.

    Decision: the error is that at the moment of printing, which shows how old a number of a moving board is;
    where the nearest truth of the time ``settle_ps`` before, by which expectations judge, gives another
    largest error, a line says so. One definition for both would hide the delay, or blame a filter for it.
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
    for index in _chosen(len(rows)):
        t_s, printed, truth, error, flag = rows[index]
        table.append(f"{t_s:>7.3f} s {printed:>12.3f} {truth:>12.3f} {error:>+12.3f}{flag}")
    count = "1 print" if len(rows) == 1 else f"{len(rows)} prints"
    first, last, largest = rows[0][3], rows[-1][3], _largest(row[3] for row in rows)
    table.append(f"error: first {first:+.3f}, last {last:+.3f}, largest {largest:+.3f}, {count}")
    counted = f"{_largest(judged):+.3f}"
    if counted != f"{largest:+.3f}":
        which = nearest_truth(settle_ps)
        table.append(f"against the truth as expectations take it, {which}: largest {counted}")
    return table


def _largest(errors: Iterable[float]) -> float:
    """The error that is farthest from 0; of what is no number, none."""
    return max(filter(math.isfinite, errors), key=abs, default=math.nan)


def _flag(field: str, line: PrintedLine) -> str:
    """An accelerometer shows the tilt of a board that nothing but gravity accelerates.

    The slides ("eCompass math") look at the modulus, which is all that firmware has; it hides what acts to
    the side: 0.36 g turn the vertical by 20 degrees and make the modulus 1.06 g. Here the motion is known.
    """
    if field not in ANGLES:
        return ""
    moving_g = float(line.truth[MOVING_G][1][-1])
    return "" if moving_g <= _STILL_G else f"   accelerated by {moving_g:.2f} g: no tilt sensor now"


def _chosen(count: int) -> list[int]:
    """Indices of at most a dozen rows, evenly spaced, the first and the last among them."""
    if count <= _MOST_ROWS:
        return list(range(count))
    return [index * (count - 1) // (_MOST_ROWS - 1) for index in range(_MOST_ROWS)]
