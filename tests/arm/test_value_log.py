"""Logged values: a log does not change the run, and has the values that the program computes."""

from __future__ import annotations

import numpy as np
import pytest

from fcu_emulator import Board
from fcu_emulator.emulator.chip.cpu.value_log import ValueLog, as_numbers


def ranges(board: Board) -> list[tuple[int, int]]:
    assert board.chip is not None
    symbols = board.chip.image.symbols
    assert symbols is not None
    return symbols.code_ranges(lambda path: path.endswith(("main.c", "motion.c")))


def test_log_changes_neither_time_nor_output() -> None:
    plain, logged = Board("solution", seed=3), Board("solution", seed=3)
    assert logged.chip is not None
    plain.run_for(1.6)
    with ValueLog(logged.chip.chip.core, ranges(logged)) as log:
        logged.run_for(1.6)
        assert len(log.take()) > 100
    plain.run_for(0.3)
    logged.run_for(0.3)

    assert logged.terminal.text == plain.terminal.text
    assert logged.chip.chip.core.retired == plain.chip.chip.core.retired  # type: ignore[union-attr]


def test_log_contains_printed_angle() -> None:
    board = Board("solution", ideal=True)
    board.world.set_attitude(20, -30, 40)
    board.run_for(1.5)
    assert board.chip is not None
    with ValueLog(board.chip.chip.core, ranges(board)) as log:
        board.run_for(0.01)
        values = as_numbers(log.take())
    pitch = board.variable("pitch")

    assert np.any(values["float32"] == np.float32(pitch))


def test_results_of_interrupted_calls_are_logged() -> None:
    """The timer interrupts PRINTF; the argument of its callback in R0 is not the result of the call."""
    board = Board("solution", ideal=True)
    board.run_for(2.5)
    assert board.chip is not None
    symbols = board.chip.image.symbols
    assert symbols is not None
    main = symbols.function_at(symbols.address_of("main"))
    assert main is not None
    with ValueLog(board.chip.chip.core, ranges(board)) as log:
        board.run_for(1.0)
        values = log.take()
    in_main = (values["address"] >= main.start) & (values["address"] < main.start + main.size)
    of_r0 = values[in_main & (values["number"] == 0)]

    assert len(of_r0) > 10
    assert symbols.address_of("htim9") not in of_r0["value"]


def test_full_log_counts_lost_values(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("fcu_emulator.emulator.chip.cpu.value_log._CAPACITY", 10)
    board = Board("solution", ideal=True)
    board.run_for(1.5)
    assert board.chip is not None
    with ValueLog(board.chip.chip.core, ranges(board)) as log:
        board.run_for(0.01)
        assert log.lost > 0
        assert len(log.take()) == 10


def test_loops_do_not_fill_log() -> None:
    board = Board("solution", ideal=True)
    assert board.chip is not None
    symbols = board.chip.image.symbols
    assert symbols is not None
    board.run_for(1.5)
    with ValueLog(board.chip.chip.core, symbols.code_ranges(lambda _path: True)) as log:
        board.run_for(2.0)
        assert log.lost == 0
        assert np.unique(log.take()["address"], return_counts=True)[1].max() <= 100


def test_closed_log_records_nothing() -> None:
    board = Board("solution", ideal=True)
    board.run_for(1.5)
    assert board.chip is not None
    with ValueLog(board.chip.chip.core, ranges(board)) as log:
        pass
    board.run_for(0.1)
    assert len(log.take()) == 0
