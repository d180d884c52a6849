"""Lifting, falling, shaking, and the specific force they make."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from emulator.errors import InputError
from emulator.world import Recording, World

G = 9.80665
T_S = np.linspace(0.02, 0.98, 49) + 0.00013

MOTIONS: dict[str, Callable[[World], float]] = {
    "lift": lambda w: w.lift(2.0, duration_s=1),
    "lower": lambda w: w.lift(-0.8, duration_s=1),
    "free_fall": lambda w: w.free_fall(0.45, catch_s=0.1),
    "shake": lambda w: w.shake("up", amplitude_g=0.5, frequency_hz=3, duration_s=1),
}


def test_flat_and_still_reads_one_g_up() -> None:
    np.testing.assert_array_equal(World().specific_force_g([0.0, 1e6]), [[0, 0, 1], [0, 0, 1]])


@pytest.mark.parametrize("name", MOTIONS)
def test_vertical_acceleration_is_the_second_derivative_of_the_altitude(name: str) -> None:
    world = World()
    world.set_altitude(1.5)
    MOTIONS[name](world)
    h = 1e-4
    low, middle, high = (world.altitude_m(T_S + step) for step in (-h, 0.0, h))
    numerical = (low - 2 * middle + high) / h**2
    expected = (world.specific_force_g(T_S)[:, 2] - 1) * G
    np.testing.assert_allclose(numerical, expected, atol=2e-3)
    assert np.abs(expected).max() > 1


def test_a_lift_ends_at_rest_where_it_should() -> None:
    world = World()
    world.set_altitude(1.0)
    end_s = world.lift(2.5, duration_s=4, start_s=1)
    assert end_s == 5.0
    np.testing.assert_allclose(world.altitude_m([0.0, 1.0, 3.0, 5.0, 9.0]), [1, 1, 2.25, 3.5, 3.5])
    np.testing.assert_allclose(world.specific_force_g([1.0, 5.0, 9.0])[:, 2], 1.0)


def test_free_fall_reads_nothing_in_any_attitude_and_the_catch_stops_it() -> None:
    world = World()
    world.set_attitude(20, -50, 110)
    world.set_altitude(2.0)
    end_s = world.free_fall(0.5, catch_s=0.05, start_s=1.0)
    assert end_s == pytest.approx(1.55)
    np.testing.assert_allclose(world.specific_force_g([1.0, 1.25, 1.4999]), np.zeros((3, 3)), atol=1e-15)
    np.testing.assert_allclose(np.linalg.norm(world.specific_force_g([1.51, 1.54]), axis=1), 1 + 0.5 / 0.05)
    np.testing.assert_allclose(np.linalg.norm(world.specific_force_g([0.9, 1.56]), axis=1), 1.0)
    fallen = G * 0.5**2 / 2
    braked = G * 0.5 * 0.05 / 2
    np.testing.assert_allclose(world.altitude_m([1.0, 1.5, 2.0]), [2, 2 - fallen, 2 - fallen - braked])


def test_free_fall_follows_the_gravity_set() -> None:
    world = World()
    world.set_gravity(1.62)
    np.testing.assert_allclose(world.specific_force_g([0.0]), [[0, 0, 1.62 / G]])
    world.free_fall(2.0)
    np.testing.assert_allclose(world.specific_force_g([1.0]), [[0, 0, 0]], atol=1e-15)
    np.testing.assert_allclose(world.altitude_m([2.0]), [-0.5 * 1.62 * 4])


@pytest.mark.parametrize(("axis", "board"), [("north", 0), ("west", 1), ("up", 2)])
def test_a_shake_is_a_cosine_along_its_axis(axis: str, board: int) -> None:
    world = World()
    world.shake(axis, amplitude_g=0.25, frequency_hz=5, duration_s=1, start_s=1)
    t = np.arange(1.0, 2.0, 0.01)
    expected = np.zeros((t.size, 3))
    expected[:, board] = 0.25 * np.cos(2 * np.pi * 5 * (t - 1))
    np.testing.assert_allclose(world.specific_force_g(t) - [0, 0, 1], expected, atol=1e-12)


def test_a_shake_stops_after_whole_periods_at_rest_where_it_began() -> None:
    world = World()
    end_s = world.shake("up", amplitude_g=1, frequency_hz=2, duration_s=1.9)
    assert end_s == 1.5
    assert world.altitude_m(np.linspace(0, 1.5, 301)).max() == pytest.approx(2 * G / (2 * np.pi * 2) ** 2)
    np.testing.assert_allclose(world.altitude_m([1.5 - 1e-9, 1.5, 1.8]), 0, atol=1e-12)
    np.testing.assert_allclose(world.specific_force_g([1.5, 1.8]), [[0, 0, 1]] * 2)
    np.testing.assert_array_equal(world.altitude_m([0.0]), [0.0])


def test_shakes_add_up() -> None:
    world = World()
    world.shake("north", amplitude_g=0.5, frequency_hz=1, duration_s=1)
    world.shake("west", amplitude_g=0.25, frequency_hz=1, duration_s=1)
    np.testing.assert_allclose(world.specific_force_g([0.0]), [[0.5, 0.25, 1]])


def test_a_shaken_board_feels_it_in_its_own_axes() -> None:
    world = World()
    world.set_attitude(0, 0, 90)  # board X to the west
    world.shake("west", amplitude_g=0.5, frequency_hz=1, duration_s=1)
    np.testing.assert_allclose(world.specific_force_g([0.0]), [[0.5, 0, 1]], atol=1e-15)


def test_recorded_altitude_is_linear_between_rows_and_adds_no_acceleration() -> None:
    world = World()
    still = np.zeros((3, 3))
    rows = Recording(
        "stairs.csv", np.array([0.0, 2.0, 4.0]), {"attitude": still, "altitude": np.array([0.0, 3.0, 1.0])}
    )
    assert world.replay(rows, start_s=1) == 5.0
    np.testing.assert_allclose(world.altitude_m([0.0, 1.0, 2.0, 3.0, 4.0, 6.0]), [0, 0, 1.5, 3, 2, 1])
    np.testing.assert_allclose(world.specific_force_g([1.5, 4.5, 9.0])[:, 2], 1.0)
    assert world.pressure_hpa([3.0])[0] < world.pressure_hpa([1.0])[0]


@pytest.mark.parametrize(
    ("plan", "message"),
    [
        (lambda w: w.shake("east", 1, 1, 1), "axis is 'east': give one of north, west, up"),
        (lambda w: w.shake("up", 1, 2, 0.4), "duration_s is 0.4: give at least one period, 0.5 s"),
        (lambda w: w.shake("up", 100, 0.1, 20), "lower g or higher Hz"),
        (lambda w: w.lift(20_000, 1), "metres is 20000: give a number from -1000 to 10000 m"),
        (lambda w: w.free_fall(60), "altitude after the fall"),
        (lambda w: w.lift(1, 0), "duration_s is 0: give a number from"),
        (lambda w: w.lift(1, float("nan")), "duration_s is nan: give a number from"),
        (lambda w: w.lift(1, 1, start_s=-1), "start_s is -1: give a number from 0"),
    ],
)
def test_impossible_motions_are_refused_in_one_line_and_change_nothing(
    plan: Callable[[World], float], message: str
) -> None:
    world = World()
    with pytest.raises(InputError) as caught:
        plan(world)
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)
    np.testing.assert_array_equal(world.altitude_m(T_S), np.zeros(T_S.size))
