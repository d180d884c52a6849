"""Laws of following a hand: continuity over commands, lag, constant rate, and the final target."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from fcu_emulator.emulator.world import Recording, World

angle = st.floats(-180, 180)
attitude = st.tuples(angle, angle, angle)
commands = st.lists(st.tuples(st.floats(0.002, 0.3), attitude, st.floats(0.02, 0.5)), min_size=1, max_size=6)
EPS_S = 1e-7


class Clock:
    def __init__(self) -> None:
        self.now_s = 0.0
        self.inputs = 0

    def __call__(self) -> float:
        return self.now_s


def followed(steps: list[tuple[float, tuple[float, float, float], float]]) -> tuple[World, list[float]]:
    """Return a world after the commands (pause before it, target, time constant), and the times of the commands."""
    clock = Clock()
    world = World(clock)
    times = []
    for pause_s, target_deg, time_constant_s in steps:
        clock.now_s += pause_s
        times.append(clock.now_s)
        world.follow_attitude(*target_deg, time_constant_s)
    return world, times


@given(steps=commands)
@settings(deadline=None, max_examples=60)
def test_rate_and_angular_acceleration_are_continuous_over_commands(
    steps: list[tuple[float, tuple[float, float, float], float]],
) -> None:
    world, times = followed(steps)
    w = 4 / min(time_constant_s for _, _, time_constant_s in steps)
    jerk = 20 * 360 * w**3  # deg/s3, from above
    for at_s in times:
        around = [at_s - 2 * EPS_S, at_s - EPS_S, at_s + EPS_S, at_s + 2 * EPS_S]
        rates = world.angular_rate_dps(around)
        slopes = np.diff(rates, axis=0) / np.diff(around)[:, np.newaxis]
        assert np.abs(rates[2] - rates[1]).max() < 2 * EPS_S * 20 * 360 * w**2 + 1e-6
        assert np.abs(slopes[2] - slopes[0]).max() < 3 * EPS_S * jerk + 0.05


@given(steps=commands)
@settings(deadline=None, max_examples=30)
def test_rate_is_derivative_of_attitude(
    steps: list[tuple[float, tuple[float, float, float], float]],
) -> None:
    world, times = followed(steps)
    t = np.linspace(times[0], times[-1] + 0.5, 57)[1:] + 1e-9
    step = 1e-6
    before, after = (Rotation.from_matrix(world.rotation(t + shift)) for shift in (-step, step))
    measured = np.degrees((before.inv() * after).as_rotvec()) / (2 * step)
    rate = world.angular_rate_dps(t)
    apart = ~np.any(np.abs(t[:, np.newaxis] - np.array(times)) < 2 * step, axis=1)
    np.testing.assert_allclose(measured[apart], rate[apart], atol=1e-3 + 1e-5 * np.abs(rate).max())


@given(steps=commands)
@settings(deadline=None, max_examples=30)
def test_target_is_reached_and_held(steps: list[tuple[float, tuple[float, float, float], float]]) -> None:
    world, times = followed(steps)
    _, target_deg, time_constant_s = steps[-1]
    wanted = World()
    wanted.set_attitude(*target_deg)
    later = times[-1] + np.array([9.99, 10.01, 50.0]) * time_constant_s
    np.testing.assert_allclose(world.rotation(later), wanted.rotation([0.0] * 3), atol=1e-9)
    np.testing.assert_array_equal(world.angular_rate_dps(later[1:]), np.zeros((2, 3)))


@pytest.mark.parametrize("per_second", [40, 60, 125])
@pytest.mark.parametrize("time_constant_s", [0.1, 0.25])
def test_hand_turns_at_steady_rate(per_second: int, time_constant_s: float) -> None:
    """After settling the rate is within 5 %, and the board never lags by more than the time constant."""
    clock = Clock()
    world = World(clock)
    seen, lags = [], []
    for number in range(3 * per_second):
        clock.now_s = number / per_second
        world.follow_attitude(0, 0, 90 * clock.now_s, time_constant_s)
        if clock.now_s > 10 * time_constant_s:
            until = np.linspace(clock.now_s, clock.now_s + 1 / per_second, 8)
            seen.append(world.angular_rate_dps(until)[:, 2])
            yaw = world.attitude_deg(until)[:, 2]
            lags.append(((90 * until - yaw + 180) % 360 - 180) / 90)
    np.testing.assert_allclose(np.concatenate(seen), 90, rtol=0.05)
    assert np.concatenate(lags).max() <= time_constant_s


def test_hand_starting_from_rest_has_no_overshoot() -> None:
    world = World()
    world.follow_attitude(0, 60, 0, 0.1)
    world.follow_altitude(2, 0.1)
    t = np.linspace(0, 1.5, 500)
    assert np.all(np.diff(world.attitude_deg(t)[:, 1]) > -1e-9)
    assert np.all(np.diff(world.altitude_m(t)) > -1e-12)
    assert world.altitude_m([2.0])[0] == 2


def test_following_hand_starts_with_rate_of_motion() -> None:
    clock = Clock()
    world = World(clock)
    world.rotate_to(0, 0, 90, duration_s=2)
    world.lift(3, duration_s=2)
    clock.now_s = 1.0
    before = world.angular_rate_dps([1 - EPS_S])[0]
    speed = np.diff(world.altitude_m([1 - 2 * EPS_S, 1 - EPS_S]))[0] / EPS_S
    world.follow_attitude(0, 0, 60)
    world.follow_altitude(1.5)
    np.testing.assert_allclose(world.angular_rate_dps([1 + EPS_S])[0], before, atol=1e-2)
    assert np.diff(world.altitude_m([1 + EPS_S, 1 + 2 * EPS_S]))[0] / EPS_S == pytest.approx(speed, rel=1e-3)


@given(
    steps=st.lists(
        st.tuples(st.floats(0.002, 0.3), st.floats(-5, 5), st.floats(0.02, 0.5)), min_size=2, max_size=6
    )
)
@settings(deadline=None, max_examples=40)
def test_vertical_acceleration_is_continuous(steps: list[tuple[float, float, float]]) -> None:
    clock = Clock()
    world = World(clock)
    times = []
    for pause_s, metres, time_constant_s in steps:
        clock.now_s += pause_s
        times.append(clock.now_s)
        world.follow_altitude(metres, time_constant_s)
    for at_s in times:
        before, after = world.specific_force_g([at_s - 1e-9, at_s + 1e-9])
        np.testing.assert_allclose(after, before, atol=0.1)


def test_results_do_not_depend_on_sampling() -> None:
    world, _ = followed([(0.1, (10, 20, 30), 0.1), (0.05, (-40, 0, 170), 0.1)])
    t = np.linspace(0, 2, 301)
    np.testing.assert_array_equal(
        world.angular_rate_dps(t), np.concatenate([world.angular_rate_dps([one]) for one in t])
    )


def test_turn_over_and_tap_have_expected_forces() -> None:
    world = World()
    world.set_attitude(0, 20, 50)
    end_s = world.turn_over(duration_s=1)
    half = Rotation.from_matrix(world.rotation([0.0])[0]).inv() * Rotation.from_matrix(
        world.rotation([end_s])[0]
    )
    np.testing.assert_allclose(np.abs(half.as_rotvec(degrees=True)), [180, 0, 0], atol=1e-6)
    tapped = World()
    ended_s = tapped.tap("up", amplitude_g=2)
    t = np.linspace(0, 0.02, 400)
    assert ended_s == pytest.approx(0.01)
    assert tapped.specific_force_g(t)[:, 2].max() == pytest.approx(3)
    np.testing.assert_array_equal(tapped.altitude_m([0.0, 0.011]), [0, 0])


def test_speed_of_recording_is_derivative_of_its_height() -> None:
    rows = {"altitude": np.array([0.0, 1.0, 0.5, 2.0])}
    clock = Clock()
    world = World(clock)
    world.replay(Recording("walk", np.array([0.0, 1.0, 1.5, 3.0]), rows))
    clock.now_s = 1.2
    before = np.diff(world.altitude_m([1.2 - 2e-6, 1.2 - 1e-6]))[0] / 1e-6
    world.follow_altitude(0)
    after = np.diff(world.altitude_m([1.2 + 1e-6, 1.2 + 2e-6]))[0] / 1e-6
    assert abs(before) > 0.5
    assert after == pytest.approx(before, rel=1e-3)


place = st.tuples(*[st.floats(0.05, 0.5)] * 3)


@given(steps=st.lists(st.tuples(st.floats(0.002, 0.3), place, st.floats(0.02, 0.5)), min_size=2, max_size=6))
@settings(deadline=None, max_examples=60)
def test_followed_magnet_field_is_smooth_until_held(
    steps: list[tuple[float, tuple[float, float, float], float]],
) -> None:
    clock = Clock()
    world = World(clock)
    times, end_s = [], 0.0
    for pause_s, place_m, time_constant_s in steps:
        clock.now_s += pause_s
        times.append(clock.now_s)
        end_s = world.follow_magnet(*place_m, time_constant_s=time_constant_s)
    for at_s in times[1:]:
        field = world.magnetic_field_mgauss([at_s - EPS_S, at_s, at_s + EPS_S])
        before, after = np.diff(field, axis=0)
        assert np.abs(after - before).max() < 1e-3 * np.abs(field).max()
    there = World()
    there.follow_magnet(*steps[-1][1])
    resting = there.magnetic_field_mgauss([0.0])[0]
    np.testing.assert_allclose(world.magnetic_field_mgauss([end_s - EPS_S, end_s])[0], resting, rtol=1e-6)
