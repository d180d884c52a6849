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

from fcu_emulator.emulator.grading.roster import Student
from fcu_emulator.emulator.grading.rubric import is_shipped
from fcu_emulator.emulator.grading.verdict import ExerciseTitle, Verdict
from fcu_emulator.emulator.system_words import command_line

Status: TypeAlias = Literal["judged", "partly", "unjudged", "rejected", "missing"]
"""Everything is judged; some checks could not be; none could be, through no fault of the program; what was
handed in is nothing that can be judged; nothing was handed in. Only the first has points that count."""


class _Part(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, populate_by_name=True)


class Graded(_Part):
    """One student. ``verdict`` is None unless something was judged, and is kept here without evidence.

    ``reason``: why it is not judged, or not wholly. ``report``: the name of the student's files, without
    suffix. ``on_roster``: False for a submission of whom the roster does not have.
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
    on_roster: bool = True
    verdict: Verdict | None = None

    @property
    def points(self) -> float | None:
        """The points, where they count; never a zero for what was not judged."""
        return self.verdict.points if self.verdict is not None and self.status == "judged" else None

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
        """Name and id, as far as they are known."""
        return f"{self.name} ({self.id})" if self.name and self.name != self.id else self.id


class GradedClass(_Part):
    """``grade.json``."""

    schema_: Literal[1] = Field(default=1, alias="schema")
    rubric: str
    rubric_title: str
    rubric_digest: str
    version: str
    max_points: float
    exercises: tuple[ExerciseTitle, ...]
    anonymous: bool = False
    submissions: tuple[Graded, ...]

    def of(self, *statuses: Status) -> list[Graded]:
        """The submissions with one of these statuses, in order."""
        return [one for one in self.submissions if one.status in statuses]

    @property
    def not_judged(self) -> list[Graded]:
        """The list of its own: of whom there is no grade yet, and why."""
        return [one for one in self.submissions if one.status != "judged"]

    def to_json(self) -> str:
        """The file's text."""
        return self.model_dump_json(indent=1, by_alias=True) + "\n"

    @classmethod
    def from_json(cls, text: str | bytes) -> GradedClass:
        """What :meth:`to_json` has written. Raises ValueError for anything else."""
        return cls.model_validate_json(text)


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
