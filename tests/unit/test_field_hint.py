"""Hints about MAG: laws for correct and wrong firmware on boards that are turned."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fcu_emulator import Board
from fcu_emulator.emulator.analysis.field import MAG, field_hint
from fcu_emulator.emulator.analysis.mistakes import explain
from fcu_emulator.emulator.analysis.numbers import axes_in_words, signed_axes
from fcu_emulator.emulator.analysis.recorder import LabLine, TruthRecorder, ValueRange
from fcu_emulator.emulator.world.track import Array

FIELD = (215.0, 0.0, -430.0)  # mgauss, in Zurich, on a board that lies still
OFFSETS = st.tuples(*[st.floats(-300, 300)] * 3)


def tumbled(count: int, turn: float = 1.0) -> Array:
    """Return the field of a board that is turned evenly about all its axes, twice."""
    phase = np.linspace(0, 4 * np.pi * turn, count)
    x, y, z = FIELD
    about_y = np.stack(
        [x * np.cos(phase) + z * np.sin(phase), y + 0 * phase, z * np.cos(phase) - x * np.sin(phase)]
    )
    slow = 3 * phase
    return np.stack(
        [
            about_y[0] * np.cos(slow) - about_y[1] * np.sin(slow),
            about_y[0] * np.sin(slow) + about_y[1] * np.cos(slow),
            about_y[2],
        ]
    ).T


def lines(printed: Array, truth: Array) -> list[LabLine]:
    found = []
    for n, (row, true) in enumerate(zip(printed, truth, strict=True)):
        values = {name: float(int(value)) for name, value in zip(MAG.fields, row, strict=True)}
        ranges = {
            name: ValueRange(value - 5, value + 5) for name, value in zip(MAG.fields, true, strict=True)
        }
        found.append(LabLine(MAG.label, f"MAG {n}", float(n), values, ranges))
    return found


@given(OFFSETS, st.floats(0.93, 1.07))
def test_field_hint_ignores_hard_iron_and_sensitivity(offset: tuple[float, ...], sensitivity: float) -> None:
    truth = tumbled(60)
    assert field_hint(lines(sensitivity * truth + offset, truth)) is None


def test_field_hint_tries_simplest_axis_changes_first() -> None:
    ways = signed_axes()
    changes = [sum(n != m for n, m in enumerate(order)) + signs.count(-1) for order, signs in ways]

    assert len(set(ways)) == len(ways) == 6 * 8 - 1
    assert changes == sorted(changes)
    assert changes[0] == 1


@given(st.sampled_from(signed_axes()), OFFSETS)
def test_exchanged_and_negated_axes_are_reported(
    way: tuple[tuple[int, ...], tuple[int, ...]], offset: tuple[float, ...]
) -> None:
    truth = tumbled(60)
    order, signs = way
    hint = field_hint(lines(truth[:, order] * signs + offset, truth))
    assert hint is not None
    assert hint.summary == f"MAG has {axes_in_words(order, signs)}"


@given(st.one_of(st.floats(0.05, 0.7), st.floats(1.4, 20)), OFFSETS)
def test_field_hint_shows_factor(factor: float, offset: tuple[float, ...]) -> None:
    truth = tumbled(60)
    hint = field_hint(lines(factor * truth + offset, truth))
    assert hint is not None
    assert hint.factor == pytest.approx(factor, rel=0.03, abs=0.01)


@given(OFFSETS)
def test_swapped_bytes_are_reported(offset: tuple[float, ...]) -> None:
    truth = tumbled(60)
    raw = np.rint((truth + offset) / MAG.per_lsb).astype("<i2")
    printed = raw.view(">i2") * MAG.per_lsb
    hint = field_hint(lines(printed, truth))
    assert hint is not None
    assert hint.factor == 0.0
    assert "byte" in hint.summary


@given(st.floats(0, 0.1), OFFSETS, st.floats(-3, 3))
def test_field_hint_needs_turned_board(turn: float, offset: tuple[float, ...], factor: float) -> None:
    truth = tumbled(60, turn)
    assert field_hint(lines(factor * truth + offset, truth)) is None


@given(OFFSETS, st.floats(0.1, 2.0))
def test_field_hint_ignores_unfinished_calibration(offset: tuple[float, ...], turn: float) -> None:
    """MagCalibration subtracts half of the sum of the smallest and the largest value so far."""
    truth = tumbled(60, turn)
    raw = truth + offset
    lowest, highest = np.minimum.accumulate(raw), np.maximum.accumulate(raw)
    assert field_hint(lines(raw - (lowest + highest) / 2, truth)) is None


@pytest.mark.parametrize(
    ("scenario", "seed"), [("compass_turn", 1), ("figure_eight", 2), ("magnet_passes_by", 3)]
)
def test_field_hint_accepts_lab_firmware(scenario: str, seed: int) -> None:
    board = Board("lab3", scenario=scenario, seed=seed)
    recorder = TruthRecorder(board)
    board.run_for(board.scenario.duration_s if board.scenario else 0)
    assert [one.summary for one in explain(board, recorder) if one.kind == "numbers"] == []
