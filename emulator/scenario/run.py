"""Running a board through its scenario, within the scenario's limits.

The limits are looked at between slices of virtual time; firmware that loops without ever calling the HAL lets
no virtual time pass, and is beyond what a look between slices can stop.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING

from emulator.errors import InputError
from emulator.links.runner import Runner
from emulator.scenario.result import Finding, Result
from emulator.scenario.scenario import Scenario

if TYPE_CHECKING:
    from emulator.board.board import Board


def run(board: Board, wall_clock_s: Callable[[], float] = time.monotonic) -> Result:
    """Run a board to the end of its scenario, or into a limit, and judge it.

    Raises FirmwareError when the firmware fails, InputError when the board has no scenario.
    """
    plan = _scenario(board)
    runner = Runner(board, [], plan.duration_ps, None, partial(plan.exceeded, board), wall_clock_s)
    runner.run()
    return plan.check(board, runner.limit)


def check(board: Board) -> list[Finding]:
    """The expectations of its scenario that a board has not met by now; see Scenario.check."""
    return list(_scenario(board).check(board).findings)


def _scenario(board: Board) -> Scenario:
    if board.scenario is None:
        raise InputError('this board has no scenario; give one: Board(scenario="flat")')
    return board.scenario
