"""Straight motion of the board: the accelerometer measures it, and the position is known."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import cumulative_trapezoid

from fcu_emulator import Board
from fcu_emulator.emulator.clock import Clock, to_ps
from fcu_emulator.emulator.errors import InputError, RecordingError
from fcu_emulator.emulator.world import World, load_recording
from fcu_emulator.emulator.world.track import Array

G = 9.80665
METRES = st.floats(-3.0, 3.0)


def way_of(world: World, t_s: Array) -> Array:
    """Return the distance north, east, up: the measured acceleration in the room, without gravity, integrated twice."""
    felt = np.einsum("nij,nj->ni", world.rotation(t_s), world.specific_force_g(t_s)) * G
    acceleration = (felt - [0.0, 0.0, G]) * [1.0, -1.0, 1.0]
    speed = cumulative_trapezoid(acceleration, t_s, axis=0, initial=0)
    return cumulative_trapezoid(speed, t_s, axis=0, initial=0)


@given(METRES, METRES, METRES, st.floats(0.3, 3.0), st.floats(-180, 180))
def test_integrating_measured_acceleration_twice_gives_displacement(
    north_m: float, east_m: float, up_m: float, duration_s: float, angle_deg: float
) -> None:
    """This also applies while the board turns."""
    world = World()
    world.set_attitude(20, -30, angle_deg)
    world.rotate_to(-50, 40, -angle_deg / 2, duration_s)
    assert world.move(north_m, east_m, up_m, duration_s, start_s=0.1) == pytest.approx(0.1 + duration_s)
    t_s = np.linspace(0, duration_s + 0.3, 4001)
    np.testing.assert_allclose(way_of(world, t_s), world.position_m(t_s), atol=2e-5)
    np.testing.assert_allclose(world.position_m([duration_s + 0.1])[0], [north_m, east_m, up_m], atol=1e-12)
    np.testing.assert_allclose(world.altitude_m(t_s), world.position_m(t_s)[:, 2])


def test_push_east_is_measured_along_board_axes() -> None:
    """A minimum-jerk push has a peak of 10/sqrt(3) d/T^2, first towards the east: minus Y of a board that faces north."""
    world = World()
    world.move(east_m=0.3, duration_s=0.5)
    t_s = np.linspace(0, 0.5, 2001)
    felt = world.specific_force_g(t_s)
    peak_g = 10 / np.sqrt(3) * 0.3 / 0.5**2 / G
    assert felt[:1000, 1].min() == pytest.approx(-peak_g, rel=1e-5)
    assert felt[1000:, 1].max() == pytest.approx(peak_g, rel=1e-5)
    np.testing.assert_allclose(felt[:, [0, 2]], np.tile([0.0, 1.0], (2001, 1)), atol=1e-12)
    assert world.altitude_m(t_s).max() == 0.0


def test_horizontal_push_does_not_affect_lift() -> None:
    world, other = World(), World()
    for one in (world, other):
        one.lift(2.0, 1.0)
    world.move(north_m=1.0, duration_s=0.5, start_s=0.2)
    t_s = np.linspace(0, 1.2, 50)
    np.testing.assert_array_equal(world.altitude_m(t_s), other.altitude_m(t_s))


def test_position_is_continuous_in_and_out_of_hand() -> None:
    clock = Clock()
    world = World(clock)
    world.move(0.4, -0.2, 0.1, duration_s=0.5)
    clock.advance_to(to_ps(1.0))
    before = world.position_m([1.0])
    world.take_in_hand((0.1, -0.2, 0.05), tremor_mg=0)
    np.testing.assert_allclose(world.position_m([1.0]), before, atol=1e-12)
    world.rotate_to(30, 60, 90, duration_s=1)
    clock.advance_to(to_ps(3.0))
    held = world.position_m([3.0])
    assert np.abs(held - before).max() > 0.05
    world.put_down()
    np.testing.assert_allclose(world.position_m([3.0, 9.0]), np.repeat(held, 2, axis=0), atol=1e-12)


@pytest.mark.parametrize("angles", [False, True])
def test_recorded_position_is_followed_and_measured(angles: bool, tmp_path: Path) -> None:
    t_s = np.linspace(0, 2, 81)
    smooth = (1 - np.cos(np.pi * t_s)) / 2  # there and back
    columns = [t_s, 0.5 * smooth, -0.3 * smooth, 0.2 + 0.1 * smooth]
    columns += [10.0 * smooth, 20.0 * smooth, 30.0 * smooth] if angles else []
    names = "t_s,north_m,east_m,alt_m" + ",roll_deg,pitch_deg,yaw_deg" * angles
    path = tmp_path / "car.csv"
    np.savetxt(path, np.array(columns).T, delimiter=",", header=names, comments="")
    world = World()
    world.replay(load_recording(path))
    np.testing.assert_allclose(world.position_m(t_s), np.array(columns[1:4]).T, atol=1e-9)
    fine_s = np.linspace(0, 2, 8001)
    way = world.position_m(fine_s) - world.position_m([0.0])
    np.testing.assert_allclose(way_of(world, fine_s), way, atol=1e-4)


def test_jumping_recorded_position_is_refused_by_column(tmp_path: Path) -> None:
    path = tmp_path / "car.csv"
    path.write_text("t_s,north_m,east_m\n0,0,0\n0.01,0,1\n0.02,0,0\n", encoding="utf-8")
    with pytest.raises(RecordingError, match="east_m accelerates") as caught:
        World().replay(load_recording(path))
    assert caught.value.kind == "climb"


def test_scenario_moves_board(tmp_path: Path) -> None:
    path = tmp_path / "one.toml"
    text = (
        'schema = 1\nquestion = "?"\nduration = "2s"\n[[timeline]]\ndo = "move"\nat = "1s"\nfor = "500ms"\n'
    )
    path.write_text(text + "north_m = 0.2\neast_m = 0.1\nup_m = -0.3\n", encoding="utf-8")
    world = Board(scenario=path).world
    np.testing.assert_allclose(world.position_m([1.0, 1.5]), [[0, 0, 0], [0.2, 0.1, -0.3]], atol=1e-12)


def test_accelerometer_on_board_measures_push() -> None:
    """After half of the distance, the speed is 15/8 d/T, which is the sum of the samples until then."""
    board = Board(firmware=None, ideal=True)
    bus = board.i2c("I2C2")
    bus.write(0x6B, bytes([0x10, 0x70]))  # CTRL1_XL: 833 Hz, 2 g
    board.run_for(0.1)
    start_s = board.now_s
    board.world.move(north_m=0.3, duration_s=0.6)
    samples = []
    while board.now_s < start_s + 0.3:
        board.run_for(1 / 833)
        raw = bus.write_read(0x6B, b"\x28", 6)
        samples.append((board.now_s, -int.from_bytes(raw[2:4], "little", signed=True) * 0.061e-3 * G))
    at_s, felt = np.array(samples).T
    speed = np.trapezoid(felt, at_s)
    assert speed == pytest.approx(15 / 8 * 0.3 / 0.6, rel=0.03)


@pytest.mark.parametrize(
    "way", [{"north_m": 1e6}, {"east_m": float("nan")}, {"up_m": 2e4}, {"duration_s": 0}]
)
def test_impossible_move_is_refused_without_change(way: dict[str, float]) -> None:
    world = World()
    with pytest.raises(InputError) as caught:
        world.move(**way)
    assert caught.value.kind == "out_of_range"
    assert next(iter(way)) in str(caught.value)
    np.testing.assert_array_equal(world.position_m([0.0, 1.0]), np.zeros((2, 3)))
