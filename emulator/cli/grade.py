"""``fcu grade``: judge a class by a rubric, or with ``--gradescope`` one submission."""

from __future__ import annotations

import json
import os
import secrets
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import closing, contextmanager
from datetime import datetime
from functools import partial
from itertools import count
from pathlib import Path
from tempfile import TemporaryDirectory
from time import monotonic
from typing import Any

import click

from fcu_emulator.emulator.cli.exit_codes import ExitCode
from fcu_emulator.emulator.cli.options import GradeOptions
from fcu_emulator.emulator.cli.screen import ProgressLine, is_terminal, paint, say, wrapped
from fcu_emulator.emulator.cli.signals import Terminated
from fcu_emulator.emulator.errors import FcuError, InputError
from fcu_emulator.emulator.grading.autograder import write_autograder
from fcu_emulator.emulator.grading.build import Builder
from fcu_emulator.emulator.grading.copies import with_copies
from fcu_emulator.emulator.grading.grading import Grader
from fcu_emulator.emulator.grading.late import late_penalty
from fcu_emulator.emulator.grading.overrides import load_overrides, with_overrides
from fcu_emulator.emulator.grading.reports.class_page import summary
from fcu_emulator.emulator.grading.reports.machine import gradescope_results
from fcu_emulator.emulator.grading.reports.writer import Reports
from fcu_emulator.emulator.grading.results import Graded, GradedClass, Override, pseudonym
from fcu_emulator.emulator.grading.roster import Student, load_roster
from fcu_emulator.emulator.grading.rubric import Rubric, load_rubric
from fcu_emulator.emulator.grading.store import Store
from fcu_emulator.emulator.grading.submissions import Submission, find_submissions
from fcu_emulator.emulator.grading.tasks import code_digest, use_temporary_folder
from fcu_emulator.emulator.grading.verdict import ExerciseTitle
from fcu_emulator.emulator.grading.workers import DaskWorkers, LocalWorkers
from fcu_emulator.emulator.host.files import secret, write_atomically
from fcu_emulator.emulator.host.isolation import WorkerLimits
from fcu_emulator.emulator.text import csv_text, one_line, visible

_OF_A_WORKER = WorkerLimits(memory_bytes=1 << 30, cpu_s=1800, file_bytes=256 << 20)
"""Limits of a worker. The LAB3 rubric takes about 6 s of processor time and 180 MB."""
_MOST_LISTED = 20
_TENTHS = 10
_LINES_APART_S, _LONGEST_SILENCE_S = 10.0, 120.0
_LARGEST_METADATA = 1 << 20


def grade(options: GradeOptions) -> ExitCode:
    """Grade a class, or one submission for Gradescope. Raises FcuError."""
    if options.gradescope:
        return _grade_for_gradescope(options, options.autograder)
    if options.gradescope_zip is not None:
        return _pack_for_gradescope(options, options.gradescope_zip)
    if options.submissions is None or options.out is None:
        raise InputError("SUBMISSIONS and --out must be given; for example: fcu grade SUBMISSIONS --out DIR")
    rubric = load_rubric(options.rubric)
    overrides = load_overrides(options.overrides, rubric) if options.overrides is not None else {}
    roster = load_roster(options.roster) if options.roster is not None else None
    for note in roster.notes if roster else ():
        say(note)
    found: dict[str, Graded] = {}
    try:
        with TemporaryDirectory(prefix="fcu-class-", ignore_cleanup_errors=True) as scratch:
            submissions = find_submissions(options.submissions, roster, Path(scratch))
            _check_known(options.overrides, overrides, submissions)
            whole = _graded_class(options, options.out, rubric, submissions, found, overrides)
    except (KeyboardInterrupt, Terminated):
        say(f"interrupted; {len(found)} submissions are done and kept; repeat the command to continue")
        return ExitCode.INTERRUPTED
    return _conclude(whole, options.out)


def _graded_class(
    options: GradeOptions,
    out: Path,
    rubric: Rubric,
    submissions: list[Submission],
    found: dict[str, Graded],
    overrides: Mapping[str, tuple[Override, ...]],
) -> GradedClass:
    """Grade the class and write reports. Add results to ``found``, keyed by id."""
    reports = Reports(out, rubric.title, after_due_date=not options.before_due_date)
    shown = _pseudonyms(out / "kept", submissions) if options.anonymous else None
    salt = secret(options.salt or out / "kept" / "salt.key")
    found |= _earlier(options.only, out, rubric, submissions, shown) if options.only is not None else {}
    todo = [one for one in submissions if one.student.id not in found]
    with (
        _grader(options, rubric, salt, out / "kept", shown) as grader,
        closing(grader.grade(todo)) as finished,
        _progress(len(todo)) as advance,
    ):
        for submission, graded in finished:
            graded = _timed(graded, submission, options, rubric)  # noqa: PLW2901
            given = overrides.get(submission.student.id.casefold(), ())
            found[submission.student.id] = _reported(
                reports, with_overrides(graded, given) if given else graded
            )
            advance(graded)
    lines = with_copies((one.path or one.student.id, found[one.student.id]) for one in submissions)
    if options.anonymous:
        lines.sort(key=lambda one: one.id)  # the order of the roster would identify students
    whole = GradedClass(
        rubric=rubric.name,
        rubric_title=rubric.title,
        rubric_digest=rubric.digest,
        version=code_digest(),
        max_points=rubric.max_points,
        exercises=tuple(ExerciseTitle(exercise=one.id, title=one.title) for one in rubric.exercises),
        anonymous=options.anonymous,
        handed_in=len({entry.path for one in submissions for entry in one.entries if entry.is_there}),
        submissions=tuple(lines),
    )
    reports.whole(whole)
    return whole


def _earlier(
    only: Path,
    out: Path,
    rubric: Rubric,
    submissions: Sequence[Submission],
    shown: Mapping[str, Student] | None,
) -> dict[str, Graded]:
    """Return earlier results of students who are not in ``only``, keyed by id. Raises InputError."""
    again = {student.id.casefold() for student in load_roster(only).students}
    _check_known(only, again, submissions)
    file = out / "grade.json"
    try:
        whole = GradedClass.from_json(file.read_bytes())
    except (OSError, ValueError) as error:
        raise InputError(f"cannot read {file}, which --only updates; grade the whole class first") from error
    if whole.rubric_digest != rubric.digest:
        raise InputError(
            f"{file}: must be the result of the same rubric; grade the whole class without --only"
        )
    earlier = {one.id: one for one in whole.submissions}
    ids = [one.student.id for one in submissions if one.student.id.casefold() not in again]
    names = {name: shown[name].id if shown is not None else name for name in ids}
    return {name: earlier[names[name]] for name in ids if names[name] in earlier}


def _check_known(file: Path | None, ids: Iterable[str], submissions: Sequence[Submission]) -> None:
    """Raise InputError for an unknown student."""
    unknown = set(ids) - {one.student.id.casefold() for one in submissions}
    if unknown:
        names = ", ".join(one_line(name, 40) for name in sorted(unknown)[:3])
        raise InputError(f"{file}: 'id' must be the id of a student of this class, not {names}")


def _timed(graded: Graded, submission: Submission, options: GradeOptions, rubric: Rubric) -> Graded:
    at, deadline = submission.submitted(), options.deadline
    late_by_s = round((at - deadline).total_seconds()) if at is not None and deadline is not None else 0
    changed = {
        "submitted": at.isoformat(timespec="seconds") if at is not None and not options.anonymous else "",
        "late": submission.is_marked_late or late_by_s > 0,
    }
    return _with_lateness(graded.model_copy(update=changed), late_by_s, rubric)


def _with_lateness(graded: Graded, late_by_s: float, rubric: Rubric) -> Graded:
    if late_by_s <= 0:
        return graded
    penalty = late_penalty(rubric.late, late_by_s, rubric.max_points) if rubric.late is not None else 0.0
    changed = {"late": True, "late_by_s": round(late_by_s), "late_penalty": penalty}
    return graded.model_copy(update=changed)


def _reported(reports: Reports, graded: Graded) -> Graded:
    """Write one report. A bug in this step affects only this submission."""
    try:
        return reports.student(graded)
    except FcuError:  # for example a full disk, which ends the grading
        raise
    except Exception as error:
        reason = f"cannot write its report, please report this bug: {type(error).__name__}: {error}"
        changed = {"status": "unjudged", "reason": one_line(reason, 400), "verdict": None, "build_log": ""}
        return reports.student(graded.model_copy(update=changed))


@contextmanager
def _grader(
    options: GradeOptions,
    rubric: Rubric,
    salt: bytes,
    kept: Path | None = None,
    shown: dict[str, Student] | None = None,
) -> Iterator[Grader]:
    with _workers(options) as workers:
        grader = Grader(
            rubric=rubric,
            rubric_name=rubric.name if options.rubric == rubric.name else str(rubric.path.resolve()),
            workers=workers,
            slots=workers.slots,
            builder=lambda: Builder(
                options.bus,
                sandbox=not options.build_without_sandbox,
                kept=kept / "builds" if kept is not None else None,
            ),
            salt=salt,
            store=Store(kept / "verdicts", rubric) if kept is not None else None,
            take=options.submission_type,
            limits=_OF_A_WORKER if options.dask is None else None,
            shown=(lambda student: shown[student.id]) if shown is not None else (lambda student: student),
        )
        with closing(grader):
            yield grader


@contextmanager
def _workers(options: GradeOptions) -> Iterator[LocalWorkers | DaskWorkers]:
    """Yield workers. Local workers leave no temporary files, even if they are killed."""
    if options.dask is not None:
        with DaskWorkers(options.dask) as cluster:
            yield cluster
        return
    with (
        TemporaryDirectory(prefix="fcu-work-", ignore_cleanup_errors=True) as folder,
        LocalWorkers(options.jobs or os.cpu_count() or 1, partial(use_temporary_folder, folder)) as workers,
    ):
        yield workers


def _pseudonyms(kept: Path, submissions: list[Submission]) -> dict[str, Student]:
    """Return pseudonyms, keyed by id, and write the table of pseudonyms for the teacher."""
    key = secret(kept / "pseudonym.key")
    students = {one.student.id: one.student for one in submissions}
    shown = {name: pseudonym(student, key) for name, student in students.items()}
    rows = [(shown[name].id, name, one_line(student.name)) for name, student in students.items()]
    write_atomically(kept / "who-is-who.csv", csv_text([("pseudonym", "id", "name"), *rows]))
    return shown


@contextmanager
def _progress(length: int) -> Iterator[Callable[[Graded], None]]:
    """Show a counter on a terminal, or else a line from time to time."""
    if not is_terminal(sys.stderr):
        yield _ProgressLines(length).advance
        return
    with ProgressLine(f"fcu: judging, 0 of {length}") as line:
        numbers = count(1)

        def advance(graded: Graded) -> None:
            line.text = f"fcu: judging, {next(numbers)} of {length}, last {one_line(graded.shown_name, 30)}"

        yield advance


class _ProgressLines:
    """Prints a line after each tenth of the class, or after two minutes; at most one line in ten seconds."""

    def __init__(self, length: int) -> None:
        self._length = length
        self._done = self._told = 0
        self._began_s = self._told_s = monotonic()

    def advance(self, graded: Graded) -> None:
        del graded
        self._done += 1
        now_s = monotonic()
        silent_s = now_s - self._told_s
        tenths = [_TENTHS * count // self._length for count in (self._told, self._done)]
        due = tenths[1] > tenths[0] or silent_s >= _LONGEST_SILENCE_S
        if due and silent_s >= _LINES_APART_S and self._done < self._length:
            self._told, self._told_s = self._done, now_s
            say(f"{self._done} of {self._length} submissions done after {now_s - self._began_s:.0f} s")


def _conclude(whole: GradedClass, out: Path) -> ExitCode:
    """Print the summary, and return an exit code that describes only the grading."""
    click.echo(paint(visible(whole.rubric_title), "heading"))
    for line in summary(whole):
        click.echo(visible(f"  {line}"))
    if whole.not_judged:
        click.echo()
        click.echo(paint("Not judged", "heading"))
    for one in whole.not_judged[:_MOST_LISTED]:
        click.echo("\n".join(wrapped(f"  {one_line(one.shown_name, 60)}: {one.reason}")))
    if len(whole.not_judged) > _MOST_LISTED:
        click.echo(f"  and {len(whole.not_judged) - _MOST_LISTED} more")
    click.echo()
    click.echo(f"{paint('Reports', 'heading')}: {visible(str(out / 'index.html'))}")
    again = whole.of("unjudged", "partly")
    if again:
        say(
            f"{len(again)} not judged, through no fault of the students; run the same command again",
            "warning",
        )
    return ExitCode.NOT_JUDGED if again else ExitCode.PASSED


# -- Gradescope ---------------------------------------------------------------------------------------------


def _grade_for_gradescope(options: GradeOptions, autograder: Path) -> ExitCode:
    rubric = load_rubric(options.rubric)
    folder = autograder / "submission"
    if not folder.is_dir():
        raise InputError(
            f"the folder {folder} must exist; use --gradescope only inside Gradescope's autograder"
        )
    submission = Submission(_submitter(autograder / "submission_metadata.json"), folder)
    salt = secret(options.salt) if options.salt is not None else secrets.token_bytes(32)
    with _grader(options, rubric, salt) as grader:
        _, graded = next(grader.grade([submission]))
    graded = _with_lateness(graded, _late_by_s(autograder / "submission_metadata.json"), rubric)
    file = autograder / "results" / "results.json"
    write_atomically(file, json.dumps(gradescope_results(graded), indent=1) + "\n")
    points = "rejected" if graded.points is None else f"{graded.points:g} of {rubric.max_points:g} points"
    click.echo(visible(f"{file}: {points}"))
    return ExitCode.PASSED


def _pack_for_gradescope(options: GradeOptions, file: Path) -> ExitCode:
    salt = secret(options.salt) if options.salt is not None else secrets.token_bytes(32)
    rubric = load_rubric(options.rubric)
    names = write_autograder(
        file, rubric, salt, wheel=options.wheel, bus=options.bus, take=options.submission_type
    )
    click.echo(f"{file}: {', '.join(names)}")
    if options.wheel is None:
        say("Gradescope will install this version of fcu-emulator from PyPI; to change that: --wheel FILE")
    return ExitCode.PASSED


def _submitter(metadata: Path) -> Student:
    """Return the student on Gradescope. In a group, return the student with the lowest id."""
    try:
        users = [user for user in _metadata(metadata)["users"] if isinstance(user, dict)]
        first = min(users, key=lambda user: str(user["id"]))
        return Student(str(first["id"]), str(first.get("name") or ""), str(first.get("email") or ""))
    except (OSError, ValueError, KeyError, TypeError, RecursionError):
        return Student("gradescope")


def _late_by_s(metadata: Path) -> float:
    """Return the delay in seconds after the latest due date in the group, or 0 if the delay is unknown."""
    try:
        table = _metadata(metadata)
        own = [user.get("assignment", {}).get("due_date") for user in table["users"]]
        due = [datetime.fromisoformat(one) for one in own if one] or [
            datetime.fromisoformat(table["assignment"]["due_date"])
        ]
        return max((datetime.fromisoformat(table["created_at"]) - max(due)).total_seconds(), 0.0)
    except (OSError, ValueError, KeyError, TypeError, AttributeError, RecursionError):
        return 0.0


def _metadata(file: Path) -> dict[str, Any]:
    """Return Gradescope's table of a submission. Raises OSError, ValueError, TypeError."""
    with file.open("rb") as source:
        table = json.loads(source.read(_LARGEST_METADATA))
    if not isinstance(table, dict):
        raise TypeError(f"{file} must have an object")
    return table
