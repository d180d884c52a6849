"""``fcu rubric check FILE``: check a rubric, and show the points that it gives to wrong programs."""

from __future__ import annotations

from collections.abc import Sequence

import click

from fcu_emulator.emulator.cli.screen import ProgressLine, paint
from fcu_emulator.emulator.grading.margins import margin_warnings
from fcu_emulator.emulator.grading.rubric import Rubric, load_rubric
from fcu_emulator.emulator.grading.trials import Trial, trials
from fcu_emulator.emulator.host.install_hints import quoted
from fcu_emulator.emulator.text import visible

_TEMPLATE = "template-arm"


def check_rubric(file: str, programs: bool) -> None:
    """Load a rubric. If ``programs`` is True, judge trial programs by this rubric. Raises RubricError."""
    rubric = load_rubric(file)
    count = sum(len(exercise.check) for exercise in rubric.exercises)
    click.echo(
        visible(
            f"{file}: valid; {_count(len(rubric.exercises), 'exercise')}, {_count(count, 'check')}, "
            f"{rubric.max_points:g} points, "
            f"{rubric.duration_s(0):g} s of virtual time"
        )
    )
    for run, expectations in rubric.uncounted.items():
        _warn(
            f"run {run} names a scenario with {expectations} expectations that no check counts; "
            "to count them, add a check of that run without expect"
        )
    for warning in margin_warnings(rubric):
        _warn(warning)
    if programs:
        _try(file, rubric)


def _try(file: str, rubric: Rubric) -> None:
    with ProgressLine("checking programs that do not solve the lab"):
        tried = list(trials(rubric, _TEMPLATE))
    click.echo()
    click.echo(paint("Points of programs that do not solve the lab", "heading"))
    for trial in tried:
        points = f"{trial.verdict.points:g} of {trial.verdict.max_points:g}"
        checks = ", ".join(f"{check} {points:g}" for check, points in trial.earned.items())
        click.echo(f"  {points:<10} {trial.program}{f': {checks}' if checks else ''}")
    given = _given_away(tried)
    if not given:
        click.echo("  None of these programs gets a point.")
        return
    click.echo()
    for check, count in given.items():
        _warn(f"{check} gives points to {count} of these {len(tried)} programs")
    click.echo(
        'Let each of these checks require a check that such programs fail, for example requires = ["'
        f'{_failed_by_all(tried) or "1.alarm"}"]; or set its points to 0.\n'
        f"Then run: fcu rubric check {quoted(file)}"
    )


def _given_away(tried: Sequence[Trial]) -> dict[str, int]:
    """For each check, return the number of programs that get points."""
    earned = [check for trial in tried for check in trial.earned]
    return {check: earned.count(check) for check in dict.fromkeys(earned)}


def _failed_by_all(tried: Sequence[Trial]) -> str:
    given = _given_away(tried)
    checks = [check for check in tried[0].verdict.checks if check.max_points and check.check not in given]
    return next((check.check for check in checks if check.outcome == "failed"), "")


def _count(number: int, what: str) -> str:
    return f"{number} {what}{'s' * (number != 1)}"


def _warn(text: str) -> None:
    click.echo(paint(visible(f"warning: {text}"), "warning"))
