"""Verdict on a program, check by check, with evidence for the reader; as JSON and back.

A verdict holds all data; :meth:`Verdict.for_student` returns the part that the student may see. It has no
wall time and no paths: the same firmware, rubric, seed and version give the same bytes on every machine.

Decision: the outcome "unjudged" is separate, and its points are excluded from the sum (``unjudged_points``).
So a program never gets a zero for a check that was not evaluated.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable
from typing import Literal, TypeAlias

from pydantic import BaseModel, ConfigDict

SCHEMA = 1

Outcome: TypeAlias = Literal["passed", "partial", "failed", "unjudged"]
Visibility: TypeAlias = Literal["always", "after_due_date", "never"]
Detail: TypeAlias = Literal["full", "actual", "name", "none"]


class ResultModel(BaseModel):
    """Base class: frozen, strict, and without unknown keys."""

    model_config = ConfigDict(extra="forbid", frozen=True, populate_by_name=True)


class CheckResult(ResultModel):
    """Result of one check of a rubric.

    ``check`` is unique in the rubric ("3.pitch"). ``expected`` and ``actual`` are sentences for people, empty
    if the check passed. ``printed``: the first wrong line of the terminal, in quotes with its time; control
    characters as escapes. ``finding``: the kind of failure by which rubrics choose a hint, such as "missing"
    or "one side", and ``fault`` its general kind; both "" if it passed. ``detail``: the part that a student
    sees: everything, all but the expected value, only title and outcome, or not even the title.
    ``unjudged_because``: why the check could not be evaluated; empty for every other outcome.
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
    finding: str = ""
    fault: str = ""
    hint: str = ""
    visibility: Visibility = "always"
    detail: Detail = "full"
    unjudged_because: str = ""
    requires_unmet: tuple[str, ...] = ()
    """The required checks that have not passed, if this check has no points because of them."""


def requires_text(unmet: Iterable[tuple[str, str]]) -> str:
    """Say that a check earns nothing because of the checks (name, title) that it requires."""
    return _without(f'"{title}" ({name})' for name, title in unmet)


def _without(names: Iterable[str]) -> str:
    return f"no points without {', '.join(names)}, which this check requires"


class Series(ResultModel):
    """A printed number against the truth. All lists have one entry for each print; None: not a number.

    ``unit``: of ``printed`` and ``truth``. At most :data:`MOST_PRINTS` entries, evenly selected.
    """

    name: str
    unit: str
    t_s: tuple[float, ...]
    printed: tuple[float | None, ...]
    truth: tuple[float, ...]


class Following(ResultModel):
    """Input of a plot of a LED or line that must follow a condition: periods of the condition, and of LED or line.

    Times in s, from and until; for a printed line both are the begin of printing. At most :data:`MOST_PRINTS`
    of each.
    """

    name: str
    condition: str
    wanted: tuple[tuple[float, float], ...]
    shown: tuple[tuple[float, float], ...]


class DiagnosedCause(ResultModel):
    """One diagnosis: a line with function and source line if they are known, and sentences."""

    kind: str
    summary: str
    details: tuple[str, ...] = ()
    fatal: bool = False


class RunEvidence(ResultModel):
    """Evidence of one run of the board, which several exercises may use.

    ``terminal``: begin and end of the output, decoded as Latin-1, with raw control characters: the viewer
    must escape them. ``stopped``: reason for an early end of the run, or "". ``replay``: the scenario as TOML
    for ``fcu run --scenario``, with the numbers drawn from the seed. A student sees it only if all checks of
    the run are shown (otherwise ``for_student`` empties it). It is empty for a run that plays files of the
    rubric's author.
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
    """Title of a judged exercise, in the rubric's order."""

    exercise: str
    title: str


MOST_PRINTS = 200  # limit of entries in a series
MOST_TERMINAL = 8_000  # limit for a run's text: its first and last characters


class Verdict(ResultModel):
    """Verdict on a program by a rubric."""

    schema_: Literal[1] = 1
    rubric: str
    rubric_title: str
    rubric_digest: str
    firmware_digest: str
    seed: int | None
    """Seed of the board; None in anonymous reports, because it is derived from the student's id."""
    version: str
    """Version of the emulator."""
    exercises: tuple[ExerciseTitle, ...]
    checks: tuple[CheckResult, ...]
    evidence: tuple[RunEvidence, ...] = ()
    hidden_checks: int = 0
    """Number of checks that :meth:`for_student` has omitted."""

    @property
    def points(self) -> float:
        return _sum(check.points for check in self.checks)

    @property
    def max_points(self) -> float:
        """Return the maximum points of all judged checks."""
        return _sum(check.max_points for check in self.checks if check.outcome != "unjudged")

    @property
    def unjudged_points(self) -> float:
        """Return the points of the checks that could not be judged."""
        return _sum(check.max_points for check in self.checks if check.outcome == "unjudged")

    @property
    def unjudged(self) -> tuple[CheckResult, ...]:
        """Return the checks that could not be judged."""
        return tuple(check for check in self.checks if check.outcome == "unjudged")

    @property
    def counts(self) -> bool:
        """Whether everything that gives points could be judged, so that :attr:`points` is a grade."""
        return not any(check.max_points for check in self.unjudged)

    def points_of(self, exercise: str) -> float | None:
        """Return the points of an exercise; None if it was not fully judged."""
        checks = self.of(exercise)
        if not checks or any(check.outcome == "unjudged" and check.max_points for check in checks):
            return None
        return _sum(check.points for check in checks)

    def of(self, exercise: str) -> tuple[CheckResult, ...]:
        """Return the checks of one exercise."""
        return tuple(check for check in self.checks if check.exercise == exercise)

    def is_done(self, exercise: str) -> bool:
        """Return whether every check of an exercise that gives points has passed; False if it has none."""
        counted = [check for check in self.of(exercise) if check.max_points > 0]
        return bool(counted) and all(check.outcome == "passed" for check in counted)

    def evidence_of(self, exercise: str) -> tuple[RunEvidence, ...]:
        """Return the evidence of the runs by which an exercise was judged."""
        return tuple(one for one in self.evidence if exercise in one.exercises)

    def for_student(self, after_due_date: bool = False) -> Verdict:
        """Return the student's part: no hidden checks, and of the rest only the detail that the rubric allows.

        A run with a hidden part shows no truth, no replay and no scenario.
        """
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
        """Return the verdict without data that identifies the board, and so the student: for anonymous reports."""
        evidence = tuple(one.model_copy(update={"replay": ""}) for one in self.evidence)
        return self.model_copy(update={"seed": None, "evidence": evidence})

    def allowed(self) -> tuple[CheckResult, ...]:
        """Return all checks with the maximum detail for a student who may see them."""
        unnamed = {one.check for one in self.checks if one.visibility != "always" or one.detail == "none"}
        return tuple(_for_student(check, unnamed) for check in self.checks)

    def to_json(self) -> str:
        """Return the verdict as JSON on several lines."""
        return self.model_dump_json(indent=1) + "\n"

    @classmethod
    def from_json(cls, text: str | bytes) -> Verdict:
        """Read the text of :meth:`to_json`. Raises ValueError for any other text."""
        return cls.model_validate_json(text)


def _is_open(check: CheckResult, shown: set[str]) -> bool:
    return check.visibility in shown and check.detail == "full"


def _for_student(check: CheckResult, unnamed: Collection[str] = ()) -> CheckResult:
    """Return the part of a check that a student may see; ``unnamed``: the checks that must not be named."""
    if any(one in unnamed for one in check.requires_unmet):
        actual = _without(["a hidden check"])
        check = check.model_copy(update={"actual": actual, "requires_unmet": ()})
    if check.detail == "full":
        return check
    hidden: dict[str, object] = {"expected": "", "actual": check.printed or check.actual}
    if check.detail in ("name", "none"):
        hidden |= {"actual": "", "printed": "", "finding": "", "fault": "", "hint": "", "requires_unmet": ()}
    if check.detail == "none":
        hidden |= {"title": "a hidden check"}
    return check.model_copy(update=hidden)


def _sum(points: Iterable[float]) -> float:
    """Return the sum, rounded to the rubric's precision, so that tenths add up."""
    return round(sum(points), 4)
