"""What a judged program got, check by check, with what a reader needs to understand it; as JSON and back.

A verdict holds everything; :meth:`Verdict.for_student` is what may be shown, and leaves out the rest. It has
no wall time and no paths: the same firmware, rubric, seed and version give the same bytes on every machine.

Decision: what could not be judged is an outcome of its own and takes its points out of the sum, in
``unjudged_points``: a program is never given a zero for what nobody looked at.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable
from typing import Literal, TypeAlias

from pydantic import BaseModel, ConfigDict

SCHEMA = 1

Outcome: TypeAlias = Literal["passed", "partial", "failed", "unjudged"]
Visibility: TypeAlias = Literal["always", "after_due_date", "never"]
Detail: TypeAlias = Literal["full", "actual", "name", "none"]


class _VerdictModel(BaseModel):
    """Frozen, strict, and without unknown keys."""

    model_config = ConfigDict(extra="forbid", frozen=True)


class CheckResult(_VerdictModel):
    """One check of a rubric.

    ``check`` is unique in the rubric ("3.pitch"). ``expected`` and ``actual`` are sentences for people, empty
    where the check passed. ``printed``: the first line of the terminal that is wrong, in quotes, and when;
    control characters as escapes. ``finding``: how it is not met, in a word or two by which rubrics choose a
    hint, such as "missing" or "one side", and ``fault`` the general kind of it; both "" if it passed.
    ``detail`` says how much of it a student sees:
    everything, all but what was expected, only that the check is there and its outcome, or not even its
    title. ``unjudged_because``: why nothing can be said; empty for every other outcome.
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
    """The checks that this one requires and that have not passed, if that is why it has no points."""


def requires_text(unmet: Iterable[tuple[str, str]]) -> str:
    """Say that a check earns nothing because of the checks (name, title) that it requires."""
    return _without(f'"{title}" ({name})' for name, title in unmet)


def _without(names: Iterable[str]) -> str:
    return f"no points without {', '.join(names)}, which this check requires"


class Series(_VerdictModel):
    """A printed number against the truth. All lists have one entry for each print; None: no number.

    ``unit``: of ``printed`` and ``truth``. At most :data:`MOST_PRINTS`, evenly taken from all.
    """

    name: str
    unit: str
    t_s: tuple[float, ...]
    printed: tuple[float | None, ...]
    truth: tuple[float, ...]


class Following(_VerdictModel):
    """A LED or a line that has to follow a condition: when that holds, and when it is lit or printed.

    Times in s, from and until; of a printed line both are its begin. At most :data:`MOST_PRINTS` of each.
    """

    name: str
    condition: str
    wanted: tuple[tuple[float, float], ...]
    shown: tuple[tuple[float, float], ...]


class DiagnosedCause(_VerdictModel):
    """What the diagnosis says: one line with function and source line where they are known, and sentences."""

    kind: str
    summary: str
    details: tuple[str, ...] = ()
    fatal: bool = False


class RunEvidence(_VerdictModel):
    """What one run of the board showed; several exercises may be judged by it.

    ``terminal``: begin and end of what was printed, Latin-1 decoded, control characters as they came: whoever
    shows it escapes it. ``stopped``: what ended the run before its time, or "". ``replay``: the scenario as
    TOML, with the numbers that were drawn from the seed, which ``fcu run --scenario`` plays; shown to a
    student only when all checks of the run are (``for_student`` empties it otherwise), and empty for a run
    that plays files of the rubric's author.
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


class ExerciseTitle(_VerdictModel):
    """An exercise of the rubric that was judged, in its order."""

    exercise: str
    title: str


MOST_PRINTS = 200  # of a series
MOST_TERMINAL = 8_000  # characters of a run's text: the first and the last ones


class Verdict(_VerdictModel):
    """A program judged by a rubric."""

    schema_: Literal[1] = 1
    rubric: str
    rubric_title: str
    rubric_digest: str
    firmware_digest: str
    seed: int | None
    """None in anonymous reports: it is made of the student's id."""
    version: str
    """Of the emulator."""
    exercises: tuple[ExerciseTitle, ...]
    checks: tuple[CheckResult, ...]
    evidence: tuple[RunEvidence, ...] = ()
    hidden_checks: int = 0
    """How many checks :meth:`for_student` has left out."""

    @property
    def points(self) -> float:
        return _sum(check.points for check in self.checks)

    @property
    def max_points(self) -> float:
        """What could be got, by everything that was judged."""
        return _sum(check.max_points for check in self.checks if check.outcome != "unjudged")

    @property
    def unjudged_points(self) -> float:
        """What could not be judged is worth so much."""
        return _sum(check.max_points for check in self.checks if check.outcome == "unjudged")

    @property
    def unjudged(self) -> tuple[CheckResult, ...]:
        """The checks of which nothing can be said."""
        return tuple(check for check in self.checks if check.outcome == "unjudged")

    @property
    def counts(self) -> bool:
        """Whether everything that gives points could be judged, so that :attr:`points` is a grade."""
        return not any(check.max_points for check in self.unjudged)

    def points_of(self, exercise: str) -> float | None:
        """What an exercise has got; None if it was not judged, or not wholly."""
        checks = self.of(exercise)
        if not checks or any(check.outcome == "unjudged" and check.max_points for check in checks):
            return None
        return _sum(check.points for check in checks)

    def of(self, exercise: str) -> tuple[CheckResult, ...]:
        """The checks of one exercise."""
        return tuple(check for check in self.checks if check.exercise == exercise)

    def is_done(self, exercise: str) -> bool:
        """Whether every check of an exercise that gives points has passed; False if there is none."""
        counted = [check for check in self.of(exercise) if check.max_points > 0]
        return bool(counted) and all(check.outcome == "passed" for check in counted)

    def evidence_of(self, exercise: str) -> tuple[RunEvidence, ...]:
        """The runs by which an exercise was judged."""
        return tuple(one for one in self.evidence if exercise in one.exercises)

    def for_student(self, after_due_date: bool = False) -> Verdict:
        """What may be shown: neither hidden checks, nor more of the others than the rubric allows.

        A run of which a student may not know everything shows no truth, no replay and no scenario.
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
        """Without what says which board of the class it was, and so whose: for anonymous reports."""
        evidence = tuple(one.model_copy(update={"replay": ""}) for one in self.evidence)
        return self.model_copy(update={"seed": None, "evidence": evidence})

    def allowed(self) -> tuple[CheckResult, ...]:
        """All checks, with as much detail as a student may see who is shown the check."""
        unnamed = {one.check for one in self.checks if one.visibility != "always" or one.detail == "none"}
        return tuple(_for_student(check, unnamed) for check in self.checks)

    def to_json(self) -> str:
        """As JSON, on several lines."""
        return self.model_dump_json(indent=1) + "\n"

    @classmethod
    def from_json(cls, text: str | bytes) -> Verdict:
        """What :meth:`to_json` has written. Raises ValueError for anything else."""
        return cls.model_validate_json(text)


def _is_open(check: CheckResult, shown: set[str]) -> bool:
    return check.visibility in shown and check.detail == "full"


def _for_student(check: CheckResult, unnamed: Collection[str] = ()) -> CheckResult:
    """As much of a check as a student may see; ``unnamed``: the checks that are not to be named."""
    if any(one in unnamed for one in check.requires_unmet):
        actual = _without(["a check that is not shown"])
        check = check.model_copy(update={"actual": actual, "requires_unmet": ()})
    if check.detail == "full":
        return check
    hidden: dict[str, object] = {"expected": "", "actual": check.printed or check.actual}
    if check.detail in ("name", "none"):
        hidden |= {"actual": "", "printed": "", "finding": "", "fault": "", "hint": "", "requires_unmet": ()}
    if check.detail == "none":
        hidden |= {"title": "a check that is not shown"}
    return check.model_copy(update=hidden)


def _sum(points: Iterable[float]) -> float:
    """Rounded to what a rubric can give, so that tenths add up."""
    return round(sum(points), 4)
