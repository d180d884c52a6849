"""Table of ``--boards N``, for ``fcu check`` and ``fcu run``."""

from __future__ import annotations

from dataclasses import dataclass

import click

from fcu_emulator.emulator.cli.exit_codes import ExitCode
from fcu_emulator.emulator.cli.screen import mark_of, paint
from fcu_emulator.emulator.grading.verdict import Verdict
from fcu_emulator.emulator.text import visible

_WORST_FIRST = (ExitCode.FIRMWARE_FAILED, ExitCode.FAILED, ExitCode.NOT_JUDGED, ExitCode.PASSED)
_SEEDS_SHOWN = 10


@dataclass(frozen=True)
class BoardResult:
    """Result on the board ``seed``.

    ``score``: a text such as "18 of 20". ``lost``: failed checks or expectations. ``why``: reason for an
    early end.
    """

    seed: int
    score: str
    lost: tuple[str, ...]
    code: ExitCode
    why: str = ""


def points_on_board(seed: int, verdict: Verdict, code: ExitCode) -> BoardResult:
    """Return the result of a board from the points of its verdict."""
    lost = [one.check for one in verdict.checks if one.outcome in ("failed", "partial") and one.max_points]
    points = f"{verdict.points:g} of {verdict.max_points:g}"
    if verdict.unjudged_points:
        points += f", {verdict.unjudged_points:g} not judged"
    return BoardResult(seed, points, tuple(lost), code)


class BoardsTable:
    """Printer of results. It prints each result as soon as it is added.

    ``all_right``: text for boards without a loss. ``is_lost``: text for a check that fails on some boards.
    """

    def __init__(self, title: str, all_right: str, is_lost: str) -> None:
        self._title = title
        self._all_right = all_right
        self._is_lost = is_lost
        self._results: list[BoardResult] = []

    def add(self, result: BoardResult) -> None:
        self._results.append(result)
        more = "; ".join(filter(None, (", ".join(result.lost), result.why)))
        look, text = mark_of(result.code)
        mark = paint(text, look)
        click.echo(f"  {mark}  board {result.seed:<6} {visible(f'{result.score:<12} {more}').rstrip()}")

    def conclude(self, command: str) -> ExitCode:
        """Print a summary and the ``command`` for one board. Return the worst exit code."""
        codes = [one.code for one in self._results]
        passed = codes.count(ExitCode.PASSED)
        click.echo()
        click.echo(paint(visible(self._title), "heading"))
        unjudged = codes.count(ExitCode.NOT_JUDGED)
        judged = len(codes) - unjudged
        counts = [f"{passed} of {judged} boards {self._all_right}"] if judged else []
        counts += [f"{unjudged} not judged"] if unjudged else []
        click.echo(f"  {'; '.join(counts)}")
        lost: dict[str, list[int]] = {}
        for one in self._results:
            for name in one.lost:
                lost.setdefault(name, []).append(one.seed)
        for name, seeds in lost.items():
            more = f" and {len(seeds) - _SEEDS_SHOWN} more" if len(seeds) > _SEEDS_SHOWN else ""
            shown = ", ".join(map(str, seeds[:_SEEDS_SHOWN]))
            click.echo(visible(f"  {name} {self._is_lost} on board {shown}{more}"))
        wrong = [one.seed for one in self._results if one.code != ExitCode.PASSED]
        if wrong:
            click.echo()
            click.echo(paint("Next", "heading"))
            click.echo(visible(f"    {command} --seed {wrong[0]}"))
        return next(code for code in _WORST_FIRST if code in codes)
