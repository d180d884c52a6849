"""Noise of every sensor after its filters: strength, correlation, and independence of the times of reads.

Density and RMS come from the datasheets (Table 3 of each: LSM6DSL DocID028475 Rev 7, LIS2MDL DocID030621 Rev 3,
LPS22HB DocID027083 Rev 6), bandwidths come from AN5040 (Tables 10 and 19) and the registers. The equivalent noise
bandwidth of a second-order Butterworth low-pass is pi / (2 sqrt 2) = 1.11 times its cut-off.
"""

from __future__ import annotations

import math
from dataclasses import replace
from fractions import Fraction
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fcu_emulator.sensors.lis2mdl import LIS2MDLErrors
from fcu_emulator.sensors.lps22hb import LPS22HBErrors
from fcu_emulator.sensors.lsm6dsl import LSM6DSLErrors
from tests.support.sensor_fakes import (
    ACCELEROMETER,
    GYROSCOPE,
    MAGNETOMETER,
    PRESSURE,
    PS_PER_S,
    Array,
    Channel,
    Chip,
    Writes,
)

CTRL1_XL, CTRL2_G, CTRL4_C, CTRL6_C, CTRL7_G, CTRL8_XL = 0x10, 0x11, 0x13, 0x15, 0x16, 0x17
CFG_REG_A, CFG_REG_B, CTRL_REG1 = 0x60, 0x61, 0x10
NOISY: dict[str, Any] = {
    "LSM6DSL": LSM6DSLErrors(acc_noise_ug_rthz=80.0, gyro_noise_mdps_rthz=4.0),
    "LIS2MDL": LIS2MDLErrors(noise_mgauss=4.5),
    "LPS22HB": LPS22HBErrors(pressure_noise_hpa=0.0075),
}
BUTTERWORTH = math.pi / (2 * math.sqrt(2))
LAB3 = ((CTRL8_XL, 0xE0), (CTRL2_G, 0x6C), (CTRL1_XL, 0xA8))


def still(channel: Channel, writes: Writes, count: int, skip: int, seed: int = 5) -> Array:
    """Return ``count`` samples of a world that is zero, in the signal's unit, (count, axes)."""
    chip = Chip(channel.part, NOISY[channel.part], seed)
    chip.set(channel.name, *channel.value(0.0))
    chip.configure(writes)
    rows = []
    for number in range(skip, skip + count):
        chip.t_ps = channel.sample_ps(number)
        rows.append(chip.counts(channel))
    return np.array(rows) * chip.part.sample_range(channel.name)[2]


def rms(samples: Array) -> float:
    """Return the RMS over all axes."""
    return float(np.sqrt(np.mean(samples**2)))


def at(channel: Channel, rate_hz: float) -> Channel:
    return replace(channel, rate_hz=Fraction(rate_hz))


XL_416, XL_6664, XL_208 = (at(ACCELEROMETER, rate_hz) for rate_hz in (416, 6664, 208))
LOW_POWER = (CTRL6_C, 0x10)
SETTINGS: list[tuple[Channel, Writes, float]] = [
    # density times the root of the bandwidth, in g and dps
    (XL_416, ((CTRL1_XL, 0x60),), 80e-6 * math.sqrt(416 / 2)),
    (XL_416, ((CTRL1_XL, 0x64),), 130e-6 * math.sqrt(416 / 2)),
    (XL_416, ((CTRL8_XL, 0xC0), (CTRL1_XL, 0x60)), 80e-6 * math.sqrt(BUTTERWORTH * 416 / 9)),
    (XL_6664, ((CTRL8_XL, 0xE0), (CTRL1_XL, 0xA0)), 80e-6 * math.sqrt(BUTTERWORTH * 6664 / 400)),
    (XL_6664, ((CTRL1_XL, 0xA1),), 80e-6 * math.sqrt(BUTTERWORTH * 400)),
    (at(GYROSCOPE, 416), ((CTRL2_G, 0x60),), 4e-3 * math.sqrt(137)),
    (
        at(GYROSCOPE, 6664),
        ((CTRL4_C, 0x02), (CTRL6_C, 0x02), (CTRL2_G, 0xA0)),
        4e-3 * math.sqrt(BUTTERWORTH * 173),
    ),
    # low power and normal mode: at ODR/2, and 0.6 times that at ODR/9; the gyroscope's at any rate
    (XL_208, (LOW_POWER, (CTRL1_XL, 0x50)), 1.8e-3),
    (XL_208, (LOW_POWER, (CTRL8_XL, 0xC0), (CTRL1_XL, 0x58)), 0.6 * 2.0e-3),
    (XL_208, (LOW_POWER, (CTRL8_XL, 0xC0), (CTRL1_XL, 0x5C)), 0.6 * 2.4e-3),
    (at(GYROSCOPE, 52), ((CTRL7_G, 0x80), (CTRL2_G, 0x30)), 75e-3),
    (at(GYROSCOPE, 208), ((CTRL7_G, 0x80), (CTRL2_G, 0x50)), 75e-3),
    # high resolution and low power, each without and with a filter, in mgauss
    (MAGNETOMETER, ((CFG_REG_A, 0x8C),), 4.5),
    (MAGNETOMETER, ((CFG_REG_B, 0x01), (CFG_REG_A, 0x8C)), 3.0),
    (MAGNETOMETER, ((CFG_REG_B, 0x02), (CFG_REG_A, 0x8C)), 3.0),
    (MAGNETOMETER, ((CFG_REG_A, 0x9C),), 9.0),
    (MAGNETOMETER, ((CFG_REG_B, 0x01), (CFG_REG_A, 0x9C)), 6.0),
    # in hPa; the datasheet has the first alone, the others are chosen (sensors/lps22hb/barometer.py)
    (PRESSURE, ((CTRL_REG1, 0x5C),), 0.0075),
    (
        PRESSURE,
        ((CTRL_REG1, 0x58),),
        0.0075 * 1.2,
    ),
    (PRESSURE, ((CTRL_REG1, 0x50),), 0.0075 * 1.4),
]


@pytest.mark.parametrize(("channel", "writes", "expected"), SETTINGS, ids=str)
def test_noise_rms_equals_datasheet(channel: Channel, writes: Writes, expected: float) -> None:
    """The RMS over 10 s. One slow axis with a narrow filter has few independent samples, so four sensors are used."""
    seeds = range(4) if channel.axes == 1 else (5,)
    count = int(10 * channel.rate_hz)
    samples = [still(channel, writes, count, skip=500, seed=seed) for seed in seeds]
    assert rms(np.concatenate(samples)) == pytest.approx(expected, rel=0.10)


@pytest.mark.parametrize(
    ("ctrl8", "low", "high"),
    [(0x00, -0.05, 0.05), (0xC0, 0.80, 0.92), (0x80, 0.985, 1.0), (0x04, -0.55, -0.45)],
)
def test_successive_samples_are_correlated_by_filter(ctrl8: int, low: float, high: float) -> None:
    """Cases: white noise; ODR/9 (0.87 for the analog prototype); ODR/50; slope, (x[n] - x[n-1]) / 2, with -1/2."""
    samples = still(XL_416, ((CTRL8_XL, ctrl8), (CTRL1_XL, 0x60)), 4000, skip=200)
    correlation = float(np.sum(samples[1:] * samples[:-1]) / np.sum(samples**2))
    assert low < correlation < high


def lab3() -> Chip:
    chip = Chip("LSM6DSL", NOISY["LSM6DSL"], seed=5)
    chip.configure(LAB3)
    return chip


MOMENTS = st.lists(st.integers(1, 20 * PS_PER_S), min_size=1, max_size=8)
CHANGES = st.lists(st.tuples(st.integers(1, 20 * PS_PER_S), st.booleans()), min_size=1, max_size=8)


@settings(max_examples=15)
@given(MOMENTS)
def test_lab_samples_do_not_depend_on_reads(moments: list[int]) -> None:
    often = lab3()
    for t_ps in sorted(moments):
        often.t_ps = t_ps
        alone = lab3()
        alone.t_ps = t_ps
        for channel in (ACCELEROMETER, GYROSCOPE):
            assert often.counts(channel) == alone.counts(channel)


@settings(max_examples=15)
@given(CHANGES)
def test_lab_samples_do_not_depend_on_recomputation(changes: list[tuple[int, bool]]) -> None:
    disturbed, left_alone = lab3(), lab3()
    for t_ps, told_when in sorted(changes):
        disturbed.t_ps = left_alone.t_ps = t_ps
        disturbed.part.world_changed(t_ps if told_when else None)
        for channel in (ACCELEROMETER, GYROSCOPE):
            assert disturbed.counts(channel) == left_alone.counts(channel)
