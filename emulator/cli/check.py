"""``fcu check``: which exercises of the lab are done, in one screen of plain words, and what to do next.

A folder is built first, as ``make`` does it, its own sources always, so that what the compiler says about
them is known. Details are shown of the first exercise that is not done: that is where work goes on;
``--exercise`` shows another.

Decision: what keeps the program from its samples, or main() from running, is said before the checks that
fail, and their hints are left out: a hint about a formula leads away from a callback that is too slow. Other
causes stand below the checks, whose hints they make precise.
"""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
import textwrap
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

import click

from emulator.board.board import Board
from emulator.board.firmware import choose
from emulator.chip.diagnosis.report import KEEPS_SAMPLES_AWAY
from emulator.cli.exit_codes import ExitCode
from emulator.errors import InputError, LinkError, OutputError
from emulator.files import write_atomically
from emulator.grading.judge import JudgeProgress, judge
from emulator.grading.rubric import Rubric, load_rubric
from emulator.grading.verdict import Cause, CheckResult, RunEvidence, Verdict
from emulator.system_words import quoted
from emulator.text import visible

_WIDTH = 98
_ELF = "lab3.elf"
_ERRORS_SHOWN = 3  # of the compiler
_CHECKS_SHOWN = 4  # that failed, of an exercise
_CAUSES_SHOWN = 2
_SENTENCES_SHOWN = 4  # of a cause
_BUILD_S = 300.0
_MARKS = (
    re.compile("undefined reference|multiple definition|overflowed by"),  # collect2's "error:" says no more
    re.compile("error:"),
    re.compile("Error "),
)
"""What the lines of a build say that matter, the first kind that is there."""
_LONGEST_LOG = 1 << 20
_COMPARED = 60  # characters of a warning
_FUNCTION = re.compile(r"(\w+)\(")
_NOT_BEGUN = frozenset({"missing", "stopped", "never lit", "blinks"})
"""Findings of an exercise that nothing has been written for."""


@dataclass(frozen=True)
class CheckOptions:
    """The arguments of ``fcu check`` as typed."""

    target: str
    rubric: str
    exercises: tuple[str, ...]
    seed: int
    json: Path | None
    save: Path | None = None


def check_program(options: CheckOptions) -> ExitCode:
    """Build if it is a folder, judge, say what is right, what is wrong, and what to do next.

    Raises InputError.
    """
    rubric = load_rubric(options.rubric)
    for name in options.exercises:
        rubric.exercise(name)  # before anything is built
    firmware, build_log = _built(options.target)
    progress = _Progress()
    try:
        verdict = judge(
            firmware,
            rubric,
            seed=options.seed,
            exercises=options.exercises or None,
            build_log=build_log,
            progress=progress.update,
        )
    finally:
        progress.close()
    shown = verdict.for_student()
    if options.json is not None:
        _write(options.json, shown)
    if options.save is not None:
        _save(options.save, shown)
    for line in _Screen(shown, rubric, options, firmware, _first_warning(build_log or "")).lines():
        click.echo(line)
    return exit_code(shown)


def exit_code(verdict: Verdict) -> ExitCode:
    """Of a verdict's checks that give points."""
    outcomes = {check.outcome for check in verdict.checks if check.max_points > 0}
    if outcomes & {"failed", "partial"}:
        failed_itself = any(run.stopped or any(one.fatal for one in run.causes) for run in verdict.evidence)
        return ExitCode.FIRMWARE_FAILED if failed_itself else ExitCode.FAILED
    return ExitCode.NOT_JUDGED if "unjudged" in outcomes else ExitCode.HELD


def _write(path: Path, verdict: Verdict) -> None:
    try:
        path.write_text(verdict.to_json(), encoding="utf-8", newline="\n")
    except OSError as error:
        problem = f"{error.strerror or error}; give a path that can be written"
        raise LinkError(f"--json {path}: {problem}") from error


def _save(folder: Path, verdict: Verdict) -> None:
    for run in verdict.evidence:
        if run.replay:
            try:
                write_atomically(folder / f"{run.run}.toml", run.replay)
            except OutputError as error:
                raise LinkError(f"--save {error}; give a folder that can be written") from error


# -- Building -----------------------------------------------------------------------------------------------


def _built(target: str) -> tuple[str, str | None]:
    """The firmware of a folder or a file, and what the compiler said. Raises InputError."""
    folder = Path(target)
    if not folder.is_dir():
        return target, None
    elf = folder / _ELF
    if not (folder / "Makefile").exists():
        if elf.exists():
            return str(elf), None
        problem = f"has neither a Makefile nor a {_ELF}; give a project of `fcu new`, or an ELF file"
        raise InputError(f"{folder} {problem}")
    log = _make(folder)
    if not elf.exists():
        raise InputError(f"{folder}: make has made no {_ELF}; give the ELF file: fcu check FILE")
    return str(elf), log


def _make(folder: Path) -> str:
    """Run make; what it printed. Raises InputError when it fails, with the compiler's first errors."""
    if shutil.which("make") is None:
        raise InputError("make is not installed; `fcu doctor` says how to get it, or give an ELF file")
    sources = sorted(path.name for path in folder.glob("*.c"))
    changed = [argument for name in sources for argument in ("-W", name)]
    try:
        done = subprocess.run(
            ["make", *changed],
            cwd=folder,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            timeout=_BUILD_S,
            check=False,
        )
    except subprocess.TimeoutExpired as error:
        raise InputError(f"{folder}: make has not ended after {_BUILD_S:g} s") from error
    except OSError as error:
        raise InputError(f"{folder}: make cannot be run: {error.strerror or error}") from error
    log = done.stdout[:_LONGEST_LOG].decode("utf-8", "replace")
    if done.returncode:
        raise InputError(_build_failed(folder, log))
    return log


def _first_warning(log: str) -> str:
    """The compiler's first warning about a file of the student's own."""
    warnings = (visible(line.strip()) for line in log.splitlines() if "warning:" in line)
    return next((line for line in warnings if not line.startswith("support/")), "")


def _build_failed(folder: Path, log: str) -> str:
    lines = [visible(line) for line in log.splitlines() if line.strip()]
    if any("not found" in line or "No such file" in line for line in lines if "arm-none-eabi" in line):
        return f"{folder}: the chip's compiler is missing; `fcu doctor` says how to get it"
    here = f"{folder.resolve()}/"  # the linker names sources so
    found = ([line.removeprefix(here) for line in lines if mark.search(line)] for mark in _MARKS)
    errors = next(filter(None, found), lines[-_ERRORS_SHOWN:])
    shown = [f"  {line[:_WIDTH]}" for line in dict.fromkeys(errors)][:_ERRORS_SHOWN]
    end = f"  nothing was judged; fix the first error, then: fcu check {quoted(str(folder))}"
    return "\n".join([f"{folder} does not build:", *shown, end])


# -- Progress -----------------------------------------------------------------------------------------------


class _Progress:
    """One line on stderr, rewritten in place; nothing where nobody watches."""

    def __init__(self) -> None:
        self._watched = sys.stderr is not None and sys.stderr.isatty()
        self._shown = False

    def update(self, progress: JudgeProgress) -> None:
        """Show which run it is, and how far."""
        if self._watched:
            share = 100 * progress.done_s / progress.total_s
            self._show(f"checking: {progress.run}, {share:.0f} %")
            self._shown = True

    def close(self) -> None:
        """Leave the line."""
        if self._shown:
            self._show("")

    def _show(self, text: str) -> None:
        with suppress(OSError):  # stderr may be full or gone
            click.echo(f"\r{text}\033[K", err=True, nl=False)


# -- The screen ---------------------------------------------------------------------------------------------


class _Screen:
    """What is printed about a verdict."""

    def __init__(
        self, verdict: Verdict, rubric: Rubric, options: CheckOptions, firmware: str, warning: str
    ) -> None:
        self._verdict = verdict
        self._rubric = rubric
        self._options = options
        self._firmware = firmware
        self._warning = warning
        self._names = [one.exercise for one in verdict.exercises if verdict.of(one.exercise)]

    def lines(self) -> Iterator[str]:
        """All of it."""
        verdict = self._verdict
        yield f"{verdict.rubric_title}: {visible(self._firmware)}, board {verdict.seed}"
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
                yield "The compiler warns of your file, which is often the mistake itself:"
                yield from _wrapped(self._warning, "  ")
            for name in open_ones if self._options.exercises else open_ones[:1]:
                yield from self._exercise(name)
        yield from self._remarks()
        yield from self._next(open_ones)

    def _row(self, name: str, title: str) -> str:
        checks = self._verdict.of(name)
        got = sum(check.points for check in checks)
        most = sum(check.max_points for check in checks)
        state = "done" if self._verdict.is_done(name) else ("begun" if got else "not yet")
        return f"  {name:<3} {state:<8} {got:4g} of {most:<4g} {title}"

    def _sum(self) -> str:
        verdict = self._verdict
        text = f"{verdict.points:g} of {verdict.max_points:g} points"
        if verdict.unjudged_points:
            text += f"; {verdict.unjudged_points:g} more could not be judged"
        if verdict.hidden_checks:
            text += f"; {verdict.hidden_checks} checks are not shown"
        return f"{text}."

    def _exercise(self, name: str) -> Iterator[str]:
        """What is wrong with one exercise, and why."""
        checks = [check for check in self._verdict.of(name) if check.max_points > 0]
        wrong = [check for check in checks if check.outcome in ("failed", "partial")]
        causes = list(self._causes(name))
        yield ""
        if causes and causes[0].fatal:
            yield "The program does not go on:"
            yield from _cause(causes[0])
            return
        first = [cause for cause in causes if cause.kind in KEEPS_SAMPLES_AWAY][:_CAUSES_SHOWN]
        besides = [cause for cause in causes if cause not in first][: _CAUSES_SHOWN - len(first)]
        if first:
            yield f"Exercise {name}, fix this first, the rest may follow from it:"
            for cause in first:
                yield from _cause(cause)
            yield "What is not right yet:"
        else:
            yield f"Exercise {name}, what is not right yet:"
        for check in wrong[:_CHECKS_SHOWN]:
            yield from _check(check, hint=not first)
        if len(wrong) > _CHECKS_SHOWN:
            yield f"  ... and {len(wrong) - _CHECKS_SHOWN} more"
        for check in checks:
            if check.outcome == "unjudged":
                yield from _wrapped(f"{check.title}: could not be judged: {check.unjudged_because}", "  ")
        if besides:
            yield "What the run shows besides:" if first else "What the run shows:"
            for cause in besides:
                yield from _cause(cause)

    def _causes(self, name: str) -> Iterator[Cause]:
        """What the diagnosis says about the runs of what failed, each once, the worst first."""
        found: dict[str, Cause] = {}
        for run in self._failed_runs(name):
            for cause in (*_stop(run), *run.causes):
                found.setdefault(_without_numbers(cause.summary), cause)
        return iter(sorted(found.values(), key=lambda cause: not cause.fatal))

    def _failed_runs(self, name: str) -> list[RunEvidence]:
        """The runs that the checks look at which an exercise has not passed."""
        wrong = {one.check for one in self._verdict.of(name) if one.max_points and one.outcome != "passed"}
        table = self._rubric.exercise(name)
        runs = {self._rubric.run_of(table, one) for one in table.check if f"{name}.{one.id}" in wrong}
        return [run for run in self._verdict.evidence_of(name) if run.run in runs]

    def _remarks(self) -> Iterator[str]:
        """What costs no points; of a program that does not go on, nothing else matters."""
        if any(run.stopped for run in self._verdict.evidence):
            return
        remarks = [one for one in self._verdict.checks if one.max_points == 0]
        failed = [one for one in remarks if one.outcome == "failed" and not self._is_said(one)]
        if failed:
            yield ""
            yield "By the way, what costs no points:"
            for check in failed:  # a hint about edges leads away from what is wrong everywhere
                yield from _check(check, hint=self._verdict.is_done(check.exercise))
        yield from self._unjudged_remarks()

    def _is_said(self, remark: CheckResult) -> bool:
        """Whether it is about the compiler's warning on top of the screen."""
        done = all(self._verdict.is_done(name) for name in self._names)
        return bool(self._warning) and not done and self._warning[:_COMPARED] in remark.actual

    def _unjudged_remarks(self) -> Iterator[str]:
        """Remarks that are missing, of exercises that are begun: machines must not differ in silence."""
        begun = {one.exercise for one in self._verdict.checks if one.points}
        for check in self._verdict.unjudged:
            if not check.max_points and check.exercise in begun:
                yield ""
                yield from _wrapped(f"Not checked (no points): {check.title}: {check.unjudged_because}.", "")

    def _is_written(self, name: str, advice: str) -> bool:
        """Whether the program has what the advice says to write: a function, or lines that are only wrong."""
        functions = _FUNCTION.findall(advice)
        if functions:
            return any(map(self._has, functions))
        findings = {one.finding for one in self._verdict.of(name) if one.max_points and one.finding}
        return bool(findings - _NOT_BEGUN)

    def _has(self, function: str) -> bool:
        image = choose(Board.description, self._firmware, None).image
        return image is not None and image.symbols is not None and function in image.symbols

    def _next(self, open_ones: Sequence[str]) -> Iterator[str]:
        target = quoted(self._options.target)
        again = f"fcu check {target}" if self._options.target != "." else "fcu check"
        if self._options.rubric != "lab3":
            again += f" --rubric {quoted(self._options.rubric)}"
        yield ""
        if not open_ones:
            which = "Everything asked for" if self._options.exercises else "Everything"
            yield f"{which} is right. On another board of the class:"
            yield f"  {again} --seed {self._options.seed + 1}"
            return
        name = open_ones[0]
        seed = f" --seed {self._options.seed}" if self._options.seed else ""
        advice = self._rubric.exercise(name).next
        if list(self._causes(name)) or not advice or self._is_written(name, advice):
            advice = "fix the problems above, starting with the first, and check again."
        yield from _wrapped(f"Next: {advice}", "")
        yield f"  {again} --exercise {name}{seed}"
        run = f"  fcu run {quoted(self._firmware)}"
        yield run
        replays = [one.run for one in self._failed_runs(name) if one.replay]
        folder = self._options.save
        if folder is not None:
            yield from (f"{run} --scenario {quoted(str(folder / f'{one}.toml'))}" for one in replays)
        elif replays:
            yield f"  {again} --exercise {name}{seed} --save motions     to run its motions by hand"


def _check(check: CheckResult, *, hint: bool = True) -> Iterator[str]:
    yield from _wrapped(check.title, "  - ")
    seen = "; ".join(filter(None, (check.actual, check.printed and f"such as {check.printed}")))
    shown = check.hint if hint else ""
    for word, text in (("expected", check.expected), ("seen", seen), ("hint", shown)):
        if text:
            yield from _wrapped(f"{word}: {text}", "      ")


def _cause(cause: Cause) -> Iterator[str]:
    yield from _wrapped(visible(cause.summary), "  ")
    for sentence in cause.details[:_SENTENCES_SHOWN]:
        yield from _wrapped(visible(sentence.strip()), "      ")


def _stop(run: RunEvidence) -> Iterator[Cause]:
    if run.stopped:
        yield Cause(kind="reset", summary=f"the program was stopped: it {run.stopped}", fatal=True)


def _without_numbers(text: str) -> str:
    return "".join(char for char in text if not char.isdigit())


def _wrapped(text: str, indent: str) -> list[str]:
    return textwrap.wrap(
        text, _WIDTH, initial_indent=indent, subsequent_indent=" " * len(indent), break_long_words=False
    )
