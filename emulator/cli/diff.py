"""``fcu diff A B``: show the first differences of two firmwares on one scenario."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import partial

import click

from fcu_emulator.emulator.analysis.compare import (
    SINGLE_PRECISION,
    Difference,
    Rules,
    compare,
    compared,
    largest_deviations,
    tolerances,
)
from fcu_emulator.emulator.analysis.observation import END, TERMINAL, Observation, ObservedItem, observe
from fcu_emulator.emulator.analysis.replay import replay
from fcu_emulator.emulator.assembly.board import Board
from fcu_emulator.emulator.assembly.firmware import python_firmware
from fcu_emulator.emulator.boards.fcu001v1 import FCU001V1
from fcu_emulator.emulator.chip.firmware import parse_limits
from fcu_emulator.emulator.cli.exit_codes import ExitCode
from fcu_emulator.emulator.cli.options import DiffOptions
from fcu_emulator.emulator.cli.screen import Look, ProgressLine, paint
from fcu_emulator.emulator.clock import PS_PER_S, parse_duration, seconds
from fcu_emulator.emulator.errors import InputError
from fcu_emulator.emulator.scenario import Scenario, load_scenario
from fcu_emulator.emulator.scenario.run_view import escaped
from fcu_emulator.emulator.text import visible

_LONGEST = 100  # characters


def compare_firmwares(options: DiffOptions) -> ExitCode:
    """Run both firmwares and print the differences. Raises FcuError.

    Return PASSED if no difference is found and both runs have ended normally.
    """
    rules = Rules(
        _duration("--time-tolerance", options.time_tolerance),
        (SINGLE_PRECISION if options.replay else {}) | tolerances(map(_tolerance, options.tolerance)),
        frozenset(options.ignore),
    )
    plan = load_scenario(options.scenario, seed=options.seed)
    end_ps = plan.duration_ps if options.duration is None else _duration("--duration", options.duration)
    with ProgressLine(f"comparing {options.first} and {options.second}"):
        observed = (_replayed if options.replay else _side_by_side)(options, plan, end_ps)
    differences = compare(*observed, rules)
    for line in _report(options, observed, rules, differences):
        click.echo(paint(visible(line, lines=True), _look(line)))
    if differences:
        return ExitCode.FAILED
    ended_early = any(side.sequences[END] for side in observed)
    return ExitCode.FIRMWARE_FAILED if ended_early else ExitCode.PASSED


def _tolerance(text: str) -> tuple[str, float]:
    name, _, value = text.partition("=")
    try:
        return name, float(value)
    except ValueError:
        raise InputError(
            f"--tolerance must be FIELD=NUMBER, such as ACC=0.5 or Yaw=0.1, not {text}"
        ) from None


def _duration(option: str, text: str) -> int:
    try:
        return parse_duration(text)
    except ValueError as error:
        raise InputError(f"{option} {error}") from error


def _side_by_side(options: DiffOptions, plan: Scenario, end_ps: int) -> tuple[Observation, Observation]:
    boards = [_board(firmware, plan, options) for firmware in (options.first, options.second)]
    first, second = (observe(board, end_ps, partial(plan.exceeded, board)) for board in boards)
    return first, second


def _replayed(options: DiffOptions, plan: Scenario, end_ps: int) -> tuple[Observation, Observation]:
    if options.first not in FCU001V1.python_firmware:
        known = " or ".join(FCU001V1.python_firmware)
        raise InputError(f"--replay runs A on the samples of B: A must be {known}, not {options.first!r}")
    firmware = python_firmware(options.first, plan.firmware_settings())
    board = _board(options.second, plan, options)
    second = observe(board, end_ps, partial(plan.exceeded, board), transfers=True)
    return replay(board, firmware), second


def _board(firmware: str, plan: Scenario, options: DiffOptions) -> Board:
    board = Board(firmware, wiring=options.wiring, scenario=plan, seed=options.seed, ideal=options.ideal)
    limits = parse_limits(options.limit)
    if board.chip is not None:
        board.chip.limits = limits
    return board


# -- output for people --------------------------------------------------------------------------------------


def _report(
    options: DiffOptions,
    observed: tuple[Observation, Observation],
    rules: Rules,
    differences: Sequence[Difference],
) -> Iterator[str]:
    first, second = observed
    yield f"- {options.first}{', on the samples of the other' if options.replay else ''}"
    yield f"+ {options.second}"
    differing = {difference.sequence for difference in differences}
    for name in compared(first, second, rules):
        count, other_count = len(first.sequences[name]), len(second.sequences[name])
        if name not in differing and count:
            yield f"{name}: the same, {count} and {other_count} entries"
    for number, difference in enumerate(differences):
        yield ""
        order = "first difference" if number == 0 else "also different"
        yield f"{order}, {difference.sequence}, entry {difference.index + 1}: {_what(difference, observed)}"
        yield from _sides(difference)
    yield from _numbers(observed, rules)
    for name, side in zip((options.first, options.second), observed, strict=True):
        yield from (f"{name} ended early: {entry.text}" for entry in side.sequences[END])
    if not differences:
        left_out = f"; not compared: {', '.join(sorted(rules.ignore))}" if rules.ignore else ""
        yield f"no difference in {seconds(min(one.end_ps for one in observed))}{left_out}"


def _look(line: str) -> Look | None:
    """Return the colour of a line: red for the first firmware, green for the second."""
    if line.startswith(("first difference", "also different")):
        return "heading"
    looks: dict[str, Look] = {"- ": "fail", "+ ": "pass"}
    return looks.get(line[:2])


def _what(difference: Difference, observed: Sequence[Observation]) -> str:
    if difference.inserted:
        return "only one run has this entry; the next entries agree"
    if difference.first is None or difference.second is None:
        counts = " and ".join(str(len(side.sequences[difference.sequence])) for side in observed)
        return f"only one run has this entry ({counts} entries)"
    if difference.only_time:
        one_s, other_s = (pace_ps / PS_PER_S for pace_ps in difference.paces_ps())
        return f"same text at another time: {one_s:.6f} s and {other_s:.6f} s after the previous entry"
    return "different text" if difference.sequence == TERMINAL else "different value"


def _sides(difference: Difference) -> Iterator[str]:
    for one, other in difference.before:
        yield f"  {_time(one)} {_time(other)}  {_shown(one)}"
    if difference.first is not None:
        yield f"- {_time(difference.first)} {'':>12}  {_shown(difference.first)}"
    if difference.second is not None:
        yield f"+ {'':>12} {_time(difference.second)}  {_shown(difference.second)}"


def _numbers(observed: tuple[Observation, Observation], rules: Rules) -> Iterator[str]:
    """Yield the largest differences of numbers, as possible tolerances."""
    apart = {name: value for name, value in largest_deviations(*observed).items() if value}
    if apart:
        yield ""
        which = "numbers (not compared)" if "numbers" in rules.ignore else "numbers"
        listed = ", ".join(f"{name}={value:.6g}" for name, value in apart.items())
        yield f"{which} differ by up to: {listed}"


def _time(entry: ObservedItem) -> str:
    return f"{entry.at_ps / PS_PER_S:>10.6f} s"


def _shown(entry: ObservedItem) -> str:
    text = escaped(entry.text)
    return text if len(text) <= _LONGEST else text[:_LONGEST] + "..."
