"""A board in a hand: its position relative to the wrist, and its acceleration, by numerical derivatives."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from fcu_emulator.emulator.clock import Clock, to_ps
from fcu_emulator.emulator.errors import InputError
from fcu_emulator.emulator.world import Recording, World
from fcu_emulator.emulator.world.track import Array

G = 9.80665
WRIST = np.array([0.03, -0.1, 0.02])
INSIDE_S = np.linspace(0.1, 3.9, 77) + 0.0013

MOTIONS: dict[str, Callable[[World], object]] = {
    "none": lambda w: None,
    "rotate_to": lambda w: w.rotate_to(-40, 70, 170, duration_s=4),
    "linear sweep": lambda w: w.sweep("roll", 85, duration_s=4),
    "smooth sweep": lambda w: w.sweep("yaw", 390, duration_s=4, profile="minimum_jerk"),
    "figure_eight": lambda w: w.figure_eight(duration_s=4),
    "figure_eight by a hand": lambda w: w.figure_eight(duration_s=4, turns=2, by="hand"),
    "turn_over": lambda w: w.turn_over(duration_s=4),
    "followed": lambda w: w.follow_attitude(80, -30, 120, time_constant_s=2.0),
    "lifted": lambda w: (w.lift(2.0, duration_s=4), w.rotate_to(60, 0, 0, duration_s=3)),
}


def held(motion: Callable[[World], object], tremor_mg: float) -> World:
    world = World()
    world.set_attitude(10, 20, 30)
    world.set_altitude(1.0)
    world.take_in_hand(WRIST, tremor_mg, 8.0)
    motion(world)
    return world


def position_m(world: World, t_s: Array) -> Array:
    """Return the position of the sensors on a hand that moves only up and down, computed from the attitude."""
    place = world.rotation(t_s) @ -WRIST
    hand_m = world.altitude_m(t_s) - place[:, 2]
    return np.stack((place[:, 0], place[:, 1], place[:, 2] + hand_m), axis=1)


@pytest.mark.parametrize("tremor_mg", [0.0, 10.0])
@pytest.mark.parametrize("name", MOTIONS)
def test_force_is_second_derivative_of_position(name: str, tremor_mg: float) -> None:
    world = held(MOTIONS[name], tremor_mg)
    h = 5e-5
    before, here, after = (position_m(world, INSIDE_S + step) for step in (-h, 0.0, h))
    acceleration = (before - 2 * here + after) / h**2
    felt = np.einsum("nji,nj->ni", world.rotation(INSIDE_S), acceleration + np.array([0, 0, G])) / G
    np.testing.assert_allclose(world.specific_force_g(INSIDE_S), felt, atol=2e-6)


@pytest.mark.parametrize("name", MOTIONS)
def test_trembling_rate_is_derivative_of_rotation(name: str) -> None:
    world = held(MOTIONS[name], 10.0)
    h = 1e-5
    before = Rotation.from_matrix(world.rotation(INSIDE_S - h))
    after = Rotation.from_matrix(world.rotation(INSIDE_S + h))
    numerical = np.degrees((before.inv() * after).as_rotvec()) / (2 * h)
    np.testing.assert_allclose(world.angular_rate_dps(INSIDE_S), numerical, atol=1e-3)


def test_turntable_gives_centripetal_acceleration() -> None:
    """360 deg/s, 0.1 m from the axis: w^2 r towards the wrist, which is behind the board."""
    world = World()
    world.take_in_hand((0, -0.1, 0), tremor_mg=0)
    world.sweep("yaw", 360, duration_s=1)
    force = world.specific_force_g([0.5])[0]
    np.testing.assert_allclose(force, [0, -((2 * np.pi) ** 2) * 0.1 / G, 1], atol=1e-12)
    np.testing.assert_allclose(world.linear_acceleration_g([0.5]), (2 * np.pi) ** 2 * 0.1 / G)


def test_board_turned_up_about_wrist_rises() -> None:
    world = World()
    world.take_in_hand((0, -0.1, 0), tremor_mg=0)
    before_hpa = world.pressure_hpa([0.0])
    world.rotate_to(90, 0, 0, duration_s=1)
    np.testing.assert_allclose(world.altitude_m([1.0]), 0.1)
    assert world.pressure_hpa([1.0]) < before_hpa


def test_height_is_continuous_when_hand_takes_or_releases() -> None:
    clock = Clock()
    world = World(clock)
    world.set_attitude(50, 20, 0)
    world.set_altitude(0.7)
    world.take_in_hand(WRIST)
    np.testing.assert_allclose(world.altitude_m([0.0]), 0.7)
    world.rotate_to(-60, 0, 0, duration_s=1)
    clock.advance_to(to_ps(2.0))
    held_m = world.altitude_m([2.0])
    assert abs(held_m - 0.7) > 0.05
    world.take_in_hand((0, -0.3, 0))
    np.testing.assert_allclose(
        world.altitude_m([2.0]), held_m, atol=1e-4
    )  # a tremor's thousandths of degrees
    world.put_down()
    np.testing.assert_allclose(world.altitude_m([2.0, 9.0]), np.repeat(held_m, 2), atol=1e-4)
    world.take_in_hand(WRIST)
    world.rotate_to(0, 70, 0, duration_s=1)
    clock.advance_to(to_ps(4.0))
    world.set_altitude(2.0)
    np.testing.assert_allclose(world.altitude_m([4.0]), 2.0, atol=1e-12)


def test_released_board_moves_as_without_hand() -> None:
    world, other = World(), World()
    world.take_in_hand(tremor_mg=35, start_s=0.0)
    world.put_down(start_s=1.0)
    for one in (world, other):
        one.rotate_to(40, -20, 100, duration_s=1, start_s=1.5)
    t_s = np.linspace(1.0, 3.0, 41)
    np.testing.assert_array_equal(world.specific_force_g(t_s), other.specific_force_g(t_s))
    np.testing.assert_array_equal(world.rotation(t_s), other.rotation(t_s))


@pytest.mark.parametrize(("peak_mg", "hz"), [(10.0, 8.0), (35.0, 11.0)])
def test_tremor_has_measured_strength_and_frequency(peak_mg: float, hz: float) -> None:
    """The RMS equals the RMS of a sinusoid with this peak. The spectrum is within 2.5 Hz about the frequency."""
    world = World()
    world.take_in_hand((0, -0.086, 0), peak_mg, hz)
    t_s = np.arange(1.0, 41.0, 0.005)
    up_mg = 1000 * (world.specific_force_g(t_s)[:, 2] - 1)
    assert np.sqrt(np.mean(up_mg**2)) == pytest.approx(peak_mg / np.sqrt(2), rel=0.15)
    power = np.abs(np.fft.rfft(up_mg - up_mg.mean())) ** 2
    line_hz = np.fft.rfftfreq(len(t_s), 0.005)
    inside = (line_hz > hz - 1.4) & (line_hz < hz + 1.4)
    assert power[inside].sum() > 0.97 * power.sum()
    assert 0.01 < np.degrees(np.arccos(world.rotation(t_s)[:, 2, 2])).max() < 0.3


def test_tremor_starts_smoothly() -> None:
    world = World()
    world.take_in_hand()
    np.testing.assert_allclose(world.specific_force_g([0.0, 1e-9]), [[0, 0, 1]] * 2, atol=1e-9)
    np.testing.assert_allclose(world.angular_rate_dps([0.0, 1e-9]), np.zeros((2, 3)), atol=1e-6)


def test_recorded_turn_in_hand_gives_centripetal_acceleration() -> None:
    world = World()
    world.take_in_hand((0, -0.1, 0), tremor_mg=0)
    world.replay(
        Recording("turn.csv", np.array([0.0, 1.0]), {"attitude": np.array([[0, 0, 0], [0, 0, 90.0]])})
    )
    pull_g = (np.pi / 2) ** 2 * 0.1 / G
    np.testing.assert_allclose(world.specific_force_g([0.5]), [[0, -pull_g, 1]], atol=1e-12)


def test_motionless_world_without_hand_gives_one_row() -> None:
    world = World()
    for quantity in ("acceleration_g", "angular_rate_dps", "magnetic_field_mgauss", "pressure_hpa"):
        assert len(world.sensed(quantity, one_row=True)(np.arange(9.0))) == 1


@pytest.mark.parametrize(
    "change",
    [
        {"wrist_m": (0, 1)},
        {"wrist_m": (0, 3, 0)},
        {"tremor_mg": -1},
        {"tremor_hz": 0},
        {"wrist_m": (0, "a", 0)},
    ],
)
def test_impossible_hand_is_refused(change: dict[str, object]) -> None:
    with pytest.raises(InputError, match=next(iter(change))):
        World().take_in_hand(**change)  # type: ignore[arg-type]


def test_sensors_sample_finely_only_while_hand_trembles() -> None:
    clock = Clock()
    world = World(clock)
    felt = world.sensed("acceleration_g")
    world.take_in_hand(tremor_mg=10, tremor_hz=8)
    assert felt.agitated(100.0, 101.0, pace_s=0.1)  # half a period of 9 Hz is faster than that
    assert not felt.agitated(100.0, 101.0, pace_s=0.05)
    clock.advance_to(to_ps(50.0))
    world.put_down()
    assert not felt.agitated(100.0, 101.0, pace_s=0.1)
    assert felt.agitated(50.0, 51.0, pace_s=0.0) or felt.agitated(49.0, 51.0, pace_s=0.1)


@pytest.mark.parametrize("yaw", range(0, 360, 45))
def test_figure_of_eight_by_hand_finds_hard_iron(yaw: int) -> None:
    """The result is the middle of the extremes, as in the lab's MagCalibration; the board returns to its start."""
    world = World()
    world.set_attitude(0, 0, yaw)
    world.set_hard_iron(120, -80, 45)
    world.figure_eight(12, turns=2, by="hand")
    seen = world.magnetic_field_mgauss(np.linspace(0, 12, 2401))
    error = np.abs((seen.max(axis=0) + seen.min(axis=0)) / 2 - [120, -80, 45])
    assert 2 < error.max() < 35
    np.testing.assert_allclose(world.rotation([12.0]), world.rotation([0.0]), atol=1e-12)
    assert np.abs(world.angular_rate_dps(np.linspace(0, 12, 2401))).max() < 500  # what a hand can do


def test_figure_of_eight_by_unknown_limb_is_refused() -> None:
    with pytest.raises(InputError, match="'foot'") as refused:
        World().figure_eight(4, by="foot")  # type: ignore[arg-type]
    assert refused.value.kind == "choice"


def test_observers_see_one_change_when_hand_releases() -> None:
    """No observer sees the height of a board that is both in the hand and put down."""
    world = held(MOTIONS["none"], 0.0)
    world.rotate_to(60, 40, 0, duration_s=0.5)
    clock_s = 1.0
    before = world.altitude_m([clock_s])
    seen: list[float] = []
    world.on_change(lambda from_s: seen.append(float(world.altitude_m([clock_s])[0])))
    world.put_down(start_s=clock_s)

    assert seen == pytest.approx([float(before[0])])
