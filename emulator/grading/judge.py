"""Evaluation of one program by a rubric, in this process.

Wall time is not limited, because the machine's load must not change a verdict.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import Executor, as_completed
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import cache, partial
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, TypeAlias

from fcu_emulator.emulator.analysis.mistakes import explain
from fcu_emulator.emulator.analysis.recorder import TruthRecorder
from fcu_emulator.emulator.analysis.source_lines import SourceLines
from fcu_emulator.emulator.assembly.board import Board
from fcu_emulator.emulator.assembly.firmware import FirmwareFactory, choose
from fcu_emulator.emulator.chip.diagnosis.report import Diagnosis
from fcu_emulator.emulator.clock import PS_PER_S, seconds, to_ps
from fcu_emulator.emulator.errors import FirmwareError, NotJudgedError
from fcu_emulator.emulator.grading.checks import AnyCheck, Check, FinishedRun, QuietCallback
from fcu_emulator.emulator.grading.explained import cause_of, explained
from fcu_emulator.emulator.grading.prerequisites import PREREQUISITE
from fcu_emulator.emulator.grading.rubric import CheckTable, ExerciseTable, Rubric, load_rubric
from fcu_emulator.emulator.grading.verdict import (
    MOST_PRINTS,
    MOST_TERMINAL,
    CheckResult,
    ExerciseTitle,
    Following,
    Outcome,
    RunEvidence,
    Series,
    Verdict,
    requires_text,
)
from fcu_emulator.emulator.scenario.expectations import (
    Expectation,
    ExpectField,
    ExpectText,
    RunView,
    Windowed,
)
from fcu_emulator.emulator.scenario.following import ExpectLineFollows
from fcu_emulator.emulator.scenario.hardware import ExpectLedFollows
from fcu_emulator.emulator.scenario.result import ExpectationResult
from fcu_emulator.emulator.scenario.run_view import unit_of
from fcu_emulator.emulator.scenario.schema import ReportTable
from fcu_emulator.emulator.scenario.toml_writer import names_files, scenario_text

if TYPE_CHECKING:
    from fcu_emulator.emulator.chip.firmware import Limits

_SLICE_S = 0.25  # virtual time between progress reports
_NO_WALL_S = 1e12
_NOT_REPLAYED = frozenset({"expect", "report", "firmware"})
"""Keys omitted from the scenario in a verdict: the rubric has the checks, the student has the firmware."""


Program: TypeAlias = str | Path | FirmwareFactory
"""Firmware: a name, a file, or a factory of Python firmware."""


@dataclass(frozen=True)
class JudgeProgress:
    """The current run, and the virtual seconds of all runs: done, and in total."""

    run: str
    done_s: float
    total_s: float


def judge(
    firmware: Program,
    rubric: Rubric,
    *,
    seed: int,
    exercises: Sequence[str] | None = None,
    build_log: str | None = None,
    progress: Callable[[JudgeProgress], None] | None = None,
    executor: Executor | None = None,
) -> Verdict:
    """Judge a firmware on the board with this ``seed``.

    ``firmware``: a file, the name of a shipped firmware, or a function in Python. ``exercises``: ids
    of the exercises to judge, or None for all. ``build_log``: without a log, checks of the
    compiler's output are unjudged.
    ``executor``: makes runs in parallel, except for firmware in Python. Raises InputError for
    invalid firmware or an unknown exercise.
    """
    wanted = [rubric.exercise(name) for name in exercises] if exercises is not None else rubric.exercises
    digest = firmware_digest(firmware)
    asked = [f"{exercise.id}.{check.id}" for exercise in wanted for check in exercise.check]
    tasks = [
        _RunTask(firmware, seed, name, tuple(checks), frozenset(asked), build_log)
        for name, checks in _runs_of(rubric, asked).items()
    ]
    follow = _Follow(rubric, tasks, progress or (lambda _progress: None))
    outcomes: Iterable[_Outcome]
    if executor is None or callable(firmware) or len(tasks) == 1:
        outcomes = _one_by_one(rubric, tasks, follow)
    else:
        outcomes = _in_parallel(executor, rubric, tasks, follow)
    results: dict[str, CheckResult] = {}
    evidence: list[RunEvidence] = []
    for outcome in outcomes:
        results |= outcome.results
        evidence += outcome.evidence
    tables = _checks_by_id(rubric)
    hints = {check_id: check.hint_for(PREREQUISITE) for check_id, (_, check) in tables.items()}
    results = rubric.prerequisites.applied(results, hints)
    return Verdict(
        rubric=rubric.name,
        rubric_title=rubric.title,
        rubric_digest=rubric.digest,
        firmware_digest=digest,
        seed=seed,
        version=version("fcu-emulator"),
        exercises=tuple(ExerciseTitle(exercise=each.id, title=each.title) for each in wanted),
        checks=tuple(results[check_id] for check_id in asked),
        evidence=tuple(explained(evidence, firmware, rubric, results, _limits(rubric))),
    )


def _runs_of(rubric: Rubric, asked: Sequence[str]) -> dict[str, list[str]]:
    """Return the runs that these checks and their prerequisites need, with the checks of each run."""
    tables = _checks_by_id(rubric)
    needed = rubric.prerequisites.needed(asked)
    checks: dict[str, list[str]] = {}
    for check_id in (*asked, *(one for one in tables if one in needed and one not in asked)):
        checks.setdefault(rubric.run_of(*tables[check_id]), []).append(check_id)
    return checks


def _checks_by_id(rubric: Rubric) -> dict[str, tuple[ExerciseTable, CheckTable]]:
    return {f"{one.id}.{check.id}": (one, check) for one in rubric.exercises for check in one.check}


# -- runs, one by one or in parallel ------------------------------------------------------------------------


@dataclass(frozen=True)
class _RunTask:
    """A planned run and its checks. ``asked``: the checks of all requested exercises."""

    firmware: Program
    seed: int
    run: str
    checks: tuple[str, ...]
    asked: frozenset[str]
    build_log: str | None


@dataclass(frozen=True)
class _Outcome:
    """Results by check. ``evidence`` is empty if no check of the run is requested."""

    results: dict[str, CheckResult]
    evidence: list[RunEvidence]


class _Follow:
    """Reporter of progress. A run in another process reports only its end; the ends come in any order."""

    def __init__(
        self, rubric: Rubric, tasks: Sequence[_RunTask], report: Callable[[JudgeProgress], None]
    ) -> None:
        self.duration_s = {task.run: rubric.scenario(task.run, task.seed).duration_s for task in tasks}
        self._total_s = sum(self.duration_s.values())
        self._done_s = 0.0
        self._report = report

    def at(self, run: str, now_s: float) -> None:
        self._report(JudgeProgress(run, self._done_s + now_s, self._total_s))

    def end(self, run: str) -> None:
        self._done_s += self.duration_s[run]
        self.at(run, 0.0)


def _one_by_one(rubric: Rubric, tasks: Sequence[_RunTask], follow: _Follow) -> Iterator[_Outcome]:
    for task in tasks:
        yield _outcome(task, rubric, partial(follow.at, task.run))
        follow.end(task.run)


def _in_parallel(
    executor: Executor, rubric: Rubric, tasks: Sequence[_RunTask], follow: _Follow
) -> list[_Outcome]:
    """Return the outcomes in the order of the tasks. Raises NotJudgedError."""
    longest_first = sorted(tasks, key=lambda task: -follow.duration_s[task.run])
    submitted = [(task, executor.submit(_outcome_in_worker, task, rubric.file)) for task in longest_first]
    done: dict[str, _Outcome] = {}
    for task, future in reversed(submitted):
        if future.cancel():
            done[task.run] = _outcome(task, rubric, partial(follow.at, task.run))
            follow.end(task.run)
    made = {future: task.run for task, future in submitted if task.run not in done}
    for future in as_completed(made):
        done[made[future]] = future.result()
        follow.end(made[future])
    return [done[task.run] for task in tasks]


def _outcome_in_worker(task: _RunTask, rubric: str) -> _Outcome:
    return _outcome(task, _loaded(rubric), lambda _now_s: None)


@cache
def _loaded(path: str) -> Rubric:
    return load_rubric(Path(path))


def _outcome(task: _RunTask, rubric: Rubric, told: Callable[[float], None]) -> _Outcome:
    tables = _checks_by_id(rubric)
    checks = [tables[check_id][1] for check_id in task.checks]
    run = _JudgedRun(task.firmware, rubric, task.run, task.seed, checks, task.build_log)
    run.make(told)
    shown = dict.fromkeys(tables[check_id][0].id for check_id in task.checks if check_id in task.asked)
    evidence = [run.evidence(tuple(shown))] if shown else []
    return _Outcome({check_id: run.result(*tables[check_id]) for check_id in task.checks}, evidence)


def reworded(verdict: Verdict, rubric: Rubric) -> Verdict:
    """Return the verdict with the texts of ``rubric``. This rubric must have the same ``judging_digest`` as
    the verdict."""
    tables = {f"{exercise.id}.{check.id}": check for exercise in rubric.exercises for check in exercise.check}
    checks = (
        result.model_copy(
            update={
                "title": tables[result.check].title,
                "actual": _actual(result, tables),
                "hint": tables[result.check].hint_for(result.finding, result.fault) if result.finding else "",
                "visibility": tables[result.check].visible,
                "detail": tables[result.check].detail,
            }
        )
        for result in verdict.checks
    )
    titles = (
        one.model_copy(update={"title": rubric.exercise(one.exercise).title}) for one in verdict.exercises
    )
    changed = {
        "rubric": rubric.name,
        "rubric_title": rubric.title,
        "rubric_digest": rubric.digest,
        "exercises": tuple(titles),
        "checks": tuple(checks),
    }
    return verdict.model_copy(update=changed)


def _actual(result: CheckResult, tables: Mapping[str, CheckTable]) -> str:
    unmet = [(one, tables[one].title) for one in result.requires_unmet]
    return requires_text(unmet) if unmet else result.actual


def firmware_digest(firmware: Program) -> str:
    """Return the SHA-256 of the file, or of Python firmware's name and version. Raises InputError."""
    choice = choose(Board.description, firmware, None)
    if choice.image is None:
        return hashlib.sha256(f"{choice.name} {version('fcu-emulator')}".encode()).hexdigest()
    return hashlib.sha256(Path(choice.image.path).read_bytes()).hexdigest()


def _limits(rubric: Rubric) -> Limits:
    from fcu_emulator.emulator.chip.firmware import Limits

    limits = rubric.limits
    return Limits(
        instructions=limits.instructions,
        terminal_bytes=limits.terminal_bytes,
        work_per_s=limits.work_per_s,
        resets_per_s=limits.resets_per_s,
        wall_s=_NO_WALL_S,
    )


@dataclass
class _JudgedRun:
    firmware: Program
    rubric: Rubric
    name: str
    seed: int
    checks: list[CheckTable]
    build_log: str | None
    stopped: str = ""
    unjudged: str = ""
    diagnoses: list[Diagnosis] = field(default_factory=list)

    def __post_init__(self) -> None:
        scenario = self.rubric.scenario(self.name, self.seed)
        expectations = [one for check in self.checks for one in check.expect if isinstance(one, Expectation)]
        compared = [one for one in expectations if isinstance(one, ExpectField) and one.truth]
        self.numbers: dict[str, ExpectField] = {}
        for one in compared:
            self.numbers.setdefault(one.title, one)
        self.fields = tuple(dict.fromkeys(one.name for one in compared if one.name is not None))
        reports = [ReportTable.model_validate({"field": name, "against": "truth"}) for name in self.fields]
        self.scenario = scenario.asking(expectations, reports)
        self.duration_s = scenario.duration_s
        self.board = Board(self.firmware, scenario=self.scenario, seed=self.seed)
        self._watched = {
            id(one): one.watch(self.board)
            for check in self.checks
            for one in check.expect
            if isinstance(one, Check)
        }
        self.recorder = TruthRecorder(self.board)

    def make(self, told: Callable[[float], None]) -> None:
        board = self.board
        if board.chip is not None:
            board.chip.limits = _limits(self.rubric)
        end_ps = self.scenario.duration_ps
        try:
            while board.clock.now_ps < end_ps:
                told(board.now_s)
                board.run_until_ps(min(board.clock.now_ps + to_ps(_SLICE_S), end_ps))
        except FirmwareError as error:
            self.stopped = str(error).splitlines()[0]
        except NotJudgedError as error:
            self.unjudged = str(error).splitlines()[0]
        self.diagnoses = explain(board, self.recorder, after_failure=True)
        self.view: RunView = self.scenario.run_view(board)
        self.died_ps = self._died_ps()
        board.close()

    def _died_ps(self) -> int | None:
        """Return the time at which the program crashed, hung or was stopped, or None."""
        if self.stopped:
            return self.board.clock.now_ps
        fatal = next((one for one in self.diagnoses if one.fatal), None)
        if fatal is None:
            return None
        return (
            fatal.at_ps if fatal.at_ps is not None else max((one.at_ps for one in self.view.lines), default=0)
        )

    def result(self, exercise: ExerciseTable, check: CheckTable) -> CheckResult:
        outcome: Outcome = "passed"
        share, unjudged = 1.0, self.unjudged
        results: list[ExpectationResult] = []
        for one in check.expect:
            try:
                results.append(self._evaluated(one, check.enough))
            except NotJudgedError as error:
                unjudged = unjudged or str(error).splitlines()[0]
        failed = [one for one in results if one.fault]
        if failed and not check.partial and not self.unjudged:
            unjudged = ""  # one failed expectation is enough to fail the check
        if unjudged:
            outcome, share, failed = "unjudged", 0.0, []
        elif failed:
            share = 1 - len(failed) / len(results) if check.partial else 0.0
            outcome = "partial" if share else "failed"
        first = failed[0] if failed else None
        return CheckResult(
            check=f"{exercise.id}.{check.id}",
            exercise=exercise.id,
            title=check.title,
            points=round(share * check.points, 4),
            max_points=check.points,
            outcome=outcome,
            expected=_expected(failed, check),
            actual=first.seen if first else "",
            printed=next(filter(None, map(_first_printed, failed)), ""),
            source=self._source(check, results),
            finding=first.reason if first else "",
            fault=(first.fault or "") if first else "",
            hint=check.hint_for(first.reason, first.fault or "") if first else "",
            visibility=check.visible,
            detail=check.detail,
            unjudged_because=unjudged,
        )

    def _source(self, check: CheckTable, results: Sequence[ExpectationResult]) -> str:
        """Return the first known statement that causes a failure, or ""."""
        if not any(one.fault for one in results):
            return ""
        lines = SourceLines(self.recorder)
        failed = (one for one, result in zip(check.expect, results, strict=False) if result.fault)
        found = (lines.callback() if isinstance(one, QuietCallback) else lines.line(one) for one in failed)
        return next(filter(None, found), "")

    def _evaluated(self, check: AnyCheck, enough_ps: int | None) -> ExpectationResult:
        """Return one result. Raises NotJudgedError, also for a bug in the check."""
        enough = self.died_ps is None or (enough_ps is not None and self.died_ps >= enough_ps)
        on_terminal = isinstance(check, Expectation) and check.ON_TERMINAL
        if not enough and (self.stopped or on_terminal):
            expected = f"a run of {seconds(self.scenario.duration_ps)}"
            return check.failed("stopped", self._stop(), expected=expected)
        if enough and enough_ps is not None and on_terminal:
            check = self._seen_before_the_end(check, enough_ps)
        try:
            return self._evaluated_here(check, enough)
        except NotJudgedError:
            raise
        except Exception as error:
            said = next(iter(str(error).splitlines()), "")
            raise NotJudgedError(f"the check {check.kind} failed: {type(error).__name__}: {said}") from error

    def _seen_before_the_end(self, check: AnyCheck, enough_ps: int) -> AnyCheck:
        if self.died_ps is None or not isinstance(check, Windowed):
            return check
        begun = any(check.covers(line.at_ps) and line.at_ps < self.died_ps for line in self.view.lines)
        return check if begun else check.model_copy(update={"from_": enough_ps})

    def _evaluated_here(self, check: AnyCheck, enough: bool) -> ExpectationResult:
        if isinstance(check, Check):
            run = FinishedRun(
                firmware=self.firmware,
                board=self.board,
                view=self.view,
                recorder=self.recorder,
                diagnoses=tuple(one for one in self.diagnoses if not (one.fatal and enough)),
                build_log=self.build_log,
                watched=self._watched[id(check)],
            )
            return check.evaluate(run)
        view = self.view
        if self.died_ps is not None and check.ON_TERMINAL:
            view = replace(view, end_ps=min(view.end_ps, self.died_ps))
        result = check.result(view)
        if result.fault == "stopped":
            raise NotJudgedError(result.seen)
        return result

    def _stop(self) -> str:
        if self.stopped:
            return f"ended at {self.board.now_s:.3f} s: {self.stopped}"
        fatal = next(one for one in self.diagnoses if one.fatal)
        return f"the program ran until {seconds(self.died_ps or 0)}: {fatal.summary}"

    def _shown_diagnoses(self) -> list[Diagnosis]:
        fatal = [one for one in self.diagnoses if one.fatal]
        return fatal[:1] or self.diagnoses

    def evidence(self, exercises: tuple[str, ...]) -> RunEvidence:
        timer = self.board.timer
        return RunEvidence(
            run=self.name,
            question=self.scenario.question,
            exercises=exercises,
            duration_s=self.duration_s,
            terminal=_shortened(self.board.terminal.text),
            series=tuple(map(self._series, self.numbers.values())),
            following=self._following(),
            causes=tuple(cause_of(one) for one in self._shown_diagnoses()),
            ticks=timer.ticks,
            ticks_late=timer.late,
            ticks_lost=timer.lost,
            timer_hz=timer.rate_hz if timer.ticks else None,
            stopped=self._stop() if self.stopped else "",
            replay=self._replay(),
        )

    def _following(self) -> tuple[Following, ...]:
        expected = (one for check in self.checks for one in check.expect)
        kinds = (ExpectLedFollows, ExpectLineFollows)
        followed = []
        for one in expected:
            if isinstance(one, kinds):
                with suppress(TimeoutError):  # the check itself reports it
                    followed.append(one.followed(self.view))
        return tuple(
            Following(
                name=one.name, condition=one.condition, wanted=_in_s(one.wanted), shown=_in_s(one.shown)
            )
            for one in {(each.name, each.condition): each for each in followed}.values()
        )

    def _replay(self) -> str:
        if names_files(self.scenario.contents.timeline):
            return ""  # only the author of the scenario has these files
        expected = [one for check in self.checks for one in check.expect]
        known = [one for one in expected if isinstance(one, Expectation) and not isinstance(one, ExpectText)]
        others = dict.fromkeys(one.kind for one in expected if one not in known)
        table = {key: value for key, value in self.scenario.table.items() if key not in _NOT_REPLAYED}
        as_in_a_file = (one.model_dump(mode="json", by_alias=True, exclude_unset=True) for one in known)
        table |= {"seed": self.seed, "expect": [{"kind": one.pop("kind"), **one} for one in as_in_a_file]}
        table |= {"report": [{"field": name, "against": "truth"} for name in self.fields]}
        comment = f"# {self.rubric.name}, run {self.name}, board {self.seed}\n"
        if others:
            comment += f"# The rubric also checks, outside of the scenario: {', '.join(others)}\n"
        return comment + scenario_text({key: value for key, value in table.items() if value != []})

    def _series(self, number: ExpectField) -> Series:
        line_format = number.number_format()
        points = []
        with suppress(TimeoutError):  # the check itself reports it
            for line in self.view.lines:
                if line_format.is_begun_by(line.text) and number.quantity in line.truth:
                    value = line_format.number(line.text)
                    printed = None if value is None or value - value != 0 else value
                    truth = number.scale * float(line.truth[number.quantity][1][-1])
                    points.append((line.at_ps / PS_PER_S, printed, truth))
        step = max(1, -(-len(points) // MOST_PRINTS))
        kept = points[::step]
        return Series(
            name=number.title,
            unit=unit_of(number.name) if number.name else "",
            t_s=tuple(one[0] for one in kept),
            printed=tuple(one[1] for one in kept),
            truth=tuple(one[2] for one in kept),
        )


def _in_s(spans: Sequence[tuple[int, int]]) -> tuple[tuple[float, float], ...]:
    return tuple((begin / PS_PER_S, end / PS_PER_S) for begin, end in spans[:MOST_PRINTS])


def _first_printed(failure: ExpectationResult) -> str:
    line = next((line[1:] for line in failure.diff if line.startswith("+")), "")
    text, _, when = line.rpartition("  at ")
    when = when.partition("  (")[0]
    return f'"{text}" at {when}' if text else f'"{when}"' if when else ""


def _expected(failed: Sequence[ExpectationResult], check: CheckTable) -> str:
    texts = list(dict.fromkeys(one.expected for one in failed))
    if check.partial and len(texts) > 1:
        share = f"{check.points / len(check.expect):g} of {check.points:g} points"
        return f"{texts[0]}; to get {share}: {'; '.join(texts[1:])}"
    if failed and failed[0].fault == "missing":
        return texts[0]  # other expectations about missing lines give no information
    return "; also not met: ".join(texts)


def _shortened(text: str) -> str:
    if len(text) <= MOST_TERMINAL:
        return text
    half = MOST_TERMINAL // 2
    return f"{text[:half]}\n[... {len(text) - 2 * half} characters omitted ...]\n{text[-half:]}"
