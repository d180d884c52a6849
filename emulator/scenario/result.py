"""Results of expectations and of runs: one type for the log, for JSON and for the page.

Decision: the result of an expectation and that of a rubric's check
(:class:`fcu_emulator.emulator.grading.verdict.CheckResult`) are two types. A check sums up several
expectations, and adds points, a hint, and the part that a student may see.
"""

from __future__ import annotations

import warnings
from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Any, Literal, TypeAlias

from fcu_emulator.emulator.scenario.fields import Table

Fault: TypeAlias = Literal["missing", "wrong value", "wrong format", "stopped"]
"""Missing; present with another value; present in another form; not evaluated because the run ended too soon."""


@dataclass(frozen=True)
class ExpectationResult:
    """Result of one expectation at a moment of a run.

    ``key`` is the place in the file, such as ``expect[2]``, and ``kind`` the kind of the expectation.
    """

    expected: str
    """The expectation; for a failure, the part of it that is not met."""
    fault: Fault | None = None
    """None: the expectation is met."""
    seen: str = ""
    diff: tuple[str, ...] = ()
    """Lines in the style of a unified diff: "-" expected, "+" printed, " " around them."""
    is_final: bool = False
    """Whether no later output or LED state can change the result, so it is reported during the run."""
    mistake: str = ""
    """Details beyond ``fault``: for a LED "never lit", "one side", "late" and so on."""
    says: str = ""
    """The whole expectation in words."""
    key: str = ""
    kind: str = ""

    @property
    def state(self) -> Literal["open", "met", "failed"]:
        if not self.is_final:
            return "open"
        return "failed" if self.fault else "met"

    @property
    def reason(self) -> str:
        """Return the mistake, or the fault without a known mistake; it selects a rubric's hint."""
        return self.mistake or self.fault or ""

    @property
    def summary(self) -> str:
        """Return the failure in one line; "" if the expectation is met."""
        return f"expected {self.expected}; seen: {self.seen}" if self.fault else ""

    @property
    def lines(self) -> list[str]:
        """Return the failure for people; no lines if the expectation is met."""
        head = [f"{self.fault}: {self.summary}"] if self.fault else []
        return [*head, *(f"    {line}" for line in self.diff)]

    def to_dict(self) -> dict[str, Any]:
        """Return the failure for ``fcu run --json``."""
        names = ("key", "kind", "fault", "expected", "seen")
        return {**{name: getattr(self, name) for name in names}, "diff": list(self.diff)}

    @property
    def miss(self) -> ExpectationResult:
        """Return the finding itself: the previous release had a separate object with the failure."""
        warnings.warn("finding.miss is now the finding; leave out .miss", DeprecationWarning, stacklevel=2)
        return self

    def __str__(self) -> str:
        return "\n".join(self.lines)


class Expected(Table, ABC):
    """Base class of an entry of ``expect``: schema and evaluation in one class."""

    def watch(self, board: Any) -> Any:
        """Start watching at power-on, for expectations that observe the run; the result is kept in the run view."""
        del board
        return None

    @abstractmethod
    def describe(self) -> str:
        """Describe the expectation for results and for the page."""

    def met(self) -> ExpectationResult:
        return ExpectationResult(self.describe())

    def failed(
        self,
        fault: Fault,
        seen: str,
        diff: tuple[str, ...] = (),
        *,
        expected: str = "",
        final: bool = False,
        mistake: str = "",
    ) -> ExpectationResult:
        """Return a failure; ``expected``: the part that is not met, without it the whole expectation."""
        return ExpectationResult(expected or self.describe(), fault, seen, diff, final, mistake)


@dataclass(frozen=True)
class Result:
    """Result of a run: one result for each expectation; ``reports`` are texts for people."""

    expectations: tuple[ExpectationResult, ...]
    reports: tuple[str, ...] = ()
    early_end: ExpectationResult | None = None
    """Set if the run ended before the end of its scenario."""

    @property
    def checks(self) -> int:
        return len(self.expectations)

    @property
    def findings(self) -> tuple[ExpectationResult, ...]:
        """Return the early end and the failed expectations."""
        failed = (one for one in self.expectations if one.fault)
        return tuple(failed) if self.early_end is None else (self.early_end, *failed)

    @property
    def passed(self) -> bool:
        """Whether the run came to its end and met every expectation."""
        return not self.findings

    @property
    def judged(self) -> bool:
        """Whether every expectation could be evaluated: the run came to its end, no search took too long."""
        return all(finding.fault != "stopped" for finding in self.findings)

    @property
    def failed_count(self) -> int:
        """Number of failed expectations; a stopped run does not count as one."""
        return sum(finding.fault != "stopped" for finding in self.findings)

    @property
    def passed_count(self) -> int:
        return self.checks - self.failed_count

    @property
    def lines(self) -> list[str]:
        """Return the whole result for people: reports, findings, and the count last."""
        found = [line for finding in self.findings for line in finding.lines]
        return [*self.reports, *found, f"{self.passed_count} of {self.checks} expectations met"]
