"""Laws of the world that hold for every attitude, field and altitude."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import trapezoid

from emulator.world import World
from emulator.world.track import Array

tilt = st.floats(-89.9, 89.9)
turn = st.floats(-179.9, 179.9)
inclined = st.floats(-80, 80)
T0 = np.array([0.0])


def lab_angles(world: World, t_s: Array) -> Array:
    """Pitch, roll, yaw (N, 3) in degrees by the lab's formulas, mu = 1, unrounded."""
    gx, gy, gz = world.specific_force_g(t_s).T
    bx, by, bz = world.magnetic_field_mgauss(t_s).T
    pitch = np.arctan2(-gx, np.sqrt(gy**2 + gz**2))
    roll = np.arctan2(gy, np.sqrt(gx**2 + gz**2))
    by2 = bz * np.sin(roll) - by * np.cos(roll)
    bz2 = by * np.sin(roll) + bz * np.cos(roll)
    bx3 = bx * np.cos(pitch) + bz2 * np.sin(pitch)
    return np.degrees(np.stack((pitch, roll, np.arctan2(by2, bx3)), axis=1))


def world_at(roll: float, pitch: float, yaw: float, inclination: float = 63.4) -> World:
    world = World()
    world.set_attitude(roll, pitch, yaw)
    angle = np.radians(inclination)
    world.set_magnetic_field(48 * np.cos(angle), 0, 48 * np.sin(angle))
    return world


@given(roll=turn, pitch=tilt, yaw=turn)
@settings(deadline=None)
def test_the_lab_prints_the_worlds_pitch_always(roll: float, pitch: float, yaw: float) -> None:
    np.testing.assert_allclose(lab_angles(world_at(roll, pitch, yaw), T0)[0, 0], pitch, atol=1e-9)


@given(roll=tilt, yaw=turn)
@settings(deadline=None)
def test_the_lab_prints_the_worlds_roll_when_pitch_is_zero(roll: float, yaw: float) -> None:
    np.testing.assert_allclose(lab_angles(world_at(roll, 0, yaw), T0)[0, 1], roll, atol=1e-9)


@given(tilted=tilt, about_roll=st.booleans(), yaw=turn, inclination=inclined)
@settings(deadline=None)
def test_the_lab_prints_the_worlds_yaw_when_roll_or_pitch_is_zero(
    tilted: float, about_roll: bool, yaw: float, inclination: float
) -> None:
    roll, pitch = (tilted, 0.0) if about_roll else (0.0, tilted)
    world = world_at(roll, pitch, yaw, inclination)
    np.testing.assert_allclose(lab_angles(world, T0)[0, 2], yaw, atol=1e-7)


def test_the_labs_roll_is_an_approximation_when_both_are_far_from_zero() -> None:
    pitch, roll, yaw = lab_angles(world_at(40, 40, 0), T0)[0]
    np.testing.assert_allclose(pitch, 40, atol=1e-9)
    assert abs(roll - 40) > 5
    assert abs(yaw) > 5


@given(roll=turn, pitch=tilt, yaw=turn, roll2=turn, pitch2=tilt, yaw2=turn)
@settings(deadline=None)
def test_rotation_changes_the_length_of_no_vector(
    *, roll: float, pitch: float, yaw: float, roll2: float, pitch2: float, yaw2: float
) -> None:
    world = world_at(roll, pitch, yaw)
    world.rotate_to(roll2, pitch2, yaw2, duration_s=1)
    t = np.linspace(0, 1, 17)
    np.testing.assert_allclose(np.linalg.norm(world.magnetic_field_mgauss(t), axis=1), 480, rtol=1e-12)
    np.testing.assert_allclose(np.linalg.norm(world.specific_force_g(t), axis=1), 1, rtol=1e-12)
    np.testing.assert_allclose(
        world.rotation([1.0]), world_at(roll2, pitch2, yaw2).rotation([0.0]), atol=1e-12
    )


@given(metres=st.floats(-100, 3000), degc=st.floats(-40, 60), hpa=st.floats(600, 1100))
@settings(deadline=None)
def test_the_labs_altitude_formula_finds_the_worlds_altitude(metres: float, degc: float, hpa: float) -> None:
    world = World()
    world.set_temperature(degc)
    world.set_pressure(hpa)
    floor = world.pressure_hpa(T0)[0]
    world.set_altitude(metres)
    ratio = floor / world.pressure_hpa(T0)[0]
    at_board_k = degc + 273.15 - 0.0065 * metres  # the formula takes the air's temperature at the board
    altitude = (ratio ** (1 / 5.257) - 1) * at_board_k / 0.0065
    np.testing.assert_allclose(altitude, metres, rtol=5e-4, atol=1e-6)  # 5.257 stands for 5.25588
    np.testing.assert_allclose(world.altitude_m(T0), metres)


@given(angle=st.floats(-170, 170), duration=st.floats(0.1, 10))
@settings(deadline=None, max_examples=30)
def test_integrating_the_rate_gives_the_angle(angle: float, duration: float) -> None:
    world = World()
    world.rotate_to(0, 0, angle, duration_s=duration)
    t = np.linspace(0, duration, 2001)
    turned = trapezoid(world.angular_rate_dps(t)[:, 2], t)
    np.testing.assert_allclose(turned, angle, atol=1e-3)
