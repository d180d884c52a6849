"""Explanations of a printed number by the formulas of a rubric, and of a live board's problems."""

from __future__ import annotations

from typing import Any, Final

from fcu_emulator.emulator.agents.commands import TimeLimit
from fcu_emulator.emulator.agents.live_board import LiveBoard
from fcu_emulator.emulator.chip.firmware import Limits
from fcu_emulator.emulator.errors import InputError
from fcu_emulator.emulator.grading.explained import explained_run
from fcu_emulator.emulator.grading.rubric import Rubric, load_rubric, rubric_of
from fcu_emulator.emulator.scenario.expectations import ExpectField
from fcu_emulator.emulator.text import shown

_NOT_FOUND: Final = "no formula of the firmware was found that differs from the lab's"


def explain_problems(board: LiveBoard | None) -> dict[str, Any]:
    """Return the problems of the live board's firmware. Raises InputError without a board."""
    if board is None:
        raise InputError("give number and firmware, or call start_board first", kind="no_board")
    return board.state() | {"problems": board.problems()}


def explain_number(
    number: str, firmware: str | None, board: LiveBoard | None, limit: TimeLimit
) -> dict[str, Any]:
    """Compare the formulas behind a printed number with those of the firmware's rubric.

    The firmware runs on further boards, and the live board does not change. Raises InputError for an unknown number.
    """
    if firmware is None and board is None:
        raise InputError("give firmware, or call start_board first", kind="no_board")
    own = firmware is None or (board is not None and board.firmware == firmware)
    file = firmware or (board.firmware if board is not None else "")
    rubric = load_rubric(rubric_of(file))
    fields = _fields(rubric, number)
    found = explained_run(file, rubric, Limits(wall_s=limit.wall_s), fields)
    result: dict[str, Any] = {"number": fields[0].title, "explanations": [one.as_data() for one in found]}
    if not found:
        result["remark"] = _NOT_FOUND
    if own and board is not None:
        result |= board.printed_numbers(fields[0].title)
    return result


def _fields(rubric: Rubric, number: str) -> list[ExpectField]:
    known = [
        one
        for exercise in rubric.exercises
        for check in exercise.check
        if check.visible == "always"
        for one in check.expect
        if isinstance(one, ExpectField)
    ]
    found = [one for one in known if one.title.casefold() == number.casefold()]
    if not found:
        names = ", ".join(dict.fromkeys(one.title for one in known))
        raise InputError(
            f"unknown number {shown(number)}; the rubric has {names}"[:1000], kind="unknown_number"
        )
    return found
