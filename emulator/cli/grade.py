"""``fcu grade``: a class is judged by a rubric; with ``--gradescope`` one submission, as its autograder."""

from __future__ import annotations

import json
import os
import secrets
import sys
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager, suppress
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from time import monotonic
from typing import TYPE_CHECKING

import click

from fcu_emulator.emulator.boards.fcu001v1 import FCU001V1
from fcu_emulator.emulator.cli.exit_codes import ExitCode
from fcu_emulator.emulator.cli.signals import Terminated
from fcu_emulator.emulator.errors import FcuError, InputError
from fcu_emulator.emulator.files import secret, write_atomically
from fcu_emulator.emulator.grading.build import Builder
from fcu_emulator.emulator.grading.grading import Grader
from fcu_emulator.emulator.grading.reports.class_page import summary
from fcu_emulator.emulator.grading.reports.machine import gradescope_results
from fcu_emulator.emulator.grading.reports.writer import Reports
from fcu_emulator.emulator.grading.results import Graded, GradedClass, pseudonym
from fcu_emulator.emulator.grading.roster import Student, load_roster
from fcu_emulator.emulator.grading.rubric import Rubric, load_rubric
from fcu_emulator.emulator.grading.store import Store
from fcu_emulator.emulator.grading.submissions import Submission, Take, find_submissions
from fcu_emulator.emulator.grading.tasks import code_digest, use_temporary_folder
from fcu_emulator.emulator.grading.verdict import ExerciseTitle
from fcu_emulator.emulator.grading.workers import DaskWorkers, LocalWorkers
from fcu_emulator.emulator.isolation import Limits
from fcu_emulator.emulator.text import csv_text, one_line

if TYPE_CHECKING:
    from click._termui_impl import ProgressBar

_OF_A_WORKER = Limits(memory_bytes=1 << 30, cpu_s=1800, file_bytes=256 << 20)
"""LAB3's rubric takes some ten seconds of processor time and 150 MB."""
_MOST_LISTED = 20
_TENTHS = 10
_LINES_APART_S, _LONGEST_SILENCE_S = 10.0, 120.0
_LARGEST_METADATA = 1 << 20


@dataclass(frozen=True)
class GradeOptions:
    """The arguments of ``fcu grade`` as typed. ``autograder``: Gradescope's folder, or None for a class."""

    submissions: Path | None
    rubric: str
    out: Path | None = None
    roster: Path | None = None
    salt: Path | None = None
    jobs: int | None = None
    dask: str | None = None
    take: Take | None = None
    bus: str = FCU001V1.profile().bus
    build_without_sandbox: bool = False
    anonymous: bool = False
    before_due_date: bool = False
    autograder: Path | None = None


def grade(options: GradeOptions) -> ExitCode:
    """Grade as asked. Raises FcuError."""
    if options.autograder is not None:
        return _grade_for_gradescope(options, options.autograder)
    if options.submissions is None or options.out is None:
        raise InputError("give the folder with the submissions, and the folder for the reports: --out DIR")
    rubric = load_rubric(options.rubric)
    roster = load_roster(options.roster) if options.roster is not None else None
    for note in roster.notes if roster else ():
        _say(note)
    found: dict[str, Graded] = {}
    try:
        with TemporaryDirectory(prefix="fcu-class-", ignore_cleanup_errors=True) as scratch:
            submissions = find_submissions(options.submissions, roster, Path(scratch))
            whole = _graded_class(options, options.out, rubric, submissions, found)
    except (KeyboardInterrupt, Terminated):
        _say(f"interrupted; {len(found)} submissions are done and kept, the same command continues there")
        return ExitCode.INTERRUPTED
    return _conclude(whole, options.out)


def _graded_class(
    options: GradeOptions,
    out: Path,
    rubric: Rubric,
    submissions: list[Submission],
    found: dict[str, Graded],
) -> GradedClass:
    """``found`` is filled as submissions are done, by their students' ids."""
    reports = Reports(out, rubric.title, after_due_date=not options.before_due_date)
    shown = _pseudonyms(out / "kept", submissions) if options.anonymous else None
    salt = secret(options.salt or out / "kept" / "salt.key")
    with (
        _grader(options, rubric, salt, out / "kept", shown) as grader,
        closing(grader.grade(submissions)) as finished,
        _progress(len(submissions)) as advance,
    ):
        for submission, graded in finished:
            found[submission.student.id] = _reported(reports, graded)
            advance(graded)
    lines = [found[submission.student.id] for submission in submissions]
    if options.anonymous:
        lines.sort(key=lambda one: one.id)  # the roster's order would say who is who
    whole = GradedClass(
        rubric=rubric.name,
        rubric_title=rubric.title,
        rubric_digest=rubric.digest,
        version=code_digest(),
        max_points=rubric.max_points,
        exercises=tuple(ExerciseTitle(exercise=one.id, title=one.title) for one in rubric.exercises),
        anonymous=options.anonymous,
        submissions=tuple(lines),
    )
    reports.whole(whole)
    return whole


def _reported(reports: Reports, graded: Graded) -> Graded:
    """Write one student's report; a report that cannot be composed costs only this submission."""
    try:
        return reports.student(graded)
    except FcuError:  # a full disk, which ends the class: no report can be written any more
        raise
    except Exception as error:
        reason = f"its report cannot be composed, please report this: {type(error).__name__}: {error}"
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
    """Workers and everything else; closed at the end."""
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
            take=options.take,
            limits=_OF_A_WORKER if options.dask is None else None,
            shown=(lambda student: shown[student.id]) if shown is not None else (lambda student: student),
        )
        with closing(grader):
            yield grader


@contextmanager
def _workers(options: GradeOptions) -> Iterator[LocalWorkers | DaskWorkers]:
    """The workers; those of this machine leave no temporary files, even if they are killed."""
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
    """Return the students that the reports show instead, by id; a table for the teacher says who is who."""
    key = secret(kept / "pseudonym.key")
    students = {one.student.id: one.student for one in submissions}
    shown = {name: pseudonym(student, key) for name, student in students.items()}
    rows = [(shown[name].id, name, one_line(student.name)) for name, student in students.items()]
    write_atomically(kept / "who-is-who.csv", csv_text([("pseudonym", "id", "name"), *rows]))
    return shown


@contextmanager
def _progress(length: int) -> Iterator[Callable[[Graded], None]]:
    """A bar on stderr; a line now and then where that is no terminal, as in a log of CI."""
    if sys.stderr is None or not sys.stderr.isatty():
        yield _ProgressLines(length).advance
        return
    bar: ProgressBar[Graded | None]
    with click.progressbar(
        length=length, label="fcu: judging", file=sys.stderr, item_show_func=_progress_name
    ) as bar:
        yield lambda graded: bar.update(1, graded)


class _ProgressLines:
    """A line at each tenth of a class and after two minutes without one, never two within ten seconds.

    What a log is read for is that something goes on, and how far it is; a line for each student would bury
    everything else.
    """

    def __init__(self, length: int) -> None:
        self._length = length
        self._done = self._told = 0
        self._began_s = self._told_s = monotonic()

    def advance(self, graded: Graded) -> None:
        """One more is done; the last one is told by the summary."""
        del graded
        self._done += 1
        now_s = monotonic()
        silent_s = now_s - self._told_s
        tenths = [_TENTHS * count // self._length for count in (self._told, self._done)]
        due = tenths[1] > tenths[0] or silent_s >= _LONGEST_SILENCE_S
        if due and silent_s >= _LINES_APART_S and self._done < self._length:
            self._told, self._told_s = self._done, now_s
            _say(f"{self._done} of {self._length} submissions done after {now_s - self._began_s:.0f} s")


def _progress_name(graded: Graded | None) -> str | None:
    return None if graded is None else one_line(graded.shown_name, 30)


def _conclude(whole: GradedClass, out: Path) -> ExitCode:
    """Say how it went; the exit code is about the grading, not about the programs."""
    for line in summary(whole):
        click.echo(line)
    for one in whole.not_judged[:_MOST_LISTED]:
        click.echo(f"  {one_line(one.shown_name, 60)}: {one.reason}")
    if len(whole.not_judged) > _MOST_LISTED:
        click.echo(f"  and {len(whole.not_judged) - _MOST_LISTED} more")
    click.echo(f"reports: {out / 'index.html'}")
    again = whole.of("unjudged", "partly")
    if again:
        _say(f"{len(again)} could not be judged, through no fault of theirs; run the same command again")
    return ExitCode.NOT_JUDGED if again else ExitCode.HELD


def _say(line: str) -> None:
    with suppress(OSError):
        click.echo(f"fcu: {line}", err=True)


# -- Gradescope ---------------------------------------------------------------------------------------------


def _grade_for_gradescope(options: GradeOptions, autograder: Path) -> ExitCode:
    """The submission in ``autograder``/submission, judged into ``autograder``/results/results.json."""
    rubric = load_rubric(options.rubric)
    folder = autograder / "submission"
    if not folder.is_dir():
        raise InputError(
            f"{folder} is no folder; --gradescope runs where Gradescope has laid out its folders"
        )
    submission = Submission(_submitter(autograder / "submission_metadata.json"), folder)
    salt = secret(options.salt) if options.salt is not None else secrets.token_bytes(32)
    with _grader(options, rubric, salt) as grader:
        _, graded = next(grader.grade([submission]))
    file = autograder / "results" / "results.json"
    write_atomically(file, json.dumps(gradescope_results(graded), indent=1) + "\n")
    points = "rejected" if graded.points is None else f"{graded.points:g} of {rubric.max_points:g} points"
    click.echo(f"{file}: {points}")
    return ExitCode.HELD


def _submitter(metadata: Path) -> Student:
    """Whom Gradescope names; of a group the one with the lowest id, so that the board stays the same."""
    try:
        with metadata.open("rb") as file:
            table = json.loads(file.read(_LARGEST_METADATA))
        users = [user for user in table["users"] if isinstance(user, dict)]
        first = min(users, key=lambda user: str(user["id"]))
        return Student(str(first["id"]), str(first.get("name") or ""), str(first.get("email") or ""))
    except (OSError, ValueError, KeyError, TypeError, RecursionError):
        return Student("gradescope")
