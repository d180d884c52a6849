"""Every block of the chip is put back: recorded programs go on from the middle as if nothing had been."""

from __future__ import annotations

from functools import partial

import pytest

from emulator import Board
from emulator.errors import FirmwareError
from emulator.time.clock import to_ps
from tests.arm.recorded_cases import CASES
from tests.arm.recording import Case, board_of, chip_state

_WITHOUT_A_CASE_OF_ITS_OWN = ("solution", "template", "broken", "vendor-flight", "vendor-lab3")
CHOSEN = sorted(name for name in CASES if not name.startswith(_WITHOUT_A_CASE_OF_ITS_OWN))
CHOSEN += ["broken-faulting_handler", "broken-watchdog"]
CHOSEN += ["vendor-flight", "vendor-lab3-i2c-it-nack", "vendor-lab3-i2c-dma"]


def prepared(case: Case) -> Board:
    """The board at power-on; what will be done to it from outside is in the clock's queue."""
    board = board_of(case)
    board.trace.record_all()
    for fault in case.broken_bus:
        board.i2c2.inject(fault)
    for at_s, text in case.typed:
        board.clock.schedule(to_ps(at_s), partial(board.terminal.write, text))
    for at_s, port, pin, level in case.levels:
        board.clock.schedule(to_ps(at_s), partial(board.gpio.drive, port, pin, level))
    return board


def run_until_ps(board: Board, seconds: float) -> list[object]:
    """All that can be seen of it then, and how the run ended."""
    ending = ""
    try:
        board.run_until_ps(to_ps(seconds))
    except FirmwareError as error:
        ending = str(error)
    return [ending, *board.trace, board.terminal.text, board.clock.now_ps, chip_state(board)]


@pytest.mark.parametrize("part", [0.3, 0.77])
@pytest.mark.parametrize("name", CHOSEN)
def test_a_program_goes_on_from_where_it_was(name: str, part: float) -> None:
    case = CASES[name]
    plain, put_back = prepared(case), prepared(case)
    middle_s = part * case.seconds
    assert run_until_ps(plain, middle_s) == run_until_ps(put_back, middle_s)
    snapshot = put_back.snapshot()
    run_until_ps(put_back, case.seconds + 0.01)
    put_back.restore(snapshot)

    assert run_until_ps(put_back, case.seconds) == run_until_ps(plain, case.seconds)
