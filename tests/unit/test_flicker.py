"""Bias instability: the floor of the Allan deviation, and values that depend only on time."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fcu_emulator.sensors.errors import PartErrors
from fcu_emulator.sensors.front_end import Flicker
from fcu_emulator.sensors.lsm6dsl import LSM6DSLErrors
from tests.support.sensor_fakes import ACCELEROMETER, GYROSCOPE, PS_PER_S, Array, Channel, Chip
from tests.support.signal_chain import allan_deviation

FLOOR = np.sqrt(2 * np.log(2) / np.pi)  # of the Allan deviation, over the bias instability: IEEE Std 952


def wandering(seconds: int, seeds: int = 8) -> Array:
    """Return the values of 3 axes of some boards, once a second, (n, axes)."""
    t_s = np.arange(seconds) + 0.3
    boards = [Flicker(seed, "part", channels=3, bias_instability=1.0).block(t_s) for seed in range(seeds)]
    return np.concatenate(boards).T


@pytest.mark.parametrize("m", [10, 30, 100, 300])
def test_flicker_allan_deviation_is_constant_over_time(m: int) -> None:
    """24 axes over three hours give the mean to a few percent."""
    found = np.sqrt(np.mean(allan_deviation(wandering(10_000), m) ** 2))
    assert found == pytest.approx(FLOOR, rel=0.1)


def test_independent_program_finds_same_noise_floor() -> None:
    allantools = pytest.importorskip("allantools")
    found = [
        allantools.oadev(axis, rate=1.0, data_type="freq", taus=[30, 100])[1] for axis in wandering(10_000).T
    ]
    np.testing.assert_allclose(np.sqrt(np.mean(np.square(found), axis=0)), FLOOR, rtol=0.1)


@given(
    starts=st.lists(st.integers(-100, 10_000), min_size=1, max_size=6),
    rate_hz=st.sampled_from([1.6, 104, 6664]),
)
def test_value_depends_only_on_its_time(starts: list[int], rate_hz: float) -> None:
    everywhere = Flicker(3, "part", channels=3, bias_instability=1.0)
    for start in starts:
        t_s = start + np.arange(200) / rate_hz
        alone = Flicker(3, "part", channels=3, bias_instability=1.0)
        np.testing.assert_array_equal(everywhere.block(t_s)[:, 50:60], alone.block(t_s[50:60]))


def test_flicker_of_axes_and_boards_is_independent() -> None:
    correlation = np.corrcoef(wandering(10_000, seeds=2).T)
    assert (
        np.abs(correlation - np.eye(6)).max() < 0.6
    )  # three hours are short for a drift with a period of an hour


@pytest.mark.parametrize(
    ("channel", "errors", "instability"),
    [
        (ACCELEROMETER, LSM6DSLErrors(acc_bias_instability_ug=40_000.0), 40e-3),
        (GYROSCOPE, LSM6DSLErrors(gyro_bias_instability_dph=36_000.0), 10.0),
    ],
    ids=str,
)
def test_wander_of_sensor_equals_its_figure(channel: Channel, errors: PartErrors, instability: float) -> None:
    """The figure is a thousand times larger here, so that differences of means exceed the steps of the output."""
    chip = Chip(channel.part, errors, seed=1)
    chip.set(channel.name, *channel.value(0.0))
    chip.configure(channel.scales[0][0])
    rows = []
    for second in range(2, 1200):
        chip.t_ps = second * PS_PER_S
        rows.append(chip.counts(channel))
    readings = np.array(rows) * channel.scales[0][1]
    found = np.sqrt(np.mean(allan_deviation(readings, 20) ** 2))
    assert found == pytest.approx(FLOOR * instability, rel=0.35)
