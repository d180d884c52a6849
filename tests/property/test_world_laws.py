"""Laws of the world that hold for every attitude, field and altitude."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import trapezoid

from fcu_emulator.emulator.clock import Clock, to_ps
from fcu_emulator.emulator.errors import InputError
from fcu_emulator.emulator.world import World, truth
from fcu_emulator.emulator.world.recording import Recording
from fcu_emulator.emulator.world.track import Array

tilt = st.floats(-89.9, 89.9)
turn = st.floats(-179.9, 179.9)
inclined = st.floats(-80, 80)
T0 = np.array([0.0])


def lab_angles(world: World, t_s: Array) -> Array:
    """Return pitch, roll, yaw (N, 3) in degrees by the lab's formulas, with mu = 1 and without rounding."""
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
def test_lab_pitch_is_true_pitch_in_every_attitude(roll: float, pitch: float, yaw: float) -> None:
    np.testing.assert_allclose(lab_angles(world_at(roll, pitch, yaw), T0)[0, 0], pitch, atol=1e-9)


@given(roll=tilt, yaw=turn)
@settings(deadline=None)
def test_lab_roll_is_true_roll_at_zero_pitch(roll: float, yaw: float) -> None:
    np.testing.assert_allclose(lab_angles(world_at(roll, 0, yaw), T0)[0, 1], roll, atol=1e-9)


@given(tilted=tilt, about_roll=st.booleans(), yaw=turn, inclination=inclined)
@settings(deadline=None)
def test_lab_yaw_is_true_yaw_at_zero_tilt(
    tilted: float, about_roll: bool, yaw: float, inclination: float
) -> None:
    roll, pitch = (tilted, 0.0) if about_roll else (0.0, tilted)
    world = world_at(roll, pitch, yaw, inclination)
    np.testing.assert_allclose(lab_angles(world, T0)[0, 2], yaw, atol=1e-7)


def test_lab_roll_is_approximate_at_large_angles() -> None:
    pitch, roll, yaw = lab_angles(world_at(40, 40, 0), T0)[0]
    np.testing.assert_allclose(pitch, 40, atol=1e-9)
    assert abs(roll - 40) > 5
    assert abs(yaw) > 5


@given(roll=turn, pitch=tilt, yaw=turn, roll2=turn, pitch2=tilt, yaw2=turn)
@settings(deadline=None)
def test_rotation_keeps_length_of_vectors(
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
def test_altitude_formula_of_lab_gives_altitude_of_world(metres: float, degc: float, hpa: float) -> None:
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
def test_integrating_rate_gives_angle(angle: float, duration: float) -> None:
    world = World()
    world.rotate_to(0, 0, angle, duration_s=duration)
    t = np.linspace(0, duration, 2001)
    turned = trapezoid(world.angular_rate_dps(t)[:, 2], t)
    np.testing.assert_allclose(turned, angle, atol=1e-3)


EVERYTHING = (
    "rotation",
    "altitude_m",
    "position_m",
    "specific_force_g",
    "angular_rate_dps",
    "magnetic_field_mgauss",
    "pressure_hpa",
    "temperature_degc",
    "board_temperature_degc",
    "relative_humidity_percent",
)
RECORDING = Recording(
    "recording.csv",
    np.array([0.0, 0.3, 0.6]),
    {"pressure": np.array([990.0, 980.0, 985.0]), "attitude": np.array([[0, 0, 0], [9, 0, 0], [9, 5, 0.0]])},
)
CHANGES: tuple[Callable[[World, float], object], ...] = (
    lambda world, size: world.set_attitude(90 * size, 0, 0),
    lambda world, size: world.set_altitude(size),
    lambda world, size: world.set_pressure(900 + size),
    lambda world, size: world.set_temperature(20 + size),
    lambda world, size: world.set_humidity(50 * size),
    lambda world, size: world.set_magnetic_field(20 * size, 0, 40),
    lambda world, size: world.set_hard_iron(100 * size, 0, 0),
    lambda world, size: world.set_soft_iron(np.eye(3) * (1 + size)),
    lambda world, size: world.set_gravity(9 + size),
    lambda world, size: world.put_steel(0.2, size, 0, 0.1),
    lambda world, _: world.take_steel_away(),
    lambda world, size: world.follow_attitude(20, 90 * size, 0),
    lambda world, size: world.follow_altitude(size),
    lambda world, size: world.follow_magnet(0.1 + size, 0, 0),
    lambda world, _: world.take_magnet_away(),
    lambda world, size: world.take_in_hand(tremor_mg=10 * size),
    lambda world, _: world.put_down(),
    lambda world, size: world.run_motors(size),
    lambda world, size: world.rotate_to(90 * size, 0, 0, 0.5),
    lambda world, size: world.sweep("yaw", 90 * size, 0.5),
    lambda world, size: world.figure_eight(0.5 + size),
    lambda world, size: world.turn_over(0.1 + size),
    lambda world, size: world.lift(size, 0.7),
    lambda world, size: world.move(size, -2 * size, size / 2, 0.6),
    lambda world, size: world.free_fall(0.1 + size / 2),
    lambda world, size: world.shake("up", 0.3, 20, 0.1 + size),
    lambda world, size: world.disturb_field(9 * size, 0, 0, 0.3),
    lambda world, _: world.pass_magnet(0.3, 0.05, 2.0),
    lambda world, _: world.replay(RECORDING),
    lambda world, size: world.change_pressure(size, 0.4),
    lambda world, size: world.blow_wind(9 * size, 1.0),
    lambda world, _: world.slam_door(),
)


def wander(world: World, size: float) -> None:
    world.let_pressure_wander(size, seed=3)


@given(
    changes=st.lists(
        st.tuples(st.floats(0.01, 0.5), st.sampled_from(CHANGES), st.sampled_from((0.0, 0.2, 0.9))),
        max_size=6,
    ),
    spans=st.lists(st.tuples(st.floats(0.0, 4.0), st.floats(0.0, 2.0)), min_size=8, max_size=8),
    thermal_s=st.sampled_from((0.0, 0.02, 200.0)),
)
@settings(deadline=None)
def test_world_at_rest_does_not_change(
    changes: list[tuple[float, Callable[[World, float], object], float]],
    spans: list[tuple[float, float]],
    thermal_s: float,
) -> None:
    clock = Clock()
    world = World(clock)
    world.warm_up(5.0, thermal_s)
    for after_s, change, size in changes:
        clock.advance_to(clock.now_ps + to_ps(after_s))
        change(world, size)
    for from_s, lasts_s in spans:
        if world.rests(from_s, from_s + lasts_s):
            for name in EVERYTHING:
                seen = getattr(world, name)(np.linspace(from_s, from_s + lasts_s, 9))
                assert np.all(seen == seen[0]), name


@given(
    changes=st.lists(
        st.tuples(
            st.floats(0.01, 9.0), st.sampled_from((*CHANGES, wander)), st.sampled_from((0.0, 0.2, 0.9))
        ),
        min_size=1,
        max_size=8,
    ),
    share=st.floats(0.0, 0.999),
)
@settings(deadline=None)
def test_past_of_world_never_changes(
    changes: list[tuple[float, Callable[[World, float], object], float]], share: float
) -> None:
    """Later changes never change a quantity at an earlier time, not even in its last bit."""
    clock = Clock()
    world = World(clock)
    past: list[tuple[Array, str, Array]] = []
    for after_s, change, size in changes:
        clock.advance_to(clock.now_ps + to_ps(after_s))
        now_s = clock.now_s
        times = np.array([share * now_s, now_s - 0.3 * after_s, np.nextafter(now_s, 0.0)])
        past += [(times, name, getattr(world, name)(times)) for name in EVERYTHING]
        change(world, size)
        for times, name, before in past:
            assert getattr(world, name)(times).tolist() == before.tolist(), name


def test_ten_minutes_of_hand_motion_are_stored() -> None:
    """A mouse gives 50 commands per second. The first of 30,000 commands is still available."""
    clock = Clock()
    world = World(clock)
    for index in range(30_000):
        clock.advance_to(to_ps(0.02 * (index + 1)))
        world.set_attitude(index % 90, 0, 0)
    rolls = world.attitude_deg(0.02 * (np.arange(30_000) + 1) + 0.001)[:, 0]
    np.testing.assert_allclose(rolls, np.arange(30_000) % 90, atol=1e-9)


def test_dropped_history_of_world_raises_error(monkeypatch: pytest.MonkeyPatch) -> None:
    """The older half of the past is dropped after too many changes. Dropped times raise errors; later times are exact."""
    monkeypatch.setattr(truth, "HISTORY_CHANGES", 1000)
    clock = Clock()
    world = World(clock)
    for second in range(1, 1501):
        clock.advance_to(to_ps(float(second)))
        world.set_altitude(second)
        world.shake("north", 0.1, 20, 0.1)
    with pytest.raises(InputError) as caught:
        world.altitude_m([100.5])
    assert caught.value.kind == "not_kept"
    with pytest.raises(InputError) as caught:
        world.specific_force_g([100.05])
    assert caught.value.kind == "not_kept"
    assert world.altitude_m([1200.5, 1500.5]).tolist() == [1200.0, 1500.0]
    assert world.relative_humidity_percent([0.5]).tolist() == [45.0]  # it never changed
    assert not world.rests(1.0, 2.0)
    assert world.rests(1499.2, 1499.9)


def test_world_is_at_rest_before_and_after_motion() -> None:
    clock = Clock()
    world = World(clock)
    clock.advance_to(to_ps(1.0))
    world.lift(1.0, 0.5)
    clock.advance_to(to_ps(20.0))
    world.set_humidity(30)
    assert world.rests(0.0, 0.9)
    assert not world.rests(0.0, 1.0)
    assert not world.rests(1.2, 9.0)
    assert world.rests(1.6, 19.9)
    assert not world.rests(1.6, 20.0)
    assert world.rests(20.1, 1000.0)
