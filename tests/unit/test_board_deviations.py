"""The iron of a board: none on an ideal board, drawn from the seed on a typical board, or set by a file."""

from __future__ import annotations

from dataclasses import fields
from pathlib import Path

import numpy as np
import pytest

from fcu_emulator import Board
from fcu_emulator.emulator.boards.description import BoardErrors

LIMITS = {
    "hard_iron_mgauss": 300.0,
    "soft_iron_percent": 9.0,
    "soft_iron_across_percent": 6.0,
    "hsi_percent": 1.0,
}
STRENGTHS = {"heating_degc": 5.0, "thermal_s": 200.0, "pressure_wander_hpa": 0.02}
HEAD = 'schema = 1\nquestion = "?"\nduration = "1s"\n'


def iron(board: Board) -> tuple[np.ndarray, np.ndarray]:
    """Return hard iron (3,) and the matrix of the soft iron (3, 3), computed from fields."""
    board.world.set_magnetic_field(0, 0, 0)
    hard = board.world.magnetic_field_mgauss([0.0])[0]
    columns = []
    for north, east, down in ((100, 0, 0), (0, -100, 0), (0, 0, -100)):  # X, Y and Z of a level board, NED
        board.world.set_magnetic_field(north, east, down)
        columns.append((board.world.magnetic_field_mgauss([0.0])[0] - hard) / 1000)
    return hard, np.array(columns).T


def scenario(tmp_path: Path, text: str) -> Board:
    path = tmp_path / "one.toml"
    path.write_text(HEAD + text, encoding="utf-8")
    return Board(scenario=path)


def test_ideal_board_has_no_iron() -> None:
    hard, soft = iron(Board(ideal=True))
    assert not hard.any()
    np.testing.assert_allclose(soft, np.eye(3), atol=1e-12)


def test_iron_depends_on_seed() -> None:
    first, again, other = (iron(Board(seed=seed)) for seed in (7, 7, 8))
    for one, same, different in zip(first, again, other, strict=True):
        np.testing.assert_array_equal(one, same)
        assert np.abs(one - different).max() > 1e-3
    np.testing.assert_allclose(first[1], first[1].T, atol=1e-12)


def test_hundred_boards_spread_within_limits() -> None:
    assert {entry.name for entry in fields(BoardErrors)} == {*LIMITS, *STRENGTHS, "hse_ppm"}
    boards = [BoardErrors.of_quality("typical", seed) for seed in range(100)]
    for name, limit in LIMITS.items():
        figures = np.array([getattr(board, name) for board in boards])
        assert np.abs(figures).max() <= limit
        assert figures.std() == pytest.approx(limit / 3, rel=0.2)
        assert abs(figures.mean()) < limit / 3 * 3 / np.sqrt(figures.size)
    worst = BoardErrors.of_quality("worst", 1)
    assert all(np.all(np.abs(getattr(worst, name)) == limit) for name, limit in LIMITS.items())
    for name, typical in STRENGTHS.items():
        assert {getattr(board, name) for board in boards} == {typical}
        assert getattr(worst, name) == 1.5 * typical


def test_soft_iron_never_reverses_field() -> None:
    """Iron weakens or strengthens the field but does not reverse it: all factors are near 1 even at the limits."""
    for seed in range(100):
        factors = np.linalg.eigvalsh(BoardErrors.of_quality("worst", seed).soft_iron())
        assert 0.75 < factors.min() < factors.max() < 1.25


def test_iron_of_file_replaces_random_iron(tmp_path: Path) -> None:
    hard, soft = iron(scenario(tmp_path, "[world]\nhard_iron_mgauss = [1, 2, 3]\n"))
    np.testing.assert_allclose(hard, [1, 2, 3])
    assert np.abs(soft - np.eye(3)).max() > 1e-3
    hard, soft = iron(scenario(tmp_path, "[world]\nsoft_iron = [[1, 0, 0], [0, 2, 0], [0, 0, 1]]\n"))
    assert np.abs(hard).max() > 1
    np.testing.assert_allclose(soft, np.diag([1, 2, 1]), atol=1e-12)
    hard, soft = iron(scenario(tmp_path, "[world]\nhard_iron_mgauss = [0, 0, 0]\n"))
    np.testing.assert_allclose(hard, 0, atol=1e-9)
    hard, soft = iron(scenario(tmp_path, "[sensors]\nquality = 'ideal'\n"))
    np.testing.assert_allclose(hard, 0, atol=1e-9)
    np.testing.assert_allclose(soft, np.eye(3), atol=1e-12)


OSCILLATORS = "[board]\nhsi_percent = 0.8\nhse_ppm = -50\n[limits]\nterminal_bytes = 100000\n"


def test_oscillator_errors_apply_to_hsi_and_quartz(tmp_path: Path) -> None:
    """After reset the chip runs from HSI. The shipped program starts the quartz and the PLL, 84 MHz."""
    board = scenario(tmp_path, f"firmware = 'solution'\n{OSCILLATORS}")
    assert board.chip is not None
    clocks = board.chip.chip.system.rcc
    assert clocks.hclk_hz == 16_128_000
    board.run_until(1.2)
    assert clocks.hclk_hz == 83_995_800
    assert board.timer.rate_hz == pytest.approx(800 * (1 - 50e-6))
    assert not board.chip.diagnosis()


def test_typical_hsi_is_within_one_percent() -> None:
    percents = np.array([BoardErrors.of_quality("typical", seed).hsi_percent for seed in range(100)])
    assert np.abs(percents).max() <= 1.0
    assert percents.std() == pytest.approx(1 / 3, rel=0.25)
    assert BoardErrors.of_quality("worst", 1).hse_ppm == 0.0
