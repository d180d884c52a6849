"""A snapshot restores every peripheral of the chip: recorded programs continue from it without a difference."""

from __future__ import annotations

from functools import partial
from typing import get_args

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fcu_emulator import Board
from fcu_emulator.emulator.buses.i2c import FaultKind, I2CFault
from fcu_emulator.emulator.clock import PS_PER_MS, PS_PER_S, PS_PER_US, to_ps
from fcu_emulator.emulator.errors import FirmwareError
from tests.support.arm.recorded_cases import CASES
from tests.support.arm.recording import Case, board_of, chip_state

_WITHOUT_A_CASE_OF_ITS_OWN = ("solution", "template", "broken", "vendor-flight", "vendor-lab3")
CHOSEN = sorted(name for name in CASES if not name.startswith(_WITHOUT_A_CASE_OF_ITS_OWN))
CHOSEN += ["broken-faulting_handler", "broken-watchdog"]
CHOSEN += ["vendor-flight", "vendor-lab3-i2c-it-nack", "vendor-lab3-i2c-dma"]


def prepared(case: Case) -> Board:
    """Return the board at power-on. The clock has queued all actions from outside."""
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
    """Return everything that can be observed at that time, and how the run ended."""
    ending = ""
    try:
        board.run_until_ps(to_ps(seconds))
    except FirmwareError as error:
        ending = str(error)
    return [ending, *board.trace, board.terminal.text, board.clock.now_ps, chip_state(board)]


@pytest.mark.parametrize("part", [0.3, 0.77])
@pytest.mark.parametrize("name", CHOSEN)
def test_restored_program_continues_identically(name: str, part: float) -> None:
    case = CASES[name]
    plain, put_back = prepared(case), prepared(case)
    middle_s = part * case.seconds
    assert run_until_ps(plain, middle_s) == run_until_ps(put_back, middle_s)
    snapshot = put_back.snapshot()
    run_until_ps(put_back, case.seconds + 0.01)
    put_back.restore(snapshot)

    assert run_until_ps(put_back, case.seconds) == run_until_ps(plain, case.seconds)


# -- faults of the bus --------------------------------------------------------------------------------------

LSM6DSL, LIS2MDL = 0x6B, 0x1E
MASTERS = ("assembly-i2c-by-interrupt", "assembly-i2c-by-dma", "vendor-lab3-i2c-polled")
faults = st.none() | st.builds(
    lambda kind, begin_us, length_us, address, index: (kind, begin_us, length_us, address, index),
    st.sampled_from(get_args(FaultKind)),
    st.integers(-500, 500),
    st.integers(1, 900),
    st.sampled_from([None, LSM6DSL, LIS2MDL]),
    st.integers(0, 2),
)
"""Kind, start relative to the present, length, address, byte."""
times_us = st.integers(0, 900)
Broken = tuple[FaultKind, int, int, int | None, int] | None


def inject(board: Board, fault: Broken) -> None:
    """Inject a fault whose times count from now. Existing output is kept."""
    if fault is not None:
        kind, begin_us, length_us, address, index = fault
        from_s = max(0.0, board.clock.now_ps / PS_PER_S + begin_us / 1e6)
        board.i2c2.inject(I2CFault(kind, from_s, from_s + length_us / 1e6, address, index))


def seen_after(board: Board, run_us: int) -> list[object]:
    """Return everything that can be observed ``run_us`` later."""
    board.run_until_ps(board.clock.now_ps + run_us * PS_PER_US)
    return [*board.trace, board.terminal.text, board.clock.now_ps, chip_state(board)]


@pytest.mark.parametrize("detailed", [False, True], ids=["plain", "traced"])
@pytest.mark.parametrize("name", MASTERS)
def test_snapshot_includes_injected_bus_fault(name: str, detailed: bool) -> None:
    """A fault injected before the snapshot is restored; a fault injected after it is removed.

    Any byte may have the fault.
    """
    boards = [board_of(CASES[name]) for _ in range(2)]
    for board in boards:
        if detailed:
            board.trace.record_all()
        board.run_until_ps((1_050 if name.startswith("vendor") else 0) * PS_PER_MS)
    starts = [board.snapshot() for board in boards]

    @settings(max_examples=20, deadline=None)
    @given(faults, times_us, faults, times_us, faults, times_us)
    def check(
        before: Broken, before_us: int, away: Broken, away_us: int, after: Broken, after_us: int
    ) -> None:
        for board, start in zip(boards, starts, strict=True):
            board.restore(start)
            inject(board, before)
            seen_after(board, before_us)
        plain, put_back = boards
        middle = put_back.snapshot()
        inject(put_back, away)
        seen_after(put_back, away_us)
        put_back.restore(middle)
        for board in boards:
            inject(board, after)
        assert seen_after(put_back, after_us) == seen_after(plain, after_us)

    check()
