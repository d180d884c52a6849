"""Lifting, falling and shaking, and the specific force that they cause."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.interpolate import CubicSpline

from fcu_emulator.emulator.errors import InputError, RecordingError
from fcu_emulator.emulator.world import Recording, World
from fcu_emulator.emulator.world.position import RecordedCoordinate, accelerations
from tests.support.words import Words

G = 9.80665
T_S = np.linspace(0.02, 0.98, 49) + 0.00013

MOTIONS: dict[str, Callable[[World], float]] = {
    "lift": lambda w: w.lift(2.0, duration_s=1),
    "lower": lambda w: w.lift(-0.8, duration_s=1),
    "free_fall": lambda w: w.free_fall(0.45, catch_s=0.1),
    "shake": lambda w: w.shake("up", amplitude_g=0.5, frequency_hz=3, duration_s=1),
}


def test_flat_board_at_rest_measures_one_g_up() -> None:
    np.testing.assert_array_equal(World().specific_force_g([0.0, 1e6]), [[0, 0, 1], [0, 0, 1]])


@pytest.mark.parametrize("name", MOTIONS)
def test_vertical_acceleration_is_second_derivative_of_altitude(name: str) -> None:
    world = World()
    world.set_altitude(1.5)
    MOTIONS[name](world)
    h = 1e-4
    low, middle, high = (world.altitude_m(T_S + step) for step in (-h, 0.0, h))
    numerical = (low - 2 * middle + high) / h**2
    expected = (world.specific_force_g(T_S)[:, 2] - 1) * G
    np.testing.assert_allclose(numerical, expected, atol=2e-3)
    assert np.abs(expected).max() > 1


def test_lift_stops_at_its_target() -> None:
    world = World()
    world.set_altitude(1.0)
    end_s = world.lift(2.5, duration_s=4, start_s=1)
    assert end_s == 5.0
    np.testing.assert_allclose(world.altitude_m([0.0, 1.0, 3.0, 5.0, 9.0]), [1, 1, 2.25, 3.5, 3.5])
    np.testing.assert_allclose(world.specific_force_g([1.0, 5.0, 9.0])[:, 2], 1.0)


def test_free_fall_measures_zero_until_catch() -> None:
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


def test_free_fall_uses_gravity_that_was_set() -> None:
    world = World()
    world.set_gravity(1.62)
    np.testing.assert_allclose(world.specific_force_g([0.0]), [[0, 0, 1.62 / G]])
    world.free_fall(2.0)
    np.testing.assert_allclose(world.specific_force_g([1.0]), [[0, 0, 0]], atol=1e-15)
    np.testing.assert_allclose(world.altitude_m([2.0]), [-0.5 * 1.62 * 4])


@pytest.mark.parametrize(("axis", "board"), [("north", 0), ("west", 1), ("up", 2)])
def test_shake_is_cosine_along_its_axis(axis: str, board: int) -> None:
    world = World()
    world.shake(axis, amplitude_g=0.25, frequency_hz=5, duration_s=1, start_s=1)
    t = np.arange(1.0, 2.0, 0.01)
    expected = np.zeros((t.size, 3))
    expected[:, board] = 0.25 * np.cos(2 * np.pi * 5 * (t - 1))
    np.testing.assert_allclose(world.specific_force_g(t) - [0, 0, 1], expected, atol=1e-12)


def test_shake_stops_after_whole_periods() -> None:
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


def test_shake_is_measured_in_board_axes() -> None:
    world = World()
    world.set_attitude(0, 0, 90)  # board X to the west
    world.shake("west", amplitude_g=0.5, frequency_hz=1, duration_s=1)
    np.testing.assert_allclose(world.specific_force_g([0.0]), [[0.5, 0, 1]], atol=1e-15)


def recorded_altitude(t_s: list[float] | np.ndarray, metres: list[float] | np.ndarray) -> Recording:
    groups = {"attitude": np.zeros((len(t_s), 3)), "altitude": np.array(metres, dtype=float)}
    return Recording("stairs.csv", np.array(t_s, dtype=float), groups)


def test_recorded_altitude_passes_through_rows_with_acceleration() -> None:
    world = World()
    assert world.replay(recorded_altitude([0.0, 2.0, 4.0], [0.0, 3.0, 1.0]), start_s=1) == 5.0
    np.testing.assert_allclose(world.altitude_m([0.0, 1.0, 3.0, 5.0, 6.0]), [0, 0, 3, 1, 1])
    np.testing.assert_allclose(world.specific_force_g([0.5, 5.5, 9.0])[:, 2], 1.0)
    assert world.specific_force_g([1.5])[0, 2] > 1.02
    assert world.pressure_hpa([3.0])[0] < world.pressure_hpa([1.0])[0]


def test_recorded_lift_equals_computed_lift() -> None:
    """Rows of a lift at 50 Hz have the same acceleration as the lift, whose acceleration is known."""
    lifted, replayed = World(), World()
    lifted.lift(2.0, duration_s=4)
    t_s = np.arange(0.0, 4.001, 0.02)
    replayed.replay(recorded_altitude(t_s, lifted.altitude_m(t_s)))
    inside_s = np.linspace(0.1, 3.9, 500)
    np.testing.assert_allclose(
        replayed.specific_force_g(inside_s)[:, 2], lifted.specific_force_g(inside_s)[:, 2], atol=2e-5
    )


@given(
    st.lists(st.tuples(st.floats(0.05, 3.0), st.floats(-1.0, 1.0)), min_size=1, max_size=12),
    st.floats(0.0, 50.0),
)
def test_recorded_altitude_equals_scipy_spline(moves: list[tuple[float, float]], start_s: float) -> None:
    steps_s, metres = np.array(moves).T
    rows_s = np.concatenate(([0.0], np.cumsum(steps_s)))
    rows_m = np.concatenate(([0.0], metres))
    line = RecordedCoordinate(rows_s, rows_m, accelerations(rows_s, rows_m), start_s)
    spline = CubicSpline(rows_s, rows_m, bc_type="clamped")
    inside_s = np.linspace(0.0, rows_s[-1], 200)[1:-1]
    bound = np.abs(spline(rows_s, 2)).max() + 1.0
    np.testing.assert_allclose(line.position_m(inside_s + start_s), spline(inside_s), atol=1e-9 * bound)
    np.testing.assert_allclose(
        line.acceleration_m_s2(inside_s + start_s), spline(inside_s, 2), atol=1e-9 * bound
    )
    outside_s = np.array([-1.0, rows_s[-1] + 1.0]) + start_s
    np.testing.assert_array_equal(line.acceleration_m_s2(outside_s), 0.0)
    np.testing.assert_array_equal(line.position_m(outside_s), rows_m[[0, -1]])


def test_noisy_recorded_altitude_is_refused_with_line() -> None:
    with pytest.raises(RecordingError, match=r"alt_m .*-500 to 500") as refused:
        World().replay(recorded_altitude([0.0, 0.01, 0.02, 0.03], [0.0, 0.02, -0.02, 0.0]))
    assert (refused.value.file, refused.value.line, refused.value.kind) == ("stairs.csv", 2, "climb")


@pytest.mark.parametrize(
    ("plan", "moving_g"),
    [
        (lambda w: w.set_attitude(40, -50, 20), 0.0),
        (lambda w: w.shake("north", amplitude_g=0.6, frequency_hz=2, duration_s=1), 0.6),
        (lambda w: w.free_fall(0.4), 1.0),
        (lambda w: w.set_gravity(1.62), 0.0),
    ],
    ids=["tilted", "to the side", "falling", "on the Moon"],
)
def test_linear_acceleration_follows_motion(plan: Callable[[World], object], moving_g: float) -> None:
    world = World()
    plan(world)
    assert world.linear_acceleration_g(0.0)[0] == pytest.approx(moving_g)


def test_linear_acceleration_of_recorded_force_uses_modulus() -> None:
    world = World()
    world.replay(
        Recording("force.csv", np.array([0.0, 1.0]), {"acc": np.array([[0.6, 0, 0.8], [0, 0, 1.5]])})
    )
    np.testing.assert_allclose(world.linear_acceleration_g([0.0, 1.0]), [0.0, 0.5], atol=1e-12)


@pytest.mark.parametrize(
    ("plan", "kind", "named"),
    [
        (lambda w: w.shake("east", 1, 1, 1), "choice", "'east'"),
        (lambda w: w.shake("up", 1, 2, 0.4), "too_short", "0.5 s"),
        (lambda w: w.shake("up", 100, 0.1, 20), "out_of_range", "shake"),
        (lambda w: w.lift(20_000, 1), "out_of_range", "not 20000"),
        (lambda w: w.free_fall(60), "out_of_range", "altitude"),
        (lambda w: w.lift(1, 0), "out_of_range", "not 0"),
        (lambda w: w.lift(1, float("nan")), "out_of_range", "not nan"),
        (lambda w: w.lift(1, 1, start_s=-1), "out_of_range", "not -1"),
    ],
)
def test_impossible_motion_is_refused_without_change(
    plan: Callable[[World], float], kind: str, named: str, words: Words
) -> None:
    world = World()
    with pytest.raises(InputError) as caught:
        plan(world)
    assert caught.value.kind == kind
    assert named in str(caught.value)
    words("python", str(caught.value))
    assert "\n" not in str(caught.value)
    np.testing.assert_array_equal(world.altitude_m(T_S), np.zeros(T_S.size))
