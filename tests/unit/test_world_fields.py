"""The magnetic field at the board, the Earth's field at a place, and the air."""

from __future__ import annotations

import datetime as dt
import math

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fcu_emulator.emulator.errors import InputError
from fcu_emulator.emulator.world import World, earth_field
from tests.support.words import Words

NORTH_MGAUSS, DOWN_MGAUSS = 215.0, 430.0  # the default field, Zurich


def test_default_field_points_north_and_down() -> None:
    np.testing.assert_allclose(World().magnetic_field_mgauss([0.0]), [[NORTH_MGAUSS, 0, -DOWN_MGAUSS]])


def test_yaw_grows_counter_clockwise_seen_from_above() -> None:
    world = World()
    world.set_attitude(0, 0, 90)  # board X to the west: north is on the board's right, -Y
    expected = [[0, -NORTH_MGAUSS, -DOWN_MGAUSS]]
    np.testing.assert_allclose(world.magnetic_field_mgauss([0.0]), expected, atol=1e-12)


def test_field_vector_is_given_north_east_down() -> None:
    world = World()
    world.set_magnetic_field(north_ut=10, east_ut=20, down_ut=30)
    np.testing.assert_allclose(world.magnetic_field_mgauss([0.0]), [[100, -200, -300]])


def test_hard_iron_is_fixed_and_soft_iron_distorts() -> None:
    world = World()
    world.set_hard_iron(x_mgauss=100, y_mgauss=-50, z_mgauss=30)
    world.set_soft_iron([[1.1, 0.2, 0], [0.2, 0.9, 0], [0, 0, 1]])
    world.set_attitude(0, 0, 180)
    expected = [[-1.1 * NORTH_MGAUSS + 100, -0.2 * NORTH_MGAUSS - 50, -DOWN_MGAUSS + 30]]
    np.testing.assert_allclose(world.magnetic_field_mgauss([0.0]), expected)
    np.testing.assert_array_equal(world.hard_iron_mgauss([0.0, 1.0]), [[100, -50, 30]] * 2)


def test_disturbances_add_to_field_temporarily() -> None:
    world = World()
    assert world.disturb_field(5, 0, 0, duration_s=2, start_s=1) == 3.0
    world.disturb_field(0, 0, 7, duration_s=2, start_s=2)
    change = world.magnetic_field_mgauss([0.5, 1.5, 2.5, 3.5, 4.5]) - world.magnetic_field_mgauss([0.0])
    np.testing.assert_allclose(change, [[0, 0, 0], [50, 0, 0], [50, 0, -70], [0, 0, -70], [0, 0, 0]])


def test_passing_magnet_has_field_of_dipole() -> None:
    world = World()
    end_s = world.pass_magnet(moment_am2=0.5, distance_m=0.2, speed_m_s=0.5, start_s=1)
    closest_s = (1 + end_s) / 2
    t = closest_s + np.array([0.0, 0.4, -0.4])  # abreast, and 0.2 m north and south: 45 degrees
    change = world.magnetic_field_mgauss(t) - world.magnetic_field_mgauss([0.0])
    # Jackson, Classical Electrodynamics, (5.56): on the axis 2 m / r^3; at 45 degrees r = 0.2 sqrt(2)
    on_axis = 2 * 0.5 / 0.2**3
    oblique = 0.5 / (0.2 * np.sqrt(2)) ** 3
    expected = [[0, on_axis, 0], [-1.5 * oblique, 0.5 * oblique, 0], [1.5 * oblique, 0.5 * oblique, 0]]
    np.testing.assert_allclose(change, expected, atol=1e-9)


def test_passing_magnet_starts_and_ends_smoothly() -> None:
    world = World()
    end_s = world.pass_magnet(moment_am2=-2, distance_m=0.3, speed_m_s=1)
    t = np.linspace(0, end_s, 2001)
    change = world.magnetic_field_mgauss(t) - world.magnetic_field_mgauss([end_s + 1])
    size = np.linalg.norm(change, axis=1)
    assert max(size[0], size[-1]) < 0.11
    assert size.argmax() == 1000


def test_held_magnet_equals_passing_magnet_at_same_place() -> None:
    passing, held = World(), World()
    end_s = passing.pass_magnet(moment_am2=0.5, distance_m=0.2, speed_m_s=0.5)
    assert held.follow_magnet(north_m=0, west_m=-0.2, up_m=0, moment_am2=0.5) == 0
    there = passing.magnetic_field_mgauss([end_s / 2])
    np.testing.assert_allclose(held.magnetic_field_mgauss([0.0, 5.0]), np.repeat(there, 2, axis=0))
    held.set_attitude(0, 0, 90)  # the magnet is where it was, the board's Y points to the south
    np.testing.assert_allclose(held.magnetic_field_mgauss([0.0]), [[there[0, 1], -there[0, 0], there[0, 2]]])
    held.take_magnet_away()
    held.set_attitude(0, 0, 0)
    np.testing.assert_allclose(held.magnetic_field_mgauss([0.0]), World().magnetic_field_mgauss([0.0]))


@given(place=st.tuples(*[st.floats(-0.5, 0.5)] * 3).filter(lambda place: np.linalg.norm(place) > 0.05))
def test_field_of_held_magnet_is_slope_of_potential(place: tuple[float, float, float]) -> None:
    """Jackson, Classical Electrodynamics, section 5.6: outside, B is -grad (m . r / r^3)."""
    world, step = World(), 1e-5 * np.eye(3)
    world.follow_magnet(*place, moment_am2=0.3)

    def potential(r: npt.NDArray[np.float64]) -> float:
        return float(0.3 * r[1] / np.linalg.norm(r) ** 3)

    r = -np.array(place)
    slope = [(potential(r + one) - potential(r - one)) / 2e-5 for one in step]
    field = (world.magnetic_field_mgauss([0.0]) - World().magnetic_field_mgauss([0.0]))[0]
    np.testing.assert_allclose(field, np.negative(slope), rtol=1e-5, atol=1e-3)


def test_magnet_inside_board_has_finite_field() -> None:
    world = World()
    world.follow_magnet(-0.1, 0, 0)
    world.follow_magnet(0.1, 0, 0, time_constant_s=0.1)
    moving = world.magnetic_field_mgauss(np.linspace(0, 1, 5001))
    assert np.isfinite(moving).all()
    assert np.abs(moving).max() < 2.001 * 0.3 / 0.005**3 + 1000
    with pytest.raises(InputError, match=r" 0\.005 .* not 0\.001") as refused:
        world.follow_magnet(0.001, 0, 0)
    assert refused.value.kind == "out_of_range"


@pytest.mark.parametrize("attitude", [(0, 0, 0), (30, -50, 120), (0, 90, 0), (180, 0, -45)])
@pytest.mark.parametrize("field", [(21.5, 0, 43), (10, 15, -30), (0, 0, 50)])
def test_figure_of_eight_finds_hard_iron(
    attitude: tuple[float, float, float], field: tuple[float, float, float]
) -> None:
    iron = np.array([120.0, -340.0, 55.0])
    world = World()
    world.set_attitude(*attitude)
    world.set_magnetic_field(*field)
    world.set_hard_iron(*iron)
    start = world.rotation([0.0])
    assert world.figure_eight(duration_s=20) == 20
    seen = world.magnetic_field_mgauss(np.arange(2000) / 100)  # the LIS2MDL's 100 Hz
    np.testing.assert_allclose((seen.max(axis=0) + seen.min(axis=0)) / 2, iron, atol=2)
    np.testing.assert_allclose(world.rotation([20.0]), start, atol=1e-12)
    assert np.abs(world.angular_rate_dps(np.arange(2000) / 100)).max() < 300  # a hand, not a motor


def test_figure_of_eight_without_field_moves_board() -> None:
    world = World()
    world.set_magnetic_field(0, 0, 0)
    world.figure_eight(duration_s=10)
    assert np.abs(world.angular_rate_dps([2.3])).max() > 10


@pytest.mark.parametrize(  # WMM2025 test values, NOAA/NCEI: north, east and down in nT on 2025-01-01
    ("place", "expected_nt"),
    [((80, 0, 0), (6521.6, 145.9, 54791.5)), ((0, 120, 0), (39677.8, -109.6, -10580.2))],
)
def test_field_of_place_equals_world_magnetic_model(
    place: tuple[float, float, float], expected_nt: tuple[float, float, float]
) -> None:
    true = earth_field(*place, dt.date(2025, 1, 1), north="true")
    np.testing.assert_allclose(np.array(true) * 1000, expected_nt, atol=0.06)
    north, east, down = earth_field(*place, dt.date(2025, 1, 1))
    assert (north, east, down) == pytest.approx((np.hypot(true[0], true[1]), 0.0, true[2]))


def test_true_north_turns_compass_by_declination() -> None:
    north, east, down = earth_field(47.4, 8.5, 408, dt.date(2026, 3, 1), north="true")
    world = World()
    world.set_magnetic_field(north, east, down)
    bx, by, _ = world.magnetic_field_mgauss([0.0])[0]
    compass_deg = np.degrees(np.arctan2(-by, bx))  # the lab's yaw of a flat board
    assert compass_deg == pytest.approx(np.degrees(np.arctan2(east, north)))
    assert 3 < compass_deg < 4


@pytest.mark.parametrize(
    ("arguments", "kind", "named"),
    [
        ((91, 0, 0, dt.date(2026, 1, 1)), "out_of_range", "not 91"),
        ((0, 181, 0, dt.date(2026, 1, 1)), "out_of_range", "not 181"),
        ((0, 0, 1e7, dt.date(2026, 1, 1)), "out_of_range", "not 10000000.0"),
        ((0, 0, 0, dt.date(2024, 12, 31)), "outside_model", "2025-01-01 to 2030-01-01"),
        ((0, 0, 0, dt.date(2030, 1, 2)), "outside_model", "2025-01-01 to 2030-01-01"),
        ((0, 0, 0, "2026"), "not_a_date", "'2026'"),
        ((0, 0, 0, dt.date(2026, 1, 1), "grid"), "choice", "'grid'"),
    ],
)
def test_place_out_of_range_is_refused(
    arguments: tuple[float, ...], kind: str, named: str, words: Words
) -> None:
    with pytest.raises(InputError) as caught:
        earth_field(*arguments)
    assert caught.value.kind == kind
    assert named in str(caught.value)
    words("python", str(caught.value))


def test_pressure_at_floor_is_that_of_standard_atmosphere() -> None:
    # U.S. Standard Atmosphere 1976, table I, geopotential altitude
    assert World(floor_altitude_m=0).pressure_hpa([0.0])[0] == pytest.approx(1013.25)
    assert World(floor_altitude_m=1000).pressure_hpa([0.0])[0] == pytest.approx(898.74, abs=0.01)
    assert World(floor_altitude_m=5000).pressure_hpa([0.0])[0] == pytest.approx(540.19, abs=0.01)
    assert World().pressure_hpa([0.0])[0] == World(floor_altitude_m=408).pressure_hpa([0.0])[0]


def test_air_at_room_temperature_has_lower_gradient() -> None:
    world = World(floor_altitude_m=0)
    floor = world.pressure_hpa([0.0])[0]
    world.set_altitude(1.0)
    per_metre = floor - world.pressure_hpa([0.0])[0]
    assert per_metre == pytest.approx(101325 * 0.0289644 * 9.80665 / (8.31432 * 298.15) / 100, rel=1e-3)


def test_set_pressure_applies_at_present_altitude() -> None:
    world = World()
    world.set_altitude(30)
    world.set_temperature(10)
    world.set_pressure(977.4)
    assert world.pressure_hpa([0.0])[0] == pytest.approx(977.4)
    world.set_altitude(0)
    assert world.pressure_hpa([0.0])[0] == pytest.approx(
        977.4 * np.exp(30 * 9.80665 * 0.0289644 / 8.31432 / 283.1)
    )
    assert world.temperature_degc([0.0])[0] == 10


def test_compass_shows_yaw_from_magnetic_north() -> None:
    """The declination is 7.8 degrees east: true north is 7.8 degrees to the left of the needle's direction."""
    world = World()
    world.set_attitude(0, 0, 30)
    assert world.compass_deg(0.0)[0] == pytest.approx([0, 0, 30])
    world.set_magnetic_field(20.0, 20.0 * math.tan(math.radians(7.8)), 43.0)
    assert world.compass_deg(0.0)[0] == pytest.approx([0, 0, 37.8])
    world.disturb_field(0.0, 30.0, 0.0, duration_s=10)
    assert world.compass_deg(1.0)[0] == pytest.approx([0, 0, 37.8])
    world.set_attitude(0, 0, 175)
    assert world.compass_deg(2.0)[0] == pytest.approx([0, 0, -177.2])
    world.set_magnetic_field(0.0, 0.0, 43.0)
    assert world.compass_deg(3.0)[0] == pytest.approx([0, 0, 175])
