"""Running a board through its scenario, within the scenario's limits.

The limits are looked at between slices of virtual time; firmware that loops without ever calling the HAL lets
no virtual time pass, and is beyond what a look between slices can stop.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from functools import partial
from typing import Protocol

from emulator.errors import InputError
from emulator.links.runner import Runner
from emulator.scenario.board_view import BoardView
from emulator.scenario.result import Finding, Result
from emulator.scenario.scenario import Scenario


class ScenarioBoard(BoardView, Protocol):
    """A board that says which scenario it plays."""

    @property
    def scenario(self) -> Scenario | None:
        """None if it plays none."""
        ...


def run(board: ScenarioBoard, wall_clock_s: Callable[[], float] = time.monotonic) -> Result:
    """Run a board to the end of its scenario, or into a limit, and judge it.

    Raises FirmwareError when the firmware fails, InputError when the board has no scenario.
    """
    plan = _scenario(board)
    runner = Runner(board, [], plan.duration_ps, None, partial(plan.exceeded, board), wall_clock_s)
    runner.run()
    return plan.check(board, runner.limit)


def check(board: ScenarioBoard) -> list[Finding]:
    """The expectations of its scenario that a board has not met by now; see Scenario.check."""
    return list(_scenario(board).check(board).findings)


def _scenario(board: ScenarioBoard) -> Scenario:
    if board.scenario is None:
        raise InputError('this board has no scenario; give one: Board(scenario="flat")')
    return board.scenario
