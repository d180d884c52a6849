"""What a run's checks found, for people and for programs."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

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
