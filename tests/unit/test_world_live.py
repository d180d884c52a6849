"""Changes of a running world: their start, plans that they discard, calls of observers, and their cost."""

from __future__ import annotations

import math
import tracemalloc
from collections.abc import Callable

import numpy as np
import pytest

from fcu_emulator.emulator.clock import Clock, to_ps
from fcu_emulator.emulator.errors import InputError
from fcu_emulator.emulator.world import Recording, World, truth
from tests.support.words import Words


@pytest.fixture
def clock() -> Clock:
    return Clock()


@pytest.fixture
def world(clock: Clock) -> World:
    return World(clock)


def test_setter_changes_present_but_not_past(clock: Clock, world: World) -> None:
    clock.advance_to(to_ps(2.0))
    world.set_attitude(roll_deg=0, pitch_deg=30, yaw_deg=0)
    world.set_temperature(degc=40)
    world.set_altitude(metres=3)
    t = [1.0, np.nextafter(2.0, 0.0), 2.0, 9.0]
    np.testing.assert_allclose(world.attitude_deg(t)[:, 1], [0, 0, 30, 30])
    np.testing.assert_array_equal(world.temperature_degc(t), [25, 25, 40, 40])
    np.testing.assert_array_equal(world.altitude_m(t), [0, 0, 3, 3])
    np.testing.assert_array_equal(world.angular_rate_dps(t), np.zeros((4, 3)))


def test_times_may_be_unordered_or_single(clock: Clock, world: World) -> None:
    world.rotate_to(0, 0, 90, duration_s=1, start_s=1)
    world.set_hard_iron(1, 2, 3)
    t = np.linspace(0, 3, 31)
    shuffled = np.random.default_rng(seed=1).permutation(31)
    for signal in (world.rotation, world.angular_rate_dps, world.magnetic_field_mgauss, world.pressure_hpa):
        np.testing.assert_array_equal(signal(t[shuffled]), signal(t)[shuffled])
        np.testing.assert_array_equal(signal(t[[17]]), signal(t)[[17]])
        assert len(signal(np.array([]))) == 0


def test_results_may_be_changed_by_caller(world: World) -> None:
    world.specific_force_g([0.0])[:] = 99.0
    world.hard_iron_mgauss([0.0])[:] = 99.0
    world.rotation([0.0])[:] = 99.0
    np.testing.assert_array_equal(world.specific_force_g([0.0]), [[0, 0, 1]])
    np.testing.assert_array_equal(world.hard_iron_mgauss([0.0]), [[0, 0, 0]])


def test_setter_cancels_planned_motion_of_its_quantity(clock: Clock, world: World) -> None:
    world.rotate_to(0, 80, 0, duration_s=2, start_s=1)
    world.sweep("yaw", 90, duration_s=2, start_s=5)
    world.lift(2, duration_s=2, start_s=5)
    clock.advance_to(to_ps(2.0))
    world.set_attitude(10, 0, 0)
    np.testing.assert_allclose(world.attitude_deg([2.0, 6.0, 9.0]), [[10, 0, 0]] * 3, atol=1e-12)
    assert world.attitude_deg([1.5])[0, 1] > 1
    assert world.altitude_m([9.0])[0] == 2


def test_change_callback_gets_earliest_changed_time(clock: Clock, world: World) -> None:
    heard: list[float] = []
    world.on_change(heard.append)
    clock.advance_to(to_ps(1.5))
    setters: list[Callable[[], None]] = [
        lambda: world.set_attitude(0, 0, 0),
        lambda: world.set_altitude(0),
        lambda: world.set_pressure(977),
        lambda: world.set_temperature(20),
        lambda: world.set_magnetic_field(1, 2, 3),
        lambda: world.set_hard_iron(1, 2, 3),
        lambda: world.set_soft_iron(np.eye(3)),
        lambda: world.set_gravity(9.81),
    ]
    for setter in setters:
        heard.clear()
        setter()
        assert heard == [1.5]
    rows = Recording("made.csv", np.array([0.5, 1.0]), {"acc": np.zeros((2, 3))})
    motions: list[Callable[[], float]] = [
        lambda: world.rotate_to(0, 0, 10, 1, start_s=4),
        lambda: world.figure_eight(1, start_s=4),
        lambda: world.lift(1, 1, start_s=4),
        lambda: world.shake("west", 1, 10, 1, start_s=4),
        lambda: world.disturb_field(1, 0, 0, 1, start_s=4),
        lambda: world.pass_magnet(1, 1, 1, start_s=4),
        lambda: world.replay(rows, start_s=4),
    ]
    for motion in motions:
        heard.clear()
        motion()
        assert heard == [4.0]


def test_no_signal_changes_before_reported_time(clock: Clock, world: World) -> None:
    heard: list[float] = []
    world.on_change(heard.append)
    t = np.linspace(0, 5, 501)
    for change in (
        lambda: world.rotate_to(10, 20, 30, 1, start_s=3),
        lambda: world.sweep("roll", 40, 1, start_s=2.5),
        lambda: world.shake("up", 1, 10, 1, start_s=2.25),
        lambda: world.set_pressure(977),
    ):
        before = np.column_stack((world.specific_force_g(t), world.pressure_hpa(t)))
        change()
        after = np.column_stack((world.specific_force_g(t), world.pressure_hpa(t)))
        same = t < heard[-1]
        np.testing.assert_array_equal(after[same], before[same])
        assert not np.array_equal(after, before)
        clock.advance_to(to_ps(2.0))


def test_motion_cannot_begin_in_past(clock: Clock, world: World) -> None:
    clock.advance_to(to_ps(3.0))
    with pytest.raises(InputError, match=r"start_s .* 3 s.* not 2\.5") as refused:
        world.lift(1, 1, start_s=2.5)
    assert refused.value.kind == "past"
    almost = math.nextafter(3.0, 0.0)  # seconds converted from picoseconds: the last bit does not make a past
    assert world.lift(1, 1, start_s=almost) == pytest.approx(4.0)


@pytest.mark.parametrize(
    ("setter", "message"),
    [
        (
            lambda w: w.set_attitude(0, math.nan, 0),
            "pitch_deg must be a number from -36000 to 36000 deg, not nan",
        ),
        (lambda w: w.set_attitude("flat", 0, 0), "not 'flat'"),
        (lambda w: w.set_altitude(math.inf), "not inf"),
        (lambda w: w.set_pressure(97740), "hpa must be a number from 10 to 2000 hPa, not 97740"),
        (lambda w: w.set_temperature(298.15), "degc must be a number from -90 to 200 degC, not 298.15"),
        (lambda w: w.set_magnetic_field(0, 1e9, 0), "not 1000000000.0"),
        (lambda w: w.set_hard_iron(0, 0, None), "not None"),
        (lambda w: w.set_soft_iron([1, 1, 1]), "(3,)"),
        (lambda w: w.set_soft_iron([[1, 0], [0, 1, 0]]), "(2,)"),
        (lambda w: w.set_soft_iron([[1, 0, 0], [0, 1, 0], [0, 0, math.nan]]), "not nan"),
        (lambda w: w.set_gravity(-1), "m_s2 must be a number from 0 to 100 m/s2, not -1"),
        (lambda w: World(floor_altitude_m=1e9), "not 1000000000.0"),
    ],
)
def test_absurd_value_is_refused_without_change(
    world: World, setter: Callable[[World], None], message: str, words: Words
) -> None:
    heard: list[float] = []
    world.on_change(heard.append)
    with pytest.raises(InputError) as caught:
        setter(world)
    assert caught.value.kind == ("shape" if message.startswith("(") else "out_of_range")
    assert message in str(caught.value)
    words("python", str(caught.value))
    assert "\n" not in str(caught.value)
    assert heard == []
    np.testing.assert_array_equal(world.specific_force_g([0.0]), [[0, 0, 1]])


def test_recording_replaces_only_its_signals(world: World) -> None:
    rows = Recording(
        "made.csv",
        np.array([1.0, 2.0]),
        {"acc": np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0]]), "pressure": np.array([970.0, 980.0])},
    )
    assert world.replay(rows, start_s=1) == 3.0
    t = [0.5, 1.5, 2.5, 8.0]
    still = [0.0, 0.0, 1.0]
    np.testing.assert_allclose(world.specific_force_g(t), [still, still, [0.5, 0, 0.5], [1, 0, 0]])
    np.testing.assert_allclose(world.pressure_hpa(t[1:]), [970, 975, 980])
    np.testing.assert_array_equal(world.temperature_degc(t), [25] * 4)
    np.testing.assert_array_equal(world.angular_rate_dps(t), np.zeros((4, 3)))


def test_setter_ends_recorded_signal(clock: Clock, world: World) -> None:
    groups = {name: np.full((2, 3), 7.0) for name in ("acc", "gyro", "mag")}
    groups |= {name: np.full(2, 7.0) for name in ("pressure", "temperature")}
    world.replay(Recording("made.csv", np.array([0.0, 1.0]), groups))
    clock.advance_to(to_ps(2.0))
    world.set_pressure(977)
    world.set_hard_iron(0, 0, 0)
    assert world.pressure_hpa([1.0, 2.0]) == pytest.approx([7, 977])
    assert world.magnetic_field_mgauss([2.0])[0, 0] == pytest.approx(215)
    np.testing.assert_array_equal(world.specific_force_g([2.0]), [[7, 7, 7]])
    world.rotate_to(0, 90, 0, duration_s=1, start_s=3)
    np.testing.assert_allclose(world.specific_force_g([2.9, 4.0]), [[7, 7, 7], [-1, 0, 0]], atol=1e-12)
    np.testing.assert_array_equal(world.angular_rate_dps([2.9, 4.0]), [[7, 7, 7], [0, 0, 0]])
    np.testing.assert_array_equal(world.temperature_degc([4.0]), [7])


def test_live_changes_have_bounded_memory(
    clock: Clock, world: World, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(truth, "HISTORY_CHANGES", 400)

    def drag(changes: int) -> int:
        """Return the bytes in use after this number of changes of every kind, five a second."""
        for index in range(changes):
            clock.advance_to(clock.now_ps + to_ps(0.2))
            world.set_attitude(index % 90, 0, 0)
            world.set_altitude(index % 3)
            world.set_pressure(970 + index % 7)
            world.set_hard_iron(index % 5, 0, 0)
            world.shake("up", 0.1, 20, 0.1)
            world.disturb_field(1, 0, 0, duration_s=0.1)
        return tracemalloc.get_traced_memory()[0]

    tracemalloc.start()
    try:
        full = drag(400)
        assert full < 400 * 4_000  # bytes a step of six changes
        assert drag(1000) < 1.1 * full
    finally:
        tracemalloc.stop()
    np.testing.assert_allclose(world.attitude_deg([clock.now_s])[0, 0], 999 % 90)


def test_followed_attitude_is_one_motion(clock: Clock, world: World) -> None:
    """Sensors process the motions of the preceding seconds for each block; here 200 commands are one motion."""
    for index in range(200):
        clock.advance_to(clock.now_ps + to_ps(0.02))
        world.follow_attitude(index % 90, 0, 0)
    motions = world.sensed("acceleration_g").agitated(0.0, math.inf, math.inf)
    assert motions == [(pytest.approx(0.02), pytest.approx(5.0))]


def test_slider_dragged_in_pause_needs_no_memory(world: World) -> None:
    def drag(changes: int) -> int:
        for index in range(changes):
            world.set_attitude(index % 90, 0, 0)
            world.set_pressure(970 + index % 7)
        return tracemalloc.get_traced_memory()[0]

    tracemalloc.start()
    try:
        settled = drag(100)
        assert drag(1000) < settled + 20_000
    finally:
        tracemalloc.stop()
