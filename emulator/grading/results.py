"""Results of grading a class, as ``grade.json``.

The number ``schema`` increases when a key is removed or changes its meaning.
"""

from __future__ import annotations

import hashlib
import hmac
import re
from typing import Literal, TypeAlias

from pydantic import Field

from fcu_emulator.emulator.grading.late import after_penalty
from fcu_emulator.emulator.grading.roster import Student
from fcu_emulator.emulator.grading.rubric import is_shipped
from fcu_emulator.emulator.grading.verdict import ExerciseTitle, ResultModel, Verdict
from fcu_emulator.emulator.host.install_hints import command_line
from fcu_emulator.emulator.text import visible

Status: TypeAlias = Literal["judged", "partly", "unjudged", "rejected", "missing"]
"""Status of a submission. Only the points of "judged" count.

partly: some checks could not be judged. unjudged: no check could be judged. The program is not
the cause in either case. rejected: the submission itself cannot be judged.
"""


TOTAL = "total"
""":attr:`Override.what` for all points."""
LATE_PENALTY = "late penalty"
""":attr:`Override.what` for the late penalty."""


class Override(ResultModel):
    """Points that the teacher gives, or deducts for :data:`LATE_PENALTY`."""

    what: str
    points: float
    comment: str = ""


class Graded(ResultModel):
    """Result of one student, without evidence.

    ``report``: file name without suffix. ``on_roster``: whether the roster has the student; None
    without a roster. ``files``: names of the files; empty in anonymous reports. ``handed_in``: the
    number of files. ``submitted``: ISO 8601, local time.
    ``late_by_s``: None if unknown. ``late_penalty``: in points. ``shipped``: "template" or
    "solution" if the program comes with fcu. ``same_source``, ``same_program``: ids of identical
    submissions.
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
        """Return the points that count, or None if the submission is not fully judged."""
        if (total := self._given(TOTAL)) is not None:
            return total
        earned = self._earned
        return None if earned is None else after_penalty(earned, self.late_penalty)

    @property
    def lost_by_lateness(self) -> float:
        """Return the deducted points, or 0 if the teacher has given the total."""
        if self._given(TOTAL) is not None or self._earned is None:
            return 0.0
        return round(self._earned - after_penalty(self._earned, self.late_penalty), 4)

    @property
    def _earned(self) -> float | None:
        if self.verdict is None or self.status != "judged":
            return None
        points = (self.points_of(one.exercise) for one in self.verdict.exercises)
        return round(sum(one for one in points if one is not None), 4)

    def points_of(self, exercise: str) -> float | None:
        """Return the exercise's points, or None if the exercise is not fully judged."""
        given = self._given(exercise)
        return given if given is not None or self.verdict is None else self.verdict.points_of(exercise)

    def _given(self, what: str) -> float | None:
        return next((one.points for one in self.overrides if one.what == what), None)

    @property
    def late_by(self) -> str:
        """Describe the delay: "3 d 4 h", "late" if the delay is not known exactly, or "" without a delay."""
        if not self.late:
            return ""
        return duration_text(self.late_by_s) if self.late_by_s is not None else "late"

    @property
    def late_words(self) -> str:
        """Describe delay and penalty: "1 d 2 h: 2 points less"."""
        if self._given(TOTAL) is None and (self._given(LATE_PENALTY) is not None or self.late_penalty):
            less = f"{self.late_penalty:g} {'point' if self.late_penalty == 1 else 'points'} less"
            return f"{self.late_by}: {less}" if self.late else less
        return self.late_by

    @property
    def copies(self) -> str:
        """Describe identical submissions and programs, or ""."""
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
        """Return the command that judges this submission again, or ""."""
        verdict = self.verdict
        if verdict is None or verdict.seed is None or not is_shipped(verdict.rubric, verdict.rubric_digest):
            return ""
        options = ["--rubric", verdict.rubric, "--seed", str(verdict.seed), "--save", "motions"]
        return command_line(["fcu", "check", self.firmware, *options])

    @property
    def shown_name(self) -> str:
        return visible(f"{self.name} ({self.id})" if self.name and self.name != self.id else self.id)


class GradedClass(ResultModel):
    """The contents of ``grade.json``."""

    schema_: Literal[1] = Field(default=1, alias="schema")
    rubric: str
    rubric_title: str
    rubric_digest: str
    version: str
    max_points: float
    exercises: tuple[ExerciseTitle, ...]
    anonymous: bool = False
    handed_in: int = 0
    """Number of submitted files and folders. Submissions of a team count one time."""
    submissions: tuple[Graded, ...]

    def of(self, *statuses: Status) -> list[Graded]:
        return [one for one in self.submissions if one.status in statuses]

    @property
    def not_judged(self) -> list[Graded]:
        return [one for one in self.submissions if one.status != "judged" and one.points is None]

    def to_json(self) -> str:
        return self.model_dump_json(indent=1, by_alias=True) + "\n"

    @classmethod
    def from_json(cls, text: str | bytes) -> GradedClass:
        return cls.model_validate_json(text)


def _ids(ids: tuple[str, ...]) -> str:
    return ", ".join(map(visible, ids))


def duration_text(seconds: int) -> str:
    """Return a delay as text: 3 d 4 h 5 min."""
    minutes = -(-seconds // 60)
    days, hours, minutes = minutes // 1440, minutes // 60 % 24, minutes % 60
    parts = ((days, "d"), (hours, "h"), (minutes, "min"))
    return " ".join(f"{count} {unit}" for count, unit in parts if count) or "0 min"


def report_name(student: str) -> str:
    """Return a file name for an id. It is unique and valid on every system."""
    plain = re.sub(r"[^A-Za-z0-9_-]+", "-", student).strip("-")[:60]
    if plain == student and plain.islower() | plain.isdigit():
        return plain
    return f"{plain or 'student'}-{hashlib.sha256(student.encode('utf-8', 'surrogatepass')).hexdigest()[:8]}"


def pseudonym(student: Student, key: bytes) -> Student:
    """Return an anonymous student. The id can be found only with ``key``."""
    digest = hmac.new(key, student.id.encode("utf-8", "surrogatepass"), hashlib.sha256).hexdigest()
    return Student(f"student-{digest[:10]}")
