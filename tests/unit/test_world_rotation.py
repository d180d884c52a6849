"""Attitude and angular rate of the world, compared with scipy's rotations and numerical derivatives."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from fcu_emulator.emulator.errors import InputError
from fcu_emulator.emulator.world import Recording, World
from fcu_emulator.emulator.world.track import Array

INSIDE_S = np.linspace(0.05, 3.95, 79) + 0.0013  # off the borders between pieces and off the recording's rows

MOTIONS: dict[str, Callable[[World], float]] = {
    "rotate_to": lambda w: w.rotate_to(-40, 70, 170, duration_s=4),
    "half a turn": lambda w: w.rotate_to(10, 20, -150, duration_s=4),
    "linear sweep": lambda w: w.sweep("roll", 85, duration_s=4),
    "smooth sweep": lambda w: w.sweep("yaw", 390, duration_s=4, profile="minimum_jerk"),
    "pitch sweep": lambda w: w.sweep("pitch", -90, duration_s=4),
    "figure_eight": lambda w: w.figure_eight(duration_s=4),
    "two figure_eights": lambda w: w.figure_eight(duration_s=4, turns=2),
    "figure_eights by a hand": lambda w: w.figure_eight(duration_s=4, turns=2, by="hand"),
    "replay": lambda w: w.replay(recorded_attitude()),
}


def recorded_attitude() -> Recording:
    rng = np.random.default_rng(seed=5)
    return Recording("made.csv", np.linspace(0, 4, 9), {"attitude": rng.uniform(-180, 180, size=(9, 3))})


def tilted_world() -> World:
    world = World()
    world.set_attitude(10, 20, 30)
    return world


def scipy_rotation(euler_deg: Array) -> Rotation:
    return Rotation.from_euler(
        "ZYX", euler_deg[:, ::-1], degrees=True
    )  # intrinsic: yaw, then pitch, then roll


def test_attitude_is_yaw_then_pitch_then_roll() -> None:
    world = World()
    for euler in ((30, 0, 0), (0, 30, 0), (0, 0, 30), (-25, 60, 110), (170, -80, -179)):
        world.set_attitude(*euler)
        np.testing.assert_allclose(
            world.rotation([0.0]), scipy_rotation(np.array([euler])).as_matrix(), atol=1e-15
        )
        np.testing.assert_allclose(world.attitude_deg([0.0]), [euler], atol=1e-12)


def test_attitude_is_reported_within_principal_range() -> None:
    world = World()
    world.set_attitude(0, 100, 0)  # the same rotation as (180, 80, 180)
    np.testing.assert_allclose(np.abs(world.attitude_deg([0.0])), [[180, 80, 180]], atol=1e-12)


def test_gimbal_lock_reports_zero_roll() -> None:
    world = World()
    world.set_attitude(30, 90, 50)
    np.testing.assert_allclose(world.attitude_deg([0.0]), [[0, 90, 20]], atol=1e-9)


@pytest.mark.parametrize("name", MOTIONS)
def test_motions_have_proper_rotation_matrices(name: str) -> None:
    world = tilted_world()
    MOTIONS[name](world)
    matrices = world.rotation(INSIDE_S)
    np.testing.assert_allclose(
        matrices @ matrices.transpose(0, 2, 1), np.broadcast_to(np.eye(3), matrices.shape), atol=1e-12
    )
    np.testing.assert_allclose(np.linalg.det(matrices), 1.0, atol=1e-12)
    back = scipy_rotation(world.attitude_deg(INSIDE_S)).as_matrix()
    np.testing.assert_allclose(back, matrices, atol=1e-7)  # near pitch 90 the angles carry fewer digits


@pytest.mark.parametrize("name", MOTIONS)
def test_rate_is_derivative_of_rotation(name: str) -> None:
    world = tilted_world()
    MOTIONS[name](world)
    h = 1e-5
    before = Rotation.from_matrix(world.rotation(INSIDE_S - h))
    after = Rotation.from_matrix(world.rotation(INSIDE_S + h))
    numerical = np.degrees((before.inv() * after).as_rotvec()) / (2 * h)
    np.testing.assert_allclose(world.angular_rate_dps(INSIDE_S), numerical, atol=1e-3)
    assert np.abs(numerical).max() > 10


def test_rotate_to_takes_shortest_arc() -> None:
    world = tilted_world()
    start = Rotation.from_matrix(world.rotation([0.0])[0])
    end_s = world.rotate_to(-40, 70, 170, duration_s=4)
    end = Rotation.from_matrix(world.rotation([end_s])[0])
    np.testing.assert_allclose(world.attitude_deg([end_s]), [[-40, 70, 170]], atol=1e-9)
    arc = (start.inv() * end).as_rotvec()
    angles = np.degrees(
        [(start.inv() * Rotation.from_matrix(r)).magnitude() for r in world.rotation(INSIDE_S)]
    )
    assert np.all(np.diff(angles) > 0)
    rates = world.angular_rate_dps(INSIDE_S)
    directions = rates / np.linalg.norm(rates, axis=1, keepdims=True)
    np.testing.assert_allclose(directions, np.tile(arc / np.linalg.norm(arc), (len(rates), 1)), atol=1e-9)


def test_minimum_jerk_starts_and_ends_without_rate() -> None:
    world = World()
    world.rotate_to(0, 0, 90, duration_s=2, start_s=1)
    rates = world.angular_rate_dps([0.5, 1.0, 2.0, 3.0, 3.5])[:, 2]
    np.testing.assert_allclose(rates, [0, 0, 1.875 * 90 / 2, 0, 0], atol=1e-9)  # peak 15/8 of the mean speed


def test_sweep_turns_whole_circle_and_back() -> None:
    world = World()
    end_s = world.sweep("yaw", 360, duration_s=4)
    np.testing.assert_allclose(world.angular_rate_dps([0.5, 3.5]), [[0, 0, 90], [0, 0, 90]], atol=1e-9)
    np.testing.assert_allclose(world.attitude_deg([1.0, 3.0])[:, 2], [90, -90], atol=1e-9)
    world.sweep("yaw", 0, duration_s=4, start_s=end_s)
    np.testing.assert_allclose(world.angular_rate_dps([6.0]), [[0, 0, -90]], atol=1e-9)


def test_sweep_starts_at_commanded_angle() -> None:
    world = World()
    world.set_attitude(0, 0, 350)
    world.sweep("yaw", 360, duration_s=1)
    np.testing.assert_allclose(world.angular_rate_dps([0.5]), [[0, 0, 10]], atol=1e-9)


def test_motion_starts_from_state_at_its_start() -> None:
    world = World()
    first = world.rotate_to(0, 60, 0, duration_s=2)
    world.sweep("yaw", 90, duration_s=2, start_s=first)
    np.testing.assert_allclose(world.attitude_deg([first, 5.0]), [[0, 60, 0], [0, 60, 90]], atol=1e-9)
    world.rotate_to(0, 0, 0, duration_s=1, start_s=1.0)  # in the middle of the first turn: no jump
    np.testing.assert_allclose(world.attitude_deg([1.0, 2.0, 9.0])[:, 1], [30, 0, 0], atol=1e-9)


def test_recorded_attitude_is_slerped_and_held() -> None:
    rows = recorded_attitude()
    world = World()
    world.replay(Recording("later.csv", rows.t_s + 1.0, rows.groups), start_s=2.0)
    stored = scipy_rotation(rows.groups["attitude"])
    np.testing.assert_allclose(world.rotation(rows.t_s + 3.0), stored.as_matrix(), atol=1e-12)
    np.testing.assert_allclose(world.rotation([2.0, 100.0]), stored[[0, -1]].as_matrix(), atol=1e-12)
    np.testing.assert_array_equal(world.angular_rate_dps([2.5, 100.0]), np.zeros((2, 3)))
    half = world.rotation([3.25])[0]
    arc = (stored[0].inv() * stored[1]).as_rotvec()
    np.testing.assert_allclose(half, (stored[0] * Rotation.from_rotvec(arc / 2)).as_matrix(), atol=1e-12)
    np.testing.assert_array_equal(world.attitude_deg([1.0]), [[0, 0, 0]])


def test_single_recorded_row_applies_at_all_times() -> None:
    world = World()
    world.replay(Recording("one.csv", np.array([1.0]), {"attitude": np.array([[1.0, 2.0, 3.0]])}))
    np.testing.assert_allclose(
        world.attitude_deg([0.0, 1.0, 2.0]), np.tile([1.0, 2.0, 3.0], (3, 1)), atol=1e-12
    )


def test_wrong_axis_and_profile_and_turns_are_refused() -> None:
    world = World()
    with pytest.raises(InputError, match=r"'roll', 'pitch' or 'yaw', not 'x'") as refused:
        world.sweep("x", 10, duration_s=1)
    assert refused.value.kind == "choice"
    with pytest.raises(InputError, match=r"1\.5") as refused:
        world.figure_eight(10, turns=1.5)
    assert refused.value.kind == "not_whole"
