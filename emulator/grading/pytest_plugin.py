"""Second part of the pytest plugin: failed tests show the wrong formula in the board's firmware.

The formulas are those of the rubric beside the firmware or, without it, of LAB3's rubric.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pytest

if TYPE_CHECKING:
    from fcu_emulator.emulator.assembly.board import Board


@pytest.hookimpl(tryfirst=True)
def pytest_runtest_makereport(item: pytest.Item, call: pytest.CallInfo[None]) -> None:
    """Add to the report of a failed test the wrong formula that causes the firmware's numbers."""
    if call.when != "call" or call.excinfo is None or call.excinfo.errisinstance(pytest.skip.Exception):
        return
    board: Any = getattr(item, "funcargs", {}).get("board")
    if type(board).__name__ == "Board" and board.chip is not None:
        text = wrong_formula(board)
        if text:
            item.add_report_section("call", "stdout: wrong formula,", text)


def wrong_formula(board: Board) -> str:
    """Return the explanation of the firmware's printed numbers, or ""."""
    from fcu_emulator.emulator.chip.diagnosis.report import KEEPS_SAMPLES_AWAY
    from fcu_emulator.emulator.grading.explained import explained_run
    from fcu_emulator.emulator.grading.rubric import load_rubric, rubric_of

    assert board.chip is not None
    if any(one.fatal or one.kind in KEEPS_SAMPLES_AWAY for one in board.chip.findings()):
        return ""
    file = board.chip.image.path
    return "\n".join(map(str, explained_run(file, load_rubric(rubric_of(str(file))), board.chip.limits)))
