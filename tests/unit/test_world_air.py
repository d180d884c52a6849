"""Weather, wind and doors change the pressure and no other quantity."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from fcu_emulator import Board
from fcu_emulator.emulator.errors import InputError
from fcu_emulator.emulator.world import World


def test_weather_changes_pressure_at_every_height() -> None:
    world, higher = World(), World()
    higher.set_altitude(100)
    before = np.array([one.pressure_hpa([0.0])[0] for one in (world, higher)])
    for one in (world, higher):
        assert one.change_pressure(-3.0, duration_s=60, start_s=10) == 70
        middle, after = one.pressure_hpa([40.0])[0], one.pressure_hpa([70.0, 500.0])
        first = one.pressure_hpa([0.0])[0]
        np.testing.assert_allclose(after - first, np.repeat(-3.0 * first / before[0], 2))
        np.testing.assert_allclose(middle, (first + after[0]) / 2)
    np.testing.assert_array_equal(higher.altitude_m([100.0]), 100)


def test_gusts_are_slow_with_quarter_of_wind_pressure() -> None:
    """rho v^2 / 2 is 0.6 hPa at 10 m/s. Most of the power is below 0.5 Hz."""
    world = World()
    still = world.pressure_hpa([0.0])
    assert world.blow_wind(10, duration_s=400) == 400
    t_s = np.arange(2, 398, 0.1)
    gusts = world.pressure_hpa(t_s) - still
    assert np.sqrt(np.mean(gusts**2)) == pytest.approx(0.15, rel=0.1)
    assert abs(gusts.mean()) < 0.02
    power = np.abs(np.fft.rfft(gusts)) ** 2
    hz = np.fft.rfftfreq(len(t_s), 0.1)
    assert power[hz < 0.5].sum() > 0.9 * power.sum()
    assert power[hz > 1.1].sum() < 1e-2 * power.sum()
    np.testing.assert_allclose(world.pressure_hpa([0.0, 400.0, 401.0]), np.repeat(still, 3), atol=1e-9)
    slower = World()
    slower.blow_wind(5, duration_s=400)
    np.testing.assert_allclose(slower.pressure_hpa(t_s) - still, gusts / 4, atol=1e-9)


def test_slammed_door_changes_pressure_for_about_1_s() -> None:
    world = World()
    still = world.pressure_hpa([0.0])
    end_s = world.slam_door(0.2, start_s=5)
    push = world.pressure_hpa([5.0, 5.15, 6.0, end_s - 1e-6, end_s]) - still
    np.testing.assert_allclose(push, [0, 0.2, 0.0046, 0, 0], atol=1e-4)
    assert world.pressure_hpa(np.arange(5, 7, 0.01)).max() - still == pytest.approx(0.2, abs=1e-3)


def test_pressure_disturbances_add_up_without_other_effects() -> None:
    world, other = World(), World()
    world.blow_wind(8, duration_s=20)
    world.slam_door(start_s=10)
    t_s = np.linspace(0, 20, 101)
    np.testing.assert_array_equal(world.specific_force_g(t_s), other.specific_force_g(t_s))
    np.testing.assert_array_equal(world.altitude_m(t_s), other.altitude_m(t_s))
    both = world.pressure_hpa(t_s) - other.pressure_hpa(t_s)
    wind, door = World(), World()
    wind.blow_wind(8, duration_s=20)
    door.slam_door(start_s=10)
    alone = wind.pressure_hpa(t_s) + door.pressure_hpa(t_s) - 2 * other.pressure_hpa(t_s)
    np.testing.assert_allclose(both, alone, atol=1e-9)


WANDER_HPA = 0.02
MEAN_CHANGE_PA_S = 0.44 / 6  # between 0.01 and 0.1 Hz; outside in wind up to 0.44 (Atmosphere 7, 2016, 125)


def wandering(rms_hpa: float = WANDER_HPA, seed: int = 1) -> World:
    world = World()
    world.let_pressure_wander(rms_hpa, seed)
    return world


def test_pressure_wander_has_published_spectrum() -> None:
    """The spectrum is f^-2 from 0.0006 to 0.5 Hz: compare a periodogram's levels, and the mean change at 0.01 to 0.1 Hz."""
    t_s = np.arange(0, 2**14, 0.5)
    hz = np.fft.rfftfreq(t_s.size, 0.5)
    powers, changes = [], []
    for seed in range(24):
        pa = 100 * (wandering(seed=seed).pressure_hpa(t_s) - World().pressure_hpa([0.0]))
        spectrum = np.fft.rfft(pa * np.hanning(t_s.size))
        powers.append(np.abs(spectrum) ** 2)
        band = (hz > 0.01) & (hz < 0.1)
        lines = np.fft.rfft(pa)
        changes.append(np.abs(np.fft.irfft(np.where(band, 2j * np.pi * hz * lines, 0))).mean())
        assert pa.std() == pytest.approx(100 * WANDER_HPA, rel=0.15)
    power = np.mean(powers, axis=0)
    octaves = 0.001 * 2.0 ** np.arange(9)  # to 0.256 Hz
    levels = np.array([power[(hz >= low) & (hz < 2 * low)].mean() for low in octaves])
    np.testing.assert_allclose(levels * octaves**2, np.median(levels * octaves**2), rtol=0.35)
    assert power[hz > 0.55].sum() < 1e-4 * power.sum()
    assert np.mean(changes) == pytest.approx(MEAN_CHANGE_PA_S, rel=0.1)


def test_pressure_wander_depends_only_on_time_and_seed() -> None:
    t_s = np.random.default_rng(1).uniform(0, 1e6, 200)
    first = wandering().pressure_hpa(t_s)
    single = [float(wandering().pressure_hpa([one])[0]) for one in t_s]
    assert first.tolist() == single
    assert np.abs(first - wandering(seed=2).pressure_hpa(t_s)).max() > WANDER_HPA
    still = World().pressure_hpa([0.0])
    np.testing.assert_allclose(wandering(2 * WANDER_HPA).pressure_hpa(t_s) - still, 2 * (first - still))


def test_pressure_wander_changes_no_other_signal() -> None:
    world, other = wandering(), World()
    t_s = np.linspace(0, 100, 51)
    assert world.rests(1.0, 100.0)
    np.testing.assert_array_equal(world.altitude_m(t_s), other.altitude_m(t_s))
    np.testing.assert_array_equal(world.specific_force_g(t_s), other.specific_force_g(t_s))


def test_averages_on_typical_board_change_within_hour() -> None:
    """Averages of 100 s, as altitudes: decimetres in a typical room, 0 on an ideal board."""
    t_s = np.arange(0, 3600, 0.5)
    spread = {
        ideal: [
            8.4 * Board(seed=seed, ideal=ideal).world.pressure_hpa(t_s).reshape(-1, 200).mean(axis=1).std()
            for seed in range(8)
        ]
        for ideal in (False, True)
    }
    assert 0.08 < min(spread[False]) < max(spread[False]) < 0.3
    assert max(spread[True]) == 0.0


def test_scenario_sets_pressure_wander(tmp_path: Path) -> None:
    path = tmp_path / "one.toml"
    head = 'schema = 1\nquestion = "?"\nduration = "1s"\n'
    path.write_text(head + "[board]\npressure_wander_hpa = 0.1\n", encoding="utf-8")
    t_s = np.arange(0, 2000, 0.5)
    assert Board(scenario=path).world.pressure_hpa(t_s).std() == pytest.approx(0.1, rel=0.2)


@pytest.mark.parametrize(
    ("ask", "name"),
    [
        (lambda w: w.change_pressure(-2000, 10), "change_hpa"),
        (lambda w: w.change_pressure(1, 0), "duration_s"),
        (lambda w: w.blow_wind(-1, 10), "speed_m_s"),
        (lambda w: w.slam_door(float("nan")), "push_hpa"),
        (lambda w: w.let_pressure_wander(-0.1), "rms_hpa"),
    ],
)
def test_impossible_air_is_refused(ask: object, name: str) -> None:
    with pytest.raises(InputError, match=name):
        ask(World())  # type: ignore[operator]
