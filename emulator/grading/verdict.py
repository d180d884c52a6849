"""Verdict on a program, check by check, with evidence.

With the same firmware, rubric, seed and version, a verdict has the same bytes on every machine.

Decision: the outcome "unjudged" is separate, and points of unjudged checks are excluded from the
sum, so that a check that could not be evaluated does not count as zero.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable
from typing import Literal, TypeAlias

from pydantic import BaseModel, ConfigDict, Field

SCHEMA = 1

Outcome: TypeAlias = Literal["passed", "partial", "failed", "unjudged"]
Visibility: TypeAlias = Literal["always", "after_due_date", "never"]
Detail: TypeAlias = Literal["full", "actual", "name", "none"]


class ResultModel(BaseModel):
    """Base class: instances are frozen, and unknown keys are refused."""

    model_config = ConfigDict(extra="forbid", frozen=True, populate_by_name=True)


class CheckResult(ResultModel):
    """Result of one check of a rubric.

    ``check``: unique name ("3.pitch"). ``expected`` and ``actual``: sentences. ``printed``: the
    first wrong line, quoted, with its time. ``source``: the statement that prints the line or
    switches the LED. ``finding``: kind of failure, for hints. ``fault``: the general kind.
    ``detail``: how much a student sees: everything; everything except the expected value; title and outcome;
    or only the outcome.
    """

    check: str
    exercise: str
    title: str
    points: float
    max_points: float
    outcome: Outcome
    expected: str = ""
    actual: str = ""
    printed: str = ""
    source: str = ""
    finding: str = ""
    fault: str = ""
    hint: str = ""
    visibility: Visibility = "always"
    detail: Detail = "full"
    unjudged_because: str = ""
    requires_unmet: tuple[str, ...] = ()
    """Required checks that have not passed, so that this check has no points."""


def requires_text(unmet: Iterable[tuple[str, str]]) -> str:
    """Return a text that names the required checks, given as (name, title)."""
    return _without(f'"{title}" ({name})' for name, title in unmet)


def _without(names: Iterable[str]) -> str:
    return f"no points without {', '.join(names)}, which this check requires"


class Series(ResultModel):
    """Samples of a printed number and the truth, at most :data:`MOST_PRINTS`. None: not a number."""

    name: str
    unit: str
    t_s: tuple[float, ...]
    printed: tuple[float | None, ...]
    truth: tuple[float, ...]


class Following(ResultModel):
    """Periods in s in which a condition was true, and periods in which its LED was lit or its line was printed."""

    name: str
    condition: str
    wanted: tuple[tuple[float, float], ...]
    shown: tuple[tuple[float, float], ...]


class DiagnosedCause(ResultModel):
    """One diagnosis: a line with its place, and sentences."""

    kind: str
    summary: str
    details: tuple[str, ...] = ()
    fatal: bool = False
    data: dict[str, str] = Field(default_factory=dict)
    """Values in the summary by name, for use by programs."""


class RunEvidence(ResultModel):
    """Evidence of one run.

    ``terminal``: the beginning and end of the output as Latin-1, not escaped. ``stopped``: reason
    for an early end. ``replay``: the scenario with drawn numbers as TOML, or "".
    """

    run: str
    question: str
    exercises: tuple[str, ...]
    duration_s: float
    terminal: str
    series: tuple[Series, ...] = ()
    following: tuple[Following, ...] = ()
    causes: tuple[DiagnosedCause, ...] = ()
    ticks: int = 0
    ticks_late: int = 0
    ticks_lost: int = 0
    timer_hz: float | None = None
    stopped: str = ""
    replay: str = ""


class ExerciseTitle(ResultModel):
    """Title of a judged exercise."""

    exercise: str
    title: str


MOST_PRINTS = 200  # entries of a series
MOST_TERMINAL = 8_000  # characters of a run: half from its beginning, half from its end


class Verdict(ResultModel):
    """Verdict on a program by a rubric."""

    schema_: Literal[1] = 1
    rubric: str
    rubric_title: str
    rubric_digest: str
    firmware_digest: str
    seed: int | None
    """Seed of the board. None in anonymous reports, because the seed depends on the student's id."""
    version: str
    exercises: tuple[ExerciseTitle, ...]
    checks: tuple[CheckResult, ...]
    evidence: tuple[RunEvidence, ...] = ()
    hidden_checks: int = 0
    """Checks that :meth:`for_student` has omitted."""

    @property
    def points(self) -> float:
        return _sum(check.points for check in self.checks)

    @property
    def max_points(self) -> float:
        return _sum(check.max_points for check in self.checks if check.outcome != "unjudged")

    @property
    def unjudged_points(self) -> float:
        return _sum(check.max_points for check in self.checks if check.outcome == "unjudged")

    @property
    def unjudged(self) -> tuple[CheckResult, ...]:
        return tuple(check for check in self.checks if check.outcome == "unjudged")

    @property
    def counts(self) -> bool:
        """Whether all points of the verdict could be judged."""
        return not any(check.max_points for check in self.unjudged)

    def points_of(self, exercise: str) -> float | None:
        """Return the exercise's points, or None if the exercise is not fully judged."""
        checks = self.of(exercise)
        if not checks or any(check.outcome == "unjudged" and check.max_points for check in checks):
            return None
        return _sum(check.points for check in checks)

    def of(self, exercise: str) -> tuple[CheckResult, ...]:
        return tuple(check for check in self.checks if check.exercise == exercise)

    def is_done(self, exercise: str) -> bool:
        """Return whether all checks with points have passed."""
        counted = [check for check in self.of(exercise) if check.max_points > 0]
        return bool(counted) and all(check.outcome == "passed" for check in counted)

    def evidence_of(self, exercise: str) -> tuple[RunEvidence, ...]:
        return tuple(one for one in self.evidence if exercise in one.exercises)

    def for_student(self, after_due_date: bool = False) -> Verdict:
        """Return the visible checks with the allowed detail. Omit truth and scenario of partly hidden runs."""
        shown = {"always", "after_due_date"} if after_due_date else {"always"}
        unnamed = {one.check for one in self.checks if one.visibility not in shown or one.detail == "none"}
        visible = tuple(_for_student(check, unnamed) for check in self.checks if check.visibility in shown)
        secret = {check.exercise for check in self.checks if not _is_open(check, shown)}
        evidence = (
            one.model_copy(update={"series": (), "following": (), "replay": ""})
            if secret & set(one.exercises)
            else one
            for one in self.evidence
            if any(check.exercise in one.exercises and check.detail != "none" for check in visible)
        )
        changed = {
            "checks": visible,
            "evidence": tuple(evidence),
            "hidden_checks": self.hidden_checks + len(self.checks) - len(visible),
        }
        return self.model_copy(update=changed)

    def without_seed(self) -> Verdict:
        """Return the verdict without data that identifies the board."""
        evidence = tuple(one.model_copy(update={"replay": ""}) for one in self.evidence)
        return self.model_copy(update={"seed": None, "evidence": evidence})

    def allowed(self) -> tuple[CheckResult, ...]:
        """Return all checks, each with the detail that students may see."""
        unnamed = {one.check for one in self.checks if one.visibility != "always" or one.detail == "none"}
        return tuple(_for_student(check, unnamed) for check in self.checks)

    def to_json(self) -> str:
        return self.model_dump_json(indent=1) + "\n"

    @classmethod
    def from_json(cls, text: str | bytes) -> Verdict:
        return cls.model_validate_json(text)


def _is_open(check: CheckResult, shown: set[str]) -> bool:
    return check.visibility in shown and check.detail == "full"


def _for_student(check: CheckResult, unnamed: Collection[str] = ()) -> CheckResult:
    """Return the visible part of a result. ``unnamed``: checks that must not be named."""
    if any(one in unnamed for one in check.requires_unmet):
        actual = _without(["a hidden check"])
        check = check.model_copy(update={"actual": actual, "requires_unmet": ()})
    if check.detail == "full":
        return check
    hidden: dict[str, object] = {"expected": "", "actual": check.printed or check.actual}
    if check.detail in ("name", "none"):
        hidden |= {
            "actual": "",
            "printed": "",
            "source": "",
            "finding": "",
            "fault": "",
            "hint": "",
            "requires_unmet": (),
        }
    if check.detail == "none":
        hidden |= {"title": "a hidden check"}
    return check.model_copy(update=hidden)


def _sum(points: Iterable[float]) -> float:
    """Return the sum without binary rounding errors."""
    return round(sum(points), 4)
