"""``fcu check --boards N``: the points on each of several boards, and which checks lose points on which."""

from __future__ import annotations

from collections.abc import Iterator

from fcu_emulator.emulator.cli.exit_codes import ExitCode
from fcu_emulator.emulator.grading.rubric import Rubric
from fcu_emulator.emulator.grading.verdict import Verdict

_WORST_FIRST = (ExitCode.FIRMWARE_FAILED, ExitCode.FAILED, ExitCode.NOT_JUDGED, ExitCode.HELD)
_SEEDS_SHOWN = 10


class BoardsTable:
    """The verdicts on several boards, one after the other."""

    def __init__(self, rubric: Rubric, firmware: str) -> None:
        self._title = f"{rubric.title}: {firmware}"
        self._verdicts: dict[int, Verdict] = {}
        self._codes: list[ExitCode] = []

    def add(self, seed: int, verdict: Verdict, code: ExitCode) -> None:
        """Take the verdict on the board ``seed``, and its exit code."""
        self._verdicts[seed] = verdict
        self._codes.append(code)

    @property
    def exit_code(self) -> ExitCode:
        """The worst of all boards."""
        return next(code for code in _WORST_FIRST if code in self._codes)

    def row(self, seed: int) -> str:
        """One board's line."""
        verdict = self._verdicts[seed]
        lost = [
            one.check for one in verdict.checks if one.outcome in ("failed", "partial") and one.max_points
        ]
        points = f"{verdict.points:g} of {verdict.max_points:g}"
        if verdict.unjudged_points:
            points += f", {verdict.unjudged_points:g} not judged"
        return f"  board {seed:<6} {points:<12} {', '.join(lost)}".rstrip()

    def summary(self, command: str) -> Iterator[str]:
        """How many boards have all points, where others are lost, and the ``command`` that shows one."""
        passed = self._codes.count(ExitCode.HELD)
        yield f"{self._title}: {passed} of {len(self._verdicts)} boards have all points"
        lost: dict[str, list[int]] = {}
        for seed, verdict in self._verdicts.items():
            for one in verdict.checks:
                if one.max_points and one.outcome in ("failed", "partial"):
                    lost.setdefault(one.check, []).append(seed)
        for check, seeds in lost.items():
            more = f" and {len(seeds) - _SEEDS_SHOWN} more" if len(seeds) > _SEEDS_SHOWN else ""
            yield f"  {check} loses points on board {', '.join(map(str, seeds[:_SEEDS_SHOWN]))}{more}"
        if lost:
            yield f"Show one: {command} --seed {next(iter(lost.values()))[0]}"
