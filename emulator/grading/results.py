"""What grading a class has found: a line for each student, and the whole; as ``grade.json``.

``grade.json`` is versioned (``schema``): the number grows when a key changes its meaning or goes; new keys
may come at any time. The evidence of each judgement (terminal, plots, diagnosis) lies beside it, in
``students/NAME.json``, as :class:`fcu_emulator.emulator.grading.verdict.Verdict` writes it.
"""

from __future__ import annotations

import hashlib
import hmac
import re
from typing import Literal, TypeAlias

from pydantic import BaseModel, ConfigDict, Field

from fcu_emulator.emulator.grading.late import after_penalty
from fcu_emulator.emulator.grading.roster import Student
from fcu_emulator.emulator.grading.rubric import is_shipped
from fcu_emulator.emulator.grading.verdict import ExerciseTitle, Verdict
from fcu_emulator.emulator.host.install_hints import command_line
from fcu_emulator.emulator.text import visible

Status: TypeAlias = Literal["judged", "partly", "unjudged", "rejected", "missing"]
"""Everything is judged; some checks could not be; none could be, through no fault of the program; what was
handed in is nothing that can be judged; nothing was handed in. Only the first has points that count."""


class _ResultModel(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, populate_by_name=True)


TOTAL = "total"
"""What an override of all points is of."""
LATE_PENALTY = "late penalty"
"""What an override of the points that are lost for handing in late is of."""


class Override(_ResultModel):
    """Points that the teacher gives: of a check, an exercise or everything (:data:`TOTAL`).

    Of :data:`LATE_PENALTY`, points that the teacher takes off.
    """

    what: str
    points: float
    comment: str = ""


class Graded(_ResultModel):
    """One student. ``verdict`` is None unless something was judged, and is kept here without evidence.

    ``reason``: why it is not judged, or not wholly. ``report``: the name of the student's files, without
    suffix. ``on_roster``: whether the roster has the student; None without a roster. ``files``: the
    names of what was handed in; none in anonymous reports, so ``handed_in`` counts them. ``submitted``: ISO
    8601, in local time, as the platform or the file says. ``late``: after the deadline, or so the platform
    says; ``late_by_s``: None if it is not known by how much. ``late_penalty``: by the rubric, in points, or as
    the teacher gives it; :attr:`lost_by_lateness` is what it has cost. ``shipped``: "template" or "solution" if it is
    that of fcu. ``same_source``, ``same_program``: the ids of students who have handed in the same.
    """

    id: str
    name: str = ""
    email: str = ""
    status: Status
    reason: str = ""
    seed: int | None = None
    firmware: str = ""
    build_log: str = ""
    report: str
    on_roster: bool | None = None
    files: tuple[str, ...] = ()
    handed_in: int = 0
    note: str = ""
    submitted: str = ""
    late: bool = False
    late_by_s: int | None = None
    late_penalty: float = 0.0
    program_digest: str = ""
    source_digest: str = ""
    shipped: str = ""
    same_source: tuple[str, ...] = ()
    same_program: tuple[str, ...] = ()
    overrides: tuple[Override, ...] = ()
    verdict: Verdict | None = None

    @property
    def points(self) -> float | None:
        """The points, where they count; never a zero for what was not judged."""
        if (total := self._given(TOTAL)) is not None:
            return total
        earned = self._earned
        return None if earned is None else after_penalty(earned, self.late_penalty)

    @property
    def lost_by_lateness(self) -> float:
        """The points that the late penalty has cost; 0 if the teacher has given the total."""
        if self._given(TOTAL) is not None or self._earned is None:
            return 0.0
        return round(self._earned - after_penalty(self._earned, self.late_penalty), 4)

    @property
    def _earned(self) -> float | None:
        """The points before the late penalty."""
        if self.verdict is None or self.status != "judged":
            return None
        points = (self.points_of(one.exercise) for one in self.verdict.exercises)
        return round(sum(one for one in points if one is not None), 4)

    def points_of(self, exercise: str) -> float | None:
        """Return the points of an exercise; None if it was not judged, or not wholly."""
        given = self._given(exercise)
        return given if given is not None or self.verdict is None else self.verdict.points_of(exercise)

    def _given(self, what: str) -> float | None:
        return next((one.points for one in self.overrides if one.what == what), None)

    @property
    def late_by(self) -> str:
        """How late it is, in words: "3 d 4 h", "late" if that is not known; "" for in time."""
        if not self.late:
            return ""
        return duration_text(self.late_by_s) if self.late_by_s is not None else "late"

    @property
    def late_words(self) -> str:
        """How late it is and the points that it costs: "1 d 2 h: 2 points less"; "" for in time."""
        if self._given(TOTAL) is None and (self._given(LATE_PENALTY) is not None or self.late_penalty):
            less = f"{self.late_penalty:g} {'point' if self.late_penalty == 1 else 'points'} less"
            return f"{self.late_by}: {less}" if self.late else less
        return self.late_by

    @property
    def copies(self) -> str:
        """What is identical with what was handed in, in words; "" for nothing."""
        if self.shipped:
            return f"is the {self.shipped} that comes with fcu"
        said = []
        if self.same_source:
            said.append(f"same source as {_ids(self.same_source)}")
        if self.same_program:
            said.append(f"same program as {_ids(self.same_program)}")
        return "; ".join(said)

    @property
    def again(self) -> str:
        """The command that judges the same again; "" where the rubric is the teacher's alone."""
        verdict = self.verdict
        if verdict is None or verdict.seed is None or not is_shipped(verdict.rubric, verdict.rubric_digest):
            return ""
        options = ["--rubric", verdict.rubric, "--seed", str(verdict.seed), "--save", "motions"]
        return command_line(["fcu", "check", self.firmware, *options])

    @property
    def shown_name(self) -> str:
        """Name and id on one line, as far as they are known."""
        return visible(f"{self.name} ({self.id})" if self.name and self.name != self.id else self.id)


class GradedClass(_ResultModel):
    """``grade.json``."""

    schema_: Literal[1] = Field(default=1, alias="schema")
    rubric: str
    rubric_title: str
    rubric_digest: str
    version: str
    max_points: float
    exercises: tuple[ExerciseTitle, ...]
    anonymous: bool = False
    handed_in: int = 0
    """How many files and folders were handed in; one of a team counts once."""
    submissions: tuple[Graded, ...]

    def of(self, *statuses: Status) -> list[Graded]:
        """The submissions with one of these statuses, in order."""
        return [one for one in self.submissions if one.status in statuses]

    @property
    def not_judged(self) -> list[Graded]:
        """The list of its own: of whom there is no grade yet, and why."""
        return [one for one in self.submissions if one.status != "judged" and one.points is None]

    def to_json(self) -> str:
        """Return the text of the file."""
        return self.model_dump_json(indent=1, by_alias=True) + "\n"

    @classmethod
    def from_json(cls, text: str | bytes) -> GradedClass:
        """What :meth:`to_json` has written. Raises ValueError for anything else."""
        return cls.model_validate_json(text)


def _ids(ids: tuple[str, ...]) -> str:
    return ", ".join(map(visible, ids))


def duration_text(seconds: int) -> str:
    """Return how late something is: 3 d 4 h 5 min."""
    minutes = -(-seconds // 60)
    days, hours, minutes = minutes // 1440, minutes // 60 % 24, minutes % 60
    parts = ((days, "d"), (hours, "h"), (minutes, "min"))
    return " ".join(f"{count} {unit}" for count, unit in parts if count) or "0 min"


def report_name(student: str) -> str:
    """A file name made of an id: the same on every system, and another one for every other id."""
    plain = re.sub(r"[^A-Za-z0-9_-]+", "-", student).strip("-")[:60]
    if plain == student and plain.islower() | plain.isdigit():
        return plain
    return f"{plain or 'student'}-{hashlib.sha256(student.encode('utf-8', 'surrogatepass')).hexdigest()[:8]}"


def pseudonym(student: Student, key: bytes) -> Student:
    """The student without name and email, under an id that says nothing to those without ``key``."""
    digest = hmac.new(key, student.id.encode("utf-8", "surrogatepass"), hashlib.sha256).hexdigest()
    return Student(f"student-{digest[:10]}")
