"""Motors on the board: frequencies and strength of their vibration, their magnetic field, and their control."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy import signal as scipy_signal

from fcu_emulator import Board
from fcu_emulator.emulator.clock import Clock, to_ps
from fcu_emulator.emulator.errors import InputError, ScenarioError
from fcu_emulator.emulator.scenario import load_scenario, run
from fcu_emulator.emulator.world import World

G = 9.80665
RATE_HZ = 8192.0
T_S = np.arange(0, 4, 1 / RATE_HZ)


def shaken_m_s2(throttle: float | tuple[float, ...]) -> np.ndarray:
    world = World()
    world.run_motors(throttle)
    return (world.specific_force_g(T_S) - [0, 0, 1]) * G


@pytest.mark.parametrize("throttle", [0.3, 0.6, 1.0])
def test_motors_shake_with_square_of_their_speed(throttle: float) -> None:
    rms = np.sqrt(np.mean(shaken_m_s2(throttle) ** 2, axis=0))
    np.testing.assert_allclose(rms, 15.0 * throttle**2, rtol=0.05)


@pytest.mark.parametrize(("axis", "lines"), [(0, 1), (1, 1), (2, 2)])
def test_motor_vibration_is_at_speed_and_blade_frequency(axis: int, lines: int) -> None:
    """400 Hz at full throttle in the plane. Two blades give twice this frequency along Z."""
    hz, power = scipy_signal.periodogram(shaken_m_s2(0.5)[:, axis], RATE_HZ)
    near = np.abs(hz - 200 * lines) < 200 * lines * 0.02
    assert power[near].sum() > 0.99 * power.sum()
    assert len(scipy_signal.find_peaks(power, height=0.1 * power.max())[0]) == 4


def test_force_of_single_motor_rotates() -> None:
    force = shaken_m_s2((0, 0, 0.5, 0))
    np.testing.assert_allclose(np.hypot(force[:, 0], force[:, 1]), 15 / np.sqrt(2) * 0.25, rtol=1e-9)


def test_magnetic_field_of_current_follows_board_and_throttle() -> None:
    world = World()
    at_rest = world.magnetic_field_mgauss([0.0])
    hard_iron = world.hard_iron_mgauss([0.0])
    world.run_motors(0.25)
    np.testing.assert_allclose(world.magnetic_field_mgauss([0.0]) - at_rest, [[-20, -10.5, 3.5]])
    world.run_motors((1, 0, 0, 0))
    np.testing.assert_allclose(world.magnetic_field_mgauss([0.0]) - at_rest, [[-20, -10.5, 3.5]])
    world.set_attitude(30, 40, 50)
    turned = world.magnetic_field_mgauss([0.0])
    world.run_motors(0)
    np.testing.assert_allclose(turned - world.magnetic_field_mgauss([0.0]), [[-20, -10.5, 3.5]])
    np.testing.assert_array_equal(world.hard_iron_mgauss([0.0]), hard_iron)


def test_stopped_motors_change_nothing() -> None:
    clock = Clock()
    world = World(clock)
    world.run_motors(1.0)
    felt = world.sensed("acceleration_g", one_row=True)
    assert felt.agitated(5.0, 6.0, pace_s=0.01)
    clock.advance_to(to_ps(3.0))
    world.run_motors(0)
    assert world.throttle == (0, 0, 0, 0)
    assert not felt.agitated(5.0, 6.0, pace_s=0.01)
    assert len(felt(np.linspace(5, 6, 9))) == 1


@pytest.mark.parametrize("throttle", [1.5, -0.1, float("nan"), (0.5, 0.5), (0, 0, 0, 2), "full"])
def test_impossible_throttle_is_refused(throttle: object) -> None:
    with pytest.raises(InputError, match="throttle"):
        World().run_motors(throttle)  # type: ignore[arg-type]


HEAD = 'schema = 1\nquestion = "?"\nduration = "1s"\n[sensors]\nquality = "ideal"\n'


def scenario(tmp_path: Path, *entries: str) -> Path:
    path = tmp_path / "motors.toml"
    tables = "".join(f'[[timeline]]\ndo = "run_motors"\n{entry}\n' for entry in entries)
    path.write_text(HEAD + tables, encoding="utf-8")
    return path


def test_scenario_accepts_one_throttle_or_four(tmp_path: Path) -> None:
    entries = 'throttle = 0.5\nat = "100ms"', 'throttle = [0.1, 0, 0, 1]\nat = "200ms"'
    board = Board(scenario=scenario(tmp_path, *entries))
    for at_s, throttle in ((0.05, (0, 0, 0, 0)), (0.15, (0.5,) * 4), (0.25, (0.1, 0, 0, 1))):
        board.run_until(at_s)
        assert board.world.throttle == throttle


@pytest.mark.parametrize("throttle", ["2", "[0.5, 0.5]", '"fast"'])
def test_scenario_with_no_throttle_is_refused(tmp_path: Path, throttle: str) -> None:
    with pytest.raises(ScenarioError, match="throttle"):
        load_scenario(scenario(tmp_path, f"throttle = {throttle}"))


def test_motors_follow_pwm_until_throttle_is_set(tmp_path: Path) -> None:
    entries = 'throttle = "firmware"', 'throttle = 0.25\nat = "600ms"'
    board = Board(scenario=scenario(tmp_path, *entries))
    duties = {0.1: (0.0,) * 4, 0.3: (0.5, 0.5, 0.4, 0.4), 0.5: (0.0,) * 4, 0.7: (1.0,) * 4}
    board.motor_duties = lambda: next(duty for until_s, duty in duties.items() if board.now_s <= until_s)  # type: ignore[method-assign]
    for at_s, throttle in ((0.09, 0.0), (0.2, 0.4), (0.295, 0.4), (0.35, 0.0), (0.55, 1.0), (0.65, 0.25)):
        board.run_until(at_s)
        assert board.world.throttle[3] == throttle
    assert run(board).passed
