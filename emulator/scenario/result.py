"""Results of expectations and of runs.

Decision: an expectation and a rubric's check
(:class:`fcu_emulator.emulator.grading.verdict.CheckResult`) have different types of result, because
a check combines several expectations and adds points and a hint.
"""

from __future__ import annotations

import warnings
from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Any, Literal, TypeAlias

from fcu_emulator.emulator.scenario.fields import Table

Fault: TypeAlias = Literal["missing", "wrong value", "wrong format", "stopped"]
"""Kind of failure. "stopped": not evaluated, because the run ended too early or a search took too long."""


@dataclass(frozen=True)
class ExpectationResult:
    """Result of one expectation at a moment. ``key``: place of the expectation in the file (``expect[2]``)."""

    expected: str
    """The expectation, or only the unmet part."""
    fault: Fault | None = None
    seen: str = ""
    diff: tuple[str, ...] = ()
    """Unified diff: "-" expected, "+" printed, " " context."""
    is_final: bool = False
    """Whether later output cannot change the result. Such failures are reported during the run."""
    mistake: str = ""
    """Kind of mistake, if known: for a LED "never lit", "one side", "late" and so on."""
    says: str = ""
    """The whole expectation in words."""
    source: str = ""
    """Place of the firmware's statement that prints the line or switches the LED, if known."""
    key: str = ""
    kind: str = ""

    @property
    def state(self) -> Literal["open", "met", "failed"]:
        if not self.is_final:
            return "open"
        return "failed" if self.fault else "met"

    @property
    def reason(self) -> str:
        """Return the mistake, or else the fault. This text selects the hint."""
        return self.mistake or self.fault or ""

    @property
    def summary(self) -> str:
        """Return the failure in one line, or ""."""
        return f"expected {self.expected}; seen: {self.seen}" if self.fault else ""

    @property
    def lines(self) -> list[str]:
        """Return the lines that describe a failure to the user."""
        head = [f"{self.fault}: {self.summary}"] if self.fault else []
        source = [f"    line: {self.source}"] if self.source else []
        return [*head, *(f"    {line}" for line in self.diff), *source]

    def to_dict(self) -> dict[str, Any]:
        names = ("key", "kind", "fault", "expected", "seen", "source")
        return {**{name: getattr(self, name) for name in names}, "diff": list(self.diff)}

    @property
    def miss(self) -> ExpectationResult:
        """Return the finding itself, for programs that use the API of the previous release."""
        warnings.warn(
            "the attributes of finding.miss are now in finding itself; leave out .miss",
            DeprecationWarning,
            stacklevel=2,
        )
        return self

    def __str__(self) -> str:
        return "\n".join(self.lines)


class Expected(Table, ABC):
    """Schema and evaluation of an entry of ``expect``."""

    def watch(self, board: Any) -> Any:
        """Start to observe the board at power-on. The result is stored in the run view."""
        del board
        return None

    @abstractmethod
    def describe(self) -> str:
        """Describe the expectation for results."""

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
        """Return a failure. ``expected``: the part of the expectation that is not met."""
        return ExpectationResult(expected or self.describe(), fault, seen, diff, final, mistake)


@dataclass(frozen=True)
class Result:
    """One result for each expectation. ``reports`` are texts for the user."""

    expectations: tuple[ExpectationResult, ...]
    reports: tuple[str, ...] = ()
    early_end: ExpectationResult | None = None
    """A failure, if the run ended before the scenario's end."""

    @property
    def checks(self) -> int:
        return len(self.expectations)

    @property
    def findings(self) -> tuple[ExpectationResult, ...]:
        """Return the early end and failed expectations."""
        failed = (one for one in self.expectations if one.fault)
        return tuple(failed) if self.early_end is None else (self.early_end, *failed)

    @property
    def passed(self) -> bool:
        """Whether the run ended normally and met every expectation."""
        return not self.findings

    @property
    def judged(self) -> bool:
        """Whether every expectation could be evaluated."""
        return all(finding.fault != "stopped" for finding in self.findings)

    @property
    def failed_count(self) -> int:
        """Number of failed expectations. An early end is not counted."""
        return sum(one.fault not in (None, "stopped") for one in self.expectations)

    @property
    def passed_count(self) -> int:
        return sum(one.fault is None for one in self.expectations)

    @property
    def lines(self) -> list[str]:
        """Return reports, findings and the count as text for the user."""
        found = [line for finding in self.findings for line in finding.lines]
        return [*self.reports, *found, f"{self.passed_count} of {self.checks} expectations met"]
