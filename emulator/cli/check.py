"""``fcu check``: show which exercises are done, and details of the next one.

Decision: problems that the diagnosis finds are shown before the failed checks, because the place of a problem
helps the student most. If a problem stops main() or the samples, the hints of the checks are omitted, because
they would distract the student from the problem.
"""

from __future__ import annotations

import os
import re
import shutil
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import Executor
from contextlib import contextmanager
from pathlib import Path
from typing import cast

import click

from fcu_emulator.emulator.assembly.board import Board
from fcu_emulator.emulator.assembly.firmware import choose
from fcu_emulator.emulator.chip.diagnosis.report import KEEPS_SAMPLES_AWAY
from fcu_emulator.emulator.cli.annotations import annotation_commands, commands_ignored
from fcu_emulator.emulator.cli.boards_table import BoardsTable, points_on_board
from fcu_emulator.emulator.cli.build import ELF, build_project, build_with_make
from fcu_emulator.emulator.cli.exit_codes import ExitCode
from fcu_emulator.emulator.cli.options import CheckOptions
from fcu_emulator.emulator.cli.screen import Look, ProgressLine, paint, say, wrapped
from fcu_emulator.emulator.errors import FirmwareError, InputError, LinkError, NotJudgedError, OutputError
from fcu_emulator.emulator.grading.causes import relevant_causes
from fcu_emulator.emulator.grading.checks import Property
from fcu_emulator.emulator.grading.judge import JudgeProgress, judge
from fcu_emulator.emulator.grading.rubric import CheckTable, Rubric, load_rubric, rubric_of
from fcu_emulator.emulator.grading.verdict import CheckResult, DiagnosedCause, RunEvidence, Verdict
from fcu_emulator.emulator.host.files import write_atomically
from fcu_emulator.emulator.host.install_hints import command_line
from fcu_emulator.emulator.host.isolation import limits_of_worker
from fcu_emulator.emulator.scenario.expectations import Expectation
from fcu_emulator.emulator.text import visible

_WRONG = ("failed", "partial")
_CHECKS_SHOWN = 4  # checks for each exercise
_CAUSES_SHOWN = 2
_SENTENCES_SHOWN = 4  # sentences for each cause
_COMPARED = 60  # number of characters of a warning that are compared
_COMMAND = 66  # maximum width of the column of commands
_FUNCTION = re.compile(r"(\w+)\(")
_NOT_BEGUN = frozenset({"missing", "stopped", "never lit", "blinks", "prerequisite"})
"""Findings that are possible before the student has written code for the exercise."""
_NOT_OF_THE_FORMULA = frozenset({"wrong format", "stopped", "prerequisite"})
"""Findings for which the further steps of a hint do not help."""


def _rubric_of(options: CheckOptions) -> str:
    return options.rubric if options.rubric is not None else rubric_of(options.target)


def _again(options: CheckOptions) -> str:
    """Return the command without its options for exercises, boards and hints."""
    words = ["fcu", "check", *([options.target] if options.target != "." else [])]
    return command_line(
        [*words, *(["--rubric", options.rubric] if options.rubric not in (None, "lab3") else [])]
    )


def check_program(options: CheckOptions) -> ExitCode:
    """Build a folder's project, judge its program, and print the result. Raises InputError."""
    with commands_ignored(options.annotations is not None):
        shown, code = _checked(options)
    if options.annotations is not None and shown is not None:
        target = Path(options.target)
        for line in annotation_commands(shown, target if target.is_dir() else target.parent):
            click.echo(line)
    return code


def _checked(options: CheckOptions) -> tuple[Verdict | None, ExitCode]:
    one_board = (options.json, options.junit, options.annotations, options.save)
    if options.boards is not None and (options.hints or any(one is not None for one in one_board)):
        raise InputError("--boards must be used without --json, --junit, --annotations, --save and --hint")
    rubric = load_rubric(_rubric_of(options))
    for name in options.exercises:
        rubric.exercise(name)  # raises an error for an unknown exercise before the build
    firmware, build_log = _built(options.target)
    with _workers(options.jobs, len(rubric.runs)) as workers:
        if options.boards is not None:
            return None, _on_boards(firmware, build_log, rubric, options, options.boards, workers)
        shown = _judged(firmware, build_log, rubric, options, options.seed, workers).for_student()
    if options.json is not None:
        _write("--json", options.json, shown.to_json())
    if options.junit is not None:
        from fcu_emulator.emulator.grading.reports.machine import verdict_junit_xml

        _write("--junit", options.junit, verdict_junit_xml(shown))
    laws, saved = _save(options.save, shown, rubric, firmware) if options.save is not None else ({}, [])
    if options.save is not None:
        say(f"saved in {options.save}: {', '.join(saved) or 'nothing'}")
    warning = _first_warning(build_log or "")
    for line in _Screen(shown, rubric, options, firmware, laws, warning).lines():
        click.echo(line)
    return shown, exit_code(shown)


@contextmanager
def _workers(jobs: int | None, runs: int) -> Iterator[Executor | None]:
    """Yield an executor that executes runs in further processes, or None if this process is enough."""
    count = min(jobs or os.cpu_count() or 1, runs)
    if count == 1 or limits_of_worker() is not None:
        yield None
        return
    from fcu_emulator.emulator.grading.workers import LocalWorkers

    workers = LocalWorkers(count - 1)
    try:
        yield workers
    except BaseException:
        workers.shutdown(cancel_futures=True)
        raise
    workers.shutdown()


def _judged(
    firmware: str,
    build_log: str | None,
    rubric: Rubric,
    options: CheckOptions,
    seed: int,
    workers: Executor | None,
) -> Verdict:
    with ProgressLine(f"checking board {seed}") as line:

        def show(progress: JudgeProgress) -> None:
            share = 100 * progress.done_s / progress.total_s
            line.text = f"checking board {seed}: run {progress.run}, {share:.0f} %"

        return judge(
            firmware,
            rubric,
            seed=seed,
            exercises=options.exercises or None,
            build_log=build_log,
            progress=show,
            executor=workers,
        )


def _on_boards(
    firmware: str,
    build_log: str | None,
    rubric: Rubric,
    options: CheckOptions,
    count: int,
    workers: Executor | None,
) -> ExitCode:
    boards = BoardsTable(f"{rubric.title}: {firmware}", "have all points", "loses points")
    for seed in range(options.seed, options.seed + count):
        shown = _judged(firmware, build_log, rubric, options, seed, workers).for_student()
        boards.add(points_on_board(seed, shown, exit_code(shown)))
    return boards.conclude(_again(options))


def exit_code(verdict: Verdict) -> ExitCode:
    """Return the exit code for the checks with points."""
    outcomes = {check.outcome for check in verdict.checks if check.max_points > 0}
    if outcomes & {"failed", "partial"}:
        failed_itself = any(run.stopped or any(one.fatal for one in run.causes) for run in verdict.evidence)
        return ExitCode.FIRMWARE_FAILED if failed_itself else ExitCode.FAILED
    return ExitCode.NOT_JUDGED if "unjudged" in outcomes else ExitCode.PASSED


def _write(option: str, path: Path, text: str) -> None:
    try:
        path.write_text(text, encoding="utf-8", newline="\n")
    except OSError as error:
        problem = f"{error.strerror or error}; give a writable path"
        raise LinkError(f"{option} {path}: {problem}") from error


def _save(folder: Path, verdict: Verdict, rubric: Rubric, firmware: str) -> tuple[dict[str, Path], list[str]]:
    """Write the motions of the runs as scenarios.

    Return the files of failed property checks, keyed by check, and the names of all files.
    """
    texts = {f"{run.run}.toml": run.replay for run in verdict.evidence if run.replay}
    laws: dict[str, Path] = {}
    for check in verdict.checks:
        for law in _laws(rubric, check) if check.outcome == "failed" else ():
            scenario = _law_scenario(firmware, law)
            if scenario:
                texts[f"{law.property}.toml"] = scenario
                laws.setdefault(check.check, folder / f"{law.property}.toml")
    try:
        for name, text in texts.items():
            write_atomically(folder / name, text)
    except OutputError as error:
        raise LinkError(f"--save {error}; give a writable folder") from error
    return laws, list(texts)


def _laws(rubric: Rubric, check: CheckResult) -> list[Property]:
    return [one for one in _table(rubric, check).expect if isinstance(one, Property)]


def _law_scenario(firmware: str, law: Property) -> str:
    from fcu_emulator.emulator.testing.counterexample import counterexample_scenario

    try:
        return counterexample_scenario(firmware, law.property, law.examples)
    except (FirmwareError, NotJudgedError):
        return ""


def _table(rubric: Rubric, check: CheckResult) -> CheckTable:
    tables = rubric.exercise(check.exercise).check
    return next(one for one in tables if f"{check.exercise}.{one.id}" == check.check)


# -- Building -----------------------------------------------------------------------------------------------


def _built(target: str) -> tuple[str, str | None]:
    folder = Path(target)
    if not folder.is_dir():
        return target, None
    elf = folder / ELF
    if not (folder / "Makefile").exists():
        if elf.exists():
            return str(elf), None
        problem = f"must contain a Makefile or {ELF}; give a project of `fcu new`, or an ELF file"
        raise InputError(f"the folder {folder} {problem}")
    with ProgressLine(f"building {folder}"):
        log = (build_with_make if shutil.which("make") else build_project)(folder, "check")
    if not elf.exists():
        raise InputError(f"{folder}: make did not build {ELF}; give the ELF file: fcu check FILE")
    return str(elf), log


def _first_warning(log: str) -> str:
    warnings = (visible(line.strip()) for line in log.splitlines() if "warning:" in line)
    return next((line for line in warnings if not line.startswith("support/")), "")


# -- The screen ---------------------------------------------------------------------------------------------


class _Screen:
    def __init__(
        self,
        verdict: Verdict,
        rubric: Rubric,
        options: CheckOptions,
        firmware: str,
        laws: Mapping[str, Path],
        warning: str,
    ) -> None:
        self._laws = laws
        self._verdict = verdict
        self._rubric = rubric
        self._options = options
        self._firmware = firmware
        self._warning = warning
        self._names = [one.exercise for one in verdict.exercises if verdict.of(one.exercise)]

    def lines(self) -> Iterator[str]:
        verdict = self._verdict
        yield paint(visible(verdict.rubric_title), "heading")
        yield visible(f"{self._firmware}, board {verdict.seed}")
        yield ""
        for one in verdict.exercises:
            if one.exercise in self._names:
                yield self._row(one.exercise, one.title)
        yield ""
        yield self._sum()
        open_ones = [name for name in self._names if not verdict.is_done(name)]
        if open_ones:
            if self._warning:
                yield ""
                yield paint("Compiler warning, which often points at the mistake:", "warning")
                yield from wrapped(f"  {self._warning}", hang=0)
            for name in open_ones if self._options.exercises else open_ones[:1]:
                yield from self._exercise(name)
        yield from self._remarks()
        yield from self._next(open_ones)

    def _row(self, name: str, title: str) -> str:
        checks = self._verdict.of(name)
        got = sum(check.points for check in checks)
        most = sum(check.max_points for check in checks)
        state, look = "not yet", cast(Look | None, None)
        if self._verdict.is_done(name):
            state, look = "done", "pass"
        elif got:
            state, look = "begun", "warning"
        return f"  {name:<3} {paint(f'{state:<8}', look)} {got:4g} of {most:<4g} {visible(title)}"

    def _sum(self) -> str:
        verdict = self._verdict
        text = f"{verdict.points:g} of {verdict.max_points:g} points"
        if verdict.unjudged_points:
            text += f"; {verdict.unjudged_points:g} more not judged"
        if verdict.hidden_checks:
            text += f"; {verdict.hidden_checks} checks hidden"
        return f"{text}."

    def _exercise(self, name: str) -> Iterator[str]:
        checks = [check for check in self._verdict.of(name) if check.max_points > 0]
        wrong = [check for check in checks if check.outcome in _WRONG]
        causes = self._causes(name)
        yield ""
        if causes and causes[0].fatal:
            yield paint(f"Exercise {name}: the program is stuck", "heading")
            yield from _cause(causes[0])
            return
        first = [cause for cause in causes if cause.kind in KEEPS_SAMPLES_AWAY][:_CAUSES_SHOWN]
        besides = [cause for cause in causes if cause not in first][: _CAUSES_SHOWN - len(first)]
        if first:
            yield paint(f"Exercise {name}: fix this first, it may cause the failed checks", "heading")
            for cause in first:
                yield from _cause(cause)
            yield ""
        if besides:
            yield paint(f"Exercise {name}: diagnosis", "heading")
            for cause in besides:
                yield from _cause(cause)
            yield ""
        yield paint(f"Exercise {name}: failed checks", "heading")
        for check in wrong[:_CHECKS_SHOWN]:
            yield from _check(check, self._hints(check) if self._hints_are_shown(causes) else [])
        if wrong[_CHECKS_SHOWN:]:
            more = wrong[_CHECKS_SHOWN:]
            told = "; ".join(one.title for one in more) if self._options.exercises else f"{len(more)} more"
            yield from wrapped(f"  Also failed: {told}", hang=0)
        for check in checks:
            if check.outcome == "unjudged":
                yield from wrapped(f"  Not judged: {check.title}: {check.unjudged_because}", hang=0)

    def _causes(self, name: str) -> list[DiagnosedCause]:
        """Return the diagnoses of the failed runs, fatal diagnoses first."""
        causes = (cause for run in self._failed_runs(name) for cause in (*_stop(run), *run.causes))
        return relevant_causes(causes, self._not_passed(name))

    def _first_fix(self, name: str, causes: Sequence[DiagnosedCause]) -> str:
        for one in causes:
            if "line" in one.data:
                return f"Fix the problem in {one.data['file']}:{one.data['line']}, then check again."
        if len(causes or self._not_passed(name)) == 1:
            return "Fix the problem above, then check again."
        return "Fix the problems above, starting with the first, then check again."

    def _not_passed(self, name: str) -> list[CheckResult]:
        return [one for one in self._verdict.of(name) if one.max_points and one.outcome != "passed"]

    def _failed_runs(self, name: str) -> list[RunEvidence]:
        wrong = {one.check for one in self._not_passed(name)}
        table = self._rubric.exercise(name)
        runs = {self._rubric.run_of(table, one) for one in table.check if f"{name}.{one.id}" in wrong}
        return [run for run in self._verdict.evidence_of(name) if run.run in runs]

    def _remarks(self) -> Iterator[str]:
        if any(run.stopped for run in self._verdict.evidence):
            return
        remarks = [one for one in self._verdict.checks if one.max_points == 0]
        failed = [one for one in remarks if one.outcome == "failed" and not self._is_said(one)]
        if failed:
            yield ""
            yield paint("Not graded", "heading")
            for check in failed:  # no hints for special cases until the exercise is done
                yield from _check(check, self._hints(check) if self._verdict.is_done(check.exercise) else [])
                if check.check in self._laws:
                    yield f"        run: {self._run(self._laws[check.check])}"
        yield from self._unjudged_remarks()

    @staticmethod
    def _hints_are_shown(causes: Sequence[DiagnosedCause]) -> bool:
        """Return whether the program runs and receives samples."""
        return not any(cause.fatal or cause.kind in KEEPS_SAMPLES_AWAY for cause in causes)

    def _hints(self, check: CheckResult) -> list[tuple[str, str]]:
        """Return the hint and as many further steps as the user requests, with labels."""
        if not check.hint:
            return []
        hints = [check.hint, *self._steps(check)]
        if len(hints) == 1:
            return [("hint", check.hint)]
        asked_for = hints[: 1 + self._options.hints]
        return [(f"hint {number} of {len(hints)}", hint) for number, hint in enumerate(asked_for, 1)]

    def _steps(self, check: CheckResult) -> list[str]:
        """Return the further steps of a hint, if a wrong formula can be the cause."""
        wrong = check.finding not in _NOT_OF_THE_FORMULA
        return _table(self._rubric, check).hint_steps if wrong else []

    def _more_hints(self, name: str) -> bool:
        wrong = [
            one for one in self._verdict.of(name) if one.max_points and one.outcome in _WRONG and one.hint
        ]
        return any(len(self._steps(one)) > self._options.hints for one in wrong)

    def _run(self, scenario: Path | None = None) -> str:
        words = ["fcu", "run", self._firmware]
        return command_line([*words, "--scenario", str(scenario)] if scenario else words)

    def _is_said(self, remark: CheckResult) -> bool:
        """Return whether the remark contains the compiler's warning that is already displayed."""
        done = all(self._verdict.is_done(name) for name in self._names)
        return bool(self._warning) and not done and self._warning[:_COMPARED] in remark.actual

    def _unjudged_remarks(self) -> Iterator[str]:
        """For exercises with earned points, report checks that have no points and could not be judged."""
        begun = {one.exercise for one in self._verdict.checks if one.points}
        for check in self._verdict.unjudged:
            if not check.max_points and check.exercise in begun:
                yield ""
                yield from wrapped(
                    f"Not checked (no points): {check.title}: {check.unjudged_because}.", hang=0
                )

    def _is_written(self, name: str, advice: str) -> bool:
        """Return whether points, advised functions or findings show that the student has begun an exercise."""
        if any(one.points for one in self._verdict.of(name)):
            return True
        functions = _FUNCTION.findall(advice)
        own = [name for name in functions if not _has("template-arm", name)]
        if own:
            return all(_has(self._firmware, name) for name in own)
        findings = {one.finding for one in self._verdict.of(name) if one.max_points and one.finding}
        return bool(findings - _NOT_BEGUN)

    def _next(self, open_ones: Sequence[str]) -> Iterator[str]:
        again = _again(self._options)
        yield ""
        if not open_ones:
            yield from self._after_success(again)
            return
        name = open_ones[0]
        seed = f" --seed {self._options.seed}" if self._options.seed else ""
        advice = self._rubric.exercise(name).next
        causes = self._causes(name)
        if causes or not advice or self._is_written(name, advice):
            advice = self._first_fix(name, causes)
        yield paint("Next", "heading")
        yield from wrapped(f"  {advice}", hang=0)
        commands = [(f"{again} --exercise {name}{seed}", "check again")]
        if self._hints_are_shown(causes) and self._more_hints(name):
            hints = " --hint" * (self._options.hints + 1)
            commands.append((f"{commands[0][0]}{hints}", "show the next hint"))
        commands.append((self._run(), "run the program"))
        replays = [one.run for one in self._failed_runs(name) if one.replay]
        folder = self._options.save
        if folder is not None:
            commands += [(self._run(folder / f"{one}.toml"), "run this motion") for one in replays]
        elif replays:
            commands.append((f"{commands[0][0]} --save motions", "save the motions as scenarios"))
        yield from _commands(commands)
        if self._options.hints and not self._hints_are_shown(causes):
            yield f"  Hints for exercise {name} appear when the problem above is fixed."
        elif self._options.hints and not self._more_hints(name):
            yield f"  No more hints for exercise {name}."
        if folder is not None:
            yield from self._not_replayed(name)

    def _after_success(self, again: str) -> Iterator[str]:
        """Yield commands for the other exercises and for another board."""
        asked = "".join(f" --exercise {name}" for name in self._options.exercises)
        yield paint("Next", "heading")
        yield "  All selected exercises are done." if asked else "  All exercises are done."
        commands = [(again, "check all exercises")] if asked else []
        yield from _commands(
            [*commands, (f"{again}{asked} --seed {self._options.seed + 1}", "check another board")]
        )

    def _not_replayed(self, name: str) -> Iterator[str]:
        wrong = [one for one in self._verdict.of(name) if one.max_points and one.outcome in _WRONG]
        left_out = [
            one.title
            for one in wrong
            if not all(isinstance(expected, Expectation) for expected in _table(self._rubric, one).expect)
        ]
        if left_out:
            yield from wrapped(
                f"  The saved scenarios move the board, but do not check: {'; '.join(left_out)}.", hang=0
            )


def _has(firmware: str, function: str) -> bool:
    image = choose(Board.description, firmware, None).image
    return image is not None and image.symbols is not None and function in image.symbols


def _check(check: CheckResult, hints: Sequence[tuple[str, str]]) -> Iterator[str]:
    first, *rest = wrapped(f"        {check.title}", hang=0)
    yield f"  {paint('FAIL', 'fail')}  {first.lstrip()}"
    yield from rest
    seen = "; ".join(filter(None, (check.actual, check.printed and f"such as {check.printed}")))
    told = (("expected", check.expected), ("seen", seen), ("line", check.source), *hints)
    for word, text in told:
        if text:
            yield from wrapped(f"        {word}: {text}", hang=0)


def _cause(cause: DiagnosedCause) -> Iterator[str]:
    yield from wrapped(f"  {cause.summary}", hang=0)
    for sentence in cause.details[:_SENTENCES_SHOWN]:
        yield from wrapped(f"      {sentence.strip()}", hang=0)


def _stop(run: RunEvidence) -> Iterator[DiagnosedCause]:
    if run.stopped:
        yield DiagnosedCause(kind="reset", summary=f"the program was stopped: it {run.stopped}", fatal=True)


def _commands(commands: Sequence[tuple[str, str]]) -> Iterator[str]:
    """Yield commands with their purposes in a second column."""
    width = min(max(len(command) for command, _ in commands), _COMMAND)
    yield from (visible(f"    {command:<{width}}  # {purpose}") for command, purpose in commands)
