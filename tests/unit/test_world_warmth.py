"""Temperature of the board: heating after power-on and changes of the air, compared with the differential equation."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from fcu_emulator import Board
from fcu_emulator.emulator.clock import Clock, to_ps
from fcu_emulator.emulator.world import World
from fcu_emulator.emulator.world.recording import Recording
from tests.support.scenario_files import write

HEATING_DEGC, TAU_S = 4.0, 100.0


class Clocked:
    """A world whose time the test sets."""

    def __init__(self, cold: bool = True) -> None:
        self.clock = Clock()
        self.world = World(self.clock)
        self.world.warm_up(HEATING_DEGC, TAU_S, 0.0 if cold else math.inf)

    def at(self, t_s: float) -> float:
        return float(self.world.board_temperature_degc(t_s)[0])


def test_switched_on_board_warms_above_air() -> None:
    board = Clocked()
    assert board.at(0) == 25
    assert board.at(TAU_S) == pytest.approx(25 + HEATING_DEGC * (1 - np.exp(-1)), abs=1e-9)
    assert board.at(1e5) == pytest.approx(29, abs=1e-9)
    np.testing.assert_array_equal(board.world.temperature_degc([0, 1e5]), [25, 25])


def test_board_powered_for_long_is_warm() -> None:
    board = Clocked(cold=False)
    np.testing.assert_array_equal(board.world.board_temperature_degc([0, 1, 1e4]), [29, 29, 29])


def test_ideal_board_follows_air_temperature_immediately() -> None:
    clock = Clock()
    world = World(clock)
    world.warm_up(0.0, 0.0, 0.0)
    clock.advance_to(to_ps(5.0))
    world.set_temperature(-10)
    np.testing.assert_array_equal(world.board_temperature_degc([4.999, 5.0, 5.001]), [25, -10, -10])


def test_board_temperature_follows_heat_equation() -> None:
    """Compared with scipy's integration of tau dT/dt = air + heating - T, over four changes."""
    board, changes = Clocked(), [(0.0, 15.0), (30.0, 35.0), (30.0, 5.0), (130.0, 20.0), (131.0, 40.0)]
    for at_s, degc in changes:
        board.clock.advance_to(to_ps(at_s))
        board.world.set_temperature(degc)
    board.clock.advance_to(to_ps(300.0))

    def slope(t_s: float, degc: np.ndarray[tuple[int], np.dtype[np.float64]]) -> list[float]:
        air = next(value for at_s, value in reversed(changes) if at_s <= t_s)
        return [(air + HEATING_DEGC - degc[0]) / TAU_S]

    times = np.arange(135.0, 300.0, 5.0)  # the world keeps no more of its past
    solved = solve_ivp(slope, (0, 300), [15.0], t_eval=times, max_step=0.1, rtol=1e-9)
    np.testing.assert_allclose(board.world.board_temperature_degc(times), solved.y[0], atol=1e-2)


def test_initial_world_temperature_is_already_settled(tmp_path: Path) -> None:
    settings = "[sensors]\nquality = 'ideal'\n[world]\ntemperature_degc = 5\n[board]\nthermal_s = 100\n"
    board = Board(scenario=write(tmp_path, f"schema = 1\nquestion = '?'\nduration = '2s'\n{settings}"))
    np.testing.assert_array_equal(board.world.board_temperature_degc([0, 1, 2]), [5, 5, 5])


def test_recorded_temperature_is_taken_unchanged(tmp_path: Path) -> None:
    (tmp_path / "warm.csv").write_text("t_s,temp_C\n0,10\n1,20\n")
    text = "schema = 1\nquestion = '?'\nduration = '2s'\n[[timeline]]\ndo = 'replay'\ncsv = 'warm.csv'\n"
    board = Board(scenario=write(tmp_path, text))
    np.testing.assert_allclose(board.world.board_temperature_degc([0, 0.5, 1.5]), [10, 15, 20])


THERMOMETERS = {  # how each is switched on; OUT_TEMP and its counts in a degree
    "lsm6dsl": ((0x10, 0x40), 0x20, 256),
    "lis2mdl": ((0x60, 0x8C), 0x6E, 8),
    "lps22hb": ((0x10, 0x50), 0x2B, 100),
}


@pytest.mark.parametrize("cold", [True, False])
def test_thermometers_show_board_temperature(cold: bool) -> None:
    """Over a minute the change is 5 degC (exp(-1 / 200) - exp(-61 / 200)) on a typical board."""
    board = Board(cold_start=cold)
    readings = []
    for _ in range(2):
        board.run_for(1)
        row = []
        for part, ((control, value), address, counts) in THERMOMETERS.items():
            chip = board.sensors[part.upper()]
            if not readings:
                chip.write(control, bytes((value,)), board.clock.now_ps - 10**11)
            raw = chip.read(address, 2, board.clock.now_ps)
            row.append(int.from_bytes(raw, "little", signed=True) / counts)
        readings.append(row)
        board.run_for(59)
    risen = np.subtract(*reversed(readings))
    expected = 5 * (np.exp(-1 / 200) - np.exp(-61 / 200)) if cold else 0.0
    for rise, (part, (_, _, counts)) in zip(risen, THERMOMETERS.items(), strict=True):
        share = 1 + board.sensors[part.upper()].ERRORS.of_quality("typical", 0).heating
        assert rise == pytest.approx(share * expected, abs=1.01 / counts)


def test_sensor_near_regulator_is_warmer_by_its_share() -> None:
    """The share applies to the heating, but not to the lag behind the air or to a recorded temperature."""
    board = Clocked()
    places = [board.world.sensed("temperature_degc", heating=share) for share in (0.0, 0.5, -0.25)]

    def seen(t_s: float) -> list[float]:
        return [float(place(np.array([t_s]))[0]) for place in places]

    grown = HEATING_DEGC * (1 - np.exp(-1))
    assert seen(0) == [25, 25, 25]
    assert seen(TAU_S) == pytest.approx([25 + grown, 25 + 1.5 * grown, 25 + 0.75 * grown])
    board.clock.advance_to(to_ps(30 * TAU_S))
    board.world.set_temperature(-5)
    assert seen(board.clock.now_s) == pytest.approx([29, 31, 28])
    assert seen(60 * TAU_S) == pytest.approx([-1, 1, -2])
    recording = Recording("warm.csv", np.array([0.0, 1.0]), {"temperature": np.array([10.0, 20.0])})
    board.world.replay(recording, 70 * TAU_S)
    assert seen(70 * TAU_S + 0.5) == [15, 15, 15]
