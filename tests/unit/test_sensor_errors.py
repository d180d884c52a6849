"""Offset, scale, drift and noise: the registers show the numbers that are set."""

from __future__ import annotations

import math
from dataclasses import fields, replace
from typing import Any

import numpy as np
import pytest
from scipy import stats

from fcu_emulator.sensors.errors import QUALITIES, Quality
from fcu_emulator.sensors.lis2mdl import LIS2MDLErrors
from fcu_emulator.sensors.lps22hb import LPS22HBErrors
from fcu_emulator.sensors.lsm6dsl import LSM6DSLErrors
from tests.support.sensor_fakes import (
    ACCELEROMETER,
    GYROSCOPE,
    LIS2MDL_TEMPERATURE,
    LPS22HB_TEMPERATURE,
    LSM6DSL_TEMPERATURE,
    MAGNETOMETER,
    PRESSURE,
    Channel,
    Chip,
    Writes,
)

BIAS, SCALE, BIAS_DRIFT, SCALE_DRIFT = (12.0, -34.0, 56.0), (1.0, -2.0, 3.0), (0.1, -0.2, 0.3), 0.05


def measured(channel: Channel, errors: Any, degc: float, *values: float) -> list[float]:
    """Return the readings of the registers in the signal's unit, with the world at rest."""
    chip = Chip(channel.part, errors)
    chip.set("temperature_degc", degc)
    chip.set(channel.name, *values)
    chip.configure(channel.scales[0][0])
    chip.wait(channel.sample_ps(channel.settled))
    return [channel.zero + count * channel.scales[0][1] for count in chip.counts(channel)]


@pytest.mark.parametrize("degc", [25.0, 45.0, -5.0])
@pytest.mark.parametrize(
    ("channel", "errors", "value", "unit"),
    [
        (ACCELEROMETER, LSM6DSLErrors(BIAS, SCALE, BIAS_DRIFT, SCALE_DRIFT), 1.0, 1e-3),
        (
            GYROSCOPE,
            LSM6DSLErrors(
                gyro_bias_dps=BIAS,
                gyro_scale_percent=SCALE,
                gyro_bias_drift_dps_per_degc=BIAS_DRIFT,
                gyro_scale_drift_percent_per_degc=SCALE_DRIFT,
            ),
            100.0,
            1.0,
        ),
        (MAGNETOMETER, LIS2MDLErrors(BIAS, SCALE, BIAS_DRIFT, SCALE_DRIFT), 4000.0, 1.0),
    ],
    ids=str,
)
def test_bias_scale_and_drift_are_applied(
    channel: Channel, errors: Any, value: float, unit: float, degc: float
) -> None:
    """The value is value * (1 + scale) + bias. Both change linearly with the distance from 25 degC."""
    expected = [
        value * (1 + (scale + SCALE_DRIFT * (degc - 25)) / 100) + (bias + drift * (degc - 25)) * unit
        for scale, bias, drift in zip(SCALE, BIAS, BIAS_DRIFT, strict=True)
    ]

    found = measured(channel, errors, degc, *channel.value(value))

    assert found == pytest.approx(expected, rel=0, abs=0.51 * channel.scales[0][1])


@pytest.mark.parametrize(
    ("channel", "errors", "value", "expected"),
    [
        (PRESSURE, LPS22HBErrors(pressure_bias_hpa=0.5), 1000.0, 1000.5),
        (LPS22HB_TEMPERATURE, LPS22HBErrors(temperature_bias_degc=-1.5), 20.0, 18.5),
        (LSM6DSL_TEMPERATURE, LSM6DSLErrors(temperature_offset_degc=7.0), 20.0, 27.0),
        (LIS2MDL_TEMPERATURE, LIS2MDLErrors(temperature_offset_degc=2.0), 20.0, 22.0),
    ],
    ids=str,
)
def test_pressure_and_temperature_offsets_are_added(
    channel: Channel, errors: Any, value: float, expected: float
) -> None:
    assert measured(channel, errors, 20.0, value) == pytest.approx([expected], rel=0, abs=1e-9)


@pytest.mark.parametrize(
    ("hpa", "degc", "expected"),
    [
        (950.0, 25.0, 950.5),  # the middle of 800 to 1100 hPa: the bias alone
        (1100.0, 25.0, 1100.6),
        (800.0, 25.0, 800.4),
        (950.0, 65.0, 950.6),
        (1100.0, 5.0, 1100.55),
    ],
)
def test_barometer_has_bias_slope_and_drift(hpa: float, degc: float, expected: float) -> None:
    """LPS22HB datasheet T3: absolute, relative, and over temperature."""
    errors = LPS22HBErrors(
        pressure_bias_hpa=0.5, pressure_relative_hpa=0.1, pressure_drift_hpa_per_degc=0.0025
    )
    assert measured(PRESSURE, errors, degc, hpa) == pytest.approx([expected], rel=0, abs=0.51 / 4096)


@pytest.mark.parametrize("seed", range(10))
def test_calibrated_barometer_has_accuracy_of_table_3(seed: int) -> None:
    """+-0.1 hPa, typical, from 0 to 65 degC after a one-point calibration in the middle of the range."""
    errors = replace(LPS22HBErrors.of_quality("worst", seed), pressure_noise_hpa=0.0, odr_percent=0.0)
    bias = errors.pressure_bias_hpa
    found = [measured(PRESSURE, errors, degc, 950.0)[0] - bias - 950.0 for degc in (0.0, 25.0, 65.0)]

    assert abs(found[1]) <= 0.51 / 4096
    assert max(map(abs, found)) == pytest.approx(3 * 0.1, abs=0.51 / 4096)


@pytest.mark.parametrize(
    ("field", "expected"),
    [
        ((1000.0, 0.0, 0.0), (1000.0, 10.0, -20.0)),
        ((0.0, 1000.0, 0.0), (10.0, 1000.0, 5.0)),
        ((0.0, 0.0, 1000.0), (-20.0, 5.0, 1000.0)),
    ],
)
def test_magnetometer_has_cross_axis_error(field: tuple[float, ...], expected: tuple[float, ...]) -> None:
    errors = LIS2MDLErrors(cross_axis_percent=(1.0, -2.0, 0.5))
    assert measured(MAGNETOMETER, errors, 25.0, *field) == pytest.approx(expected, rel=0, abs=0.76)


def test_cross_axis_error_is_scaled_and_shifted() -> None:
    errors = LIS2MDLErrors(
        bias_mgauss=(30.0, 0.0, 0.0), scale_percent=(10.0, 0.0, 0.0), cross_axis_percent=(1.0, 0.0, 0.0)
    )
    found = measured(MAGNETOMETER, errors, 25.0, 1000.0, 3000.0, 0.0)
    assert found == pytest.approx([1.1 * 1030.0 + 30.0, 3010.0, 0.0], rel=0, abs=0.76)


# -- noise ----------------------------------------------------------------------------------------------

XL, G = LSM6DSLErrors(acc_noise_ug_rthz=80.0), LSM6DSLErrors(gyro_noise_mdps_rthz=4.0)
MAG, BARO = LIS2MDLErrors(noise_mgauss=4.5), LPS22HBErrors(pressure_noise_hpa=0.0075)
NOISE = [
    # LSM6DSL datasheet T3: 80 ug/sqrt(Hz) (8 g: 90), bandwidth ODR/2 or that of LPF2 (T68); low power by RMS
    (ACCELEROMETER, XL, ((0x10, 0x40),), 80e-6 * math.sqrt(104 / 2)),
    (ACCELEROMETER, XL, ((0x10, 0x4C),), 90e-6 * math.sqrt(104 / 2)),
    (ACCELEROMETER, XL, ((0x17, 0xC0), (0x10, 0x60)), 80e-6 * math.sqrt(416 / 9)),
    (ACCELEROMETER, XL, ((0x15, 0x10), (0x10, 0x44)), 3.0e-3),
    # 4 mdps/sqrt(Hz) with the cut-off of AN5040 T19; 75 mdps RMS in low power and normal mode
    (GYROSCOPE, G, ((0x11, 0x40),), 4e-3 * math.sqrt(33)),
    (GYROSCOPE, G, ((0x11, 0x70),), 4e-3 * math.sqrt(312)),
    (GYROSCOPE, G, ((0x16, 0x80), (0x11, 0x40)), 75e-3),
    # LIS2MDL datasheet T3
    (MAGNETOMETER, MAG, ((0x60, 0x8C),), 4.5),
    (MAGNETOMETER, MAG, ((0x61, 0x01), (0x60, 0x8C)), 3.0),
    (MAGNETOMETER, MAG, ((0x60, 0x9C),), 9.0),
    (MAGNETOMETER, MAG, ((0x61, 0x01), (0x60, 0x9C)), 6.0),
    # LPS22HB datasheet T3 at 75 Hz with ODR/20; the other two are the model's stated choice
    (PRESSURE, BARO, ((0x10, 0x5C),), 0.0075),
    (PRESSURE, BARO, ((0x10, 0x50),), 0.0105),
    (PRESSURE, BARO, ((0x1A, 0x01), (0x10, 0x50)), 0.0120),
]


@pytest.mark.parametrize(("channel", "errors", "writes", "rms"), NOISE, ids=str)
def test_noise_rms_equals_its_setting(channel: Channel, errors: Any, writes: Writes, rms: float) -> None:
    """2000 samples per axis: the standard error is 1.6 %, and rounding to counts adds less than 2 %."""
    chip = Chip(channel.part, errors, seed=3)
    chip.set(channel.name, *channel.value(0.0))
    chip.configure(writes)
    lsb = chip.part.sample_range(channel.name)[2]
    samples: list[tuple[int, ...]] = []
    while len(samples) < 2000:
        chip.wait(100_000_000)  # 0.1 ms: shorter than any period
        if chip.is_ready(channel):
            samples.append(chip.counts(channel))

    found = np.array(samples) * lsb
    assert found.std(axis=0) == pytest.approx(np.full(channel.axes, rms), rel=0.10)
    assert found.mean(axis=0) == pytest.approx(np.zeros(channel.axes), abs=0.1 * rms + 0.1 * lsb)


def test_noise_of_axes_is_independent() -> None:
    chip = Chip("LSM6DSL", XL)
    chip.configure(ACCELEROMETER.scales[0][0])
    rows = []
    for sample in range(1000):
        chip.t_ps = ACCELEROMETER.sample_ps(sample)
        rows.append(chip.counts(ACCELEROMETER))

    correlation = np.corrcoef(np.array(rows).T)
    assert np.abs(correlation - np.eye(3)).max() < 0.15


# -- grades ---------------------------------------------------------------------------------------------

LIMIT, SIGMA, TYPICAL = 1 / 3, 1.0, 1.0  # standard deviations of many parts, over the document's figure

SIGMAS: dict[type, dict[str, float]] = {
    # the datasheets' Table 3, and what they mean by it: minimum and maximum, or the range of a population; a
    # standard deviation (LSM6DSL 4.6, zero-g level); the column of typical values, which says no more
    LSM6DSLErrors: {
        "acc_bias_mg": 40.0 * SIGMA,
        "acc_scale_percent": 1.0 * LIMIT,
        "acc_bias_drift_mg_per_degc": 0.1 * TYPICAL,
        "acc_scale_drift_percent_per_degc": 0.01 * TYPICAL,
        "gyro_bias_dps": 3.0 * TYPICAL,
        "gyro_scale_percent": 1.0 * LIMIT,
        "gyro_bias_drift_dps_per_degc": 0.015 * TYPICAL,
        "gyro_scale_drift_percent_per_degc": 0.007 * TYPICAL,
        "temperature_offset_degc": 15.0 * LIMIT,
        "odr_percent": 2.5 * TYPICAL,  # of measured parts, here and below
        "misalignment_deg": 1.0 * LIMIT,  # in no document
        "heating_percent": 8.0 * TYPICAL,  # an estimate, here and below
        # the datasheet of the ISM330DHCX
        "acc_cross_axis_percent": 0.5 * TYPICAL,
        "gyro_cross_axis_percent": 0.5 * TYPICAL,
    },
    LIS2MDLErrors: {
        "bias_mgauss": 60.0 * LIMIT,
        "scale_percent": 7.0 * LIMIT,
        "bias_drift_mgauss_per_degc": 0.3 * TYPICAL,
        "scale_drift_percent_per_degc": 0.03 * TYPICAL,
        # in no document: the model's stated assumptions
        "set_reset_offset_mgauss": 120.0 * LIMIT,
        "cross_axis_percent": 1.0 * LIMIT,
        "misalignment_deg": 1.0 * LIMIT,
        "odr_percent": 2.5 * TYPICAL,
        "heating_percent": 8.0 * TYPICAL,
    },
    LPS22HBErrors: {
        "pressure_bias_hpa": 1.0 * TYPICAL,
        "temperature_bias_degc": 1.5 * TYPICAL,
        "pressure_relative_hpa": 0.1 * TYPICAL,
        "pressure_drift_hpa_per_degc": 0.0025 * TYPICAL,  # 0.1 hPa at 65 degC
        "odr_percent": 2.5 * TYPICAL,
        "heating_percent": 8.0 * TYPICAL,
    },
}
NOISE_FIGURES: dict[type, dict[str, float]] = {
    LSM6DSLErrors: {
        "acc_noise_ug_rthz": 80.0,
        "gyro_noise_mdps_rthz": 4.0,
        "acc_bias_instability_ug": 40.0,
        "gyro_bias_instability_dph": 3.0,  # the datasheet of the ISM330DHCX
    },
    LIS2MDLErrors: {"noise_mgauss": 4.5},
    LPS22HBErrors: {"pressure_noise_hpa": 0.0075},
}
SETTINGS: dict[type, dict[str, float]] = {  # the same in every quality
    LSM6DSLErrors: {"gyro_turn_on_ms": 35.0},
    LIS2MDLErrors: {"temperature_offset_degc": 0.0},
    LPS22HBErrors: {},
}
parts = pytest.mark.parametrize("part", SIGMAS, ids=lambda part: part.__name__)


def of_quality(part: Any, quality: Quality, seed: int) -> dict[str, np.ndarray[Any, np.dtype[np.float64]]]:
    errors = part.of_quality(quality, seed)
    return {entry.name: np.atleast_1d(getattr(errors, entry.name)) for entry in fields(errors)}


@parts
def test_every_figure_is_spread_noise_or_setting(part: type[Any]) -> None:
    assert {entry.name for entry in fields(part)} == {*SIGMAS[part], *NOISE_FIGURES[part], *SETTINGS[part]}


@parts
def test_ideal_sensor_is_default(part: type[Any]) -> None:
    assert part.of_quality("ideal", 7) == part()
    figures = of_quality(part, "ideal", 7)
    assert not any(np.any(figures[name]) for name in (*SIGMAS[part], *NOISE_FIGURES[part]))


@parts
@pytest.mark.parametrize("seed", range(20))
def test_typical_is_within_and_worst_at_three_sigma(part: type[Any], seed: int) -> None:
    typical, worst = of_quality(part, "typical", seed), of_quality(part, "worst", seed)

    for name, sigma in SIGMAS[part].items():
        assert np.all(np.abs(typical[name]) <= 3 * sigma)
        assert np.abs(worst[name]) == pytest.approx(3 * sigma)
    for name, figure in NOISE_FIGURES[part].items():
        assert float(typical[name][0]) == figure
        assert float(worst[name][0]) == 1.5 * figure
    for name, figure in SETTINGS[part].items():
        assert float(typical[name][0]) == float(worst[name][0]) == figure


@pytest.mark.parametrize(
    ("figures", "named"),
    [
        ({"gyro_turn_on_ms": -1.0}, r"LSM6DSLErrors\.gyro_turn_on_ms .* 0 to 1000, not -1"),
        ({"odr_percent": 21.0}, r"LSM6DSLErrors\.odr_percent .* -20 to 20, not 21"),
        ({"odr_percent": math.nan}, r"LSM6DSLErrors\.odr_percent .* -20 to 20, not nan"),
    ],
)
def test_impossible_figure_of_sensor_is_refused(figures: dict[str, float], named: str) -> None:
    with pytest.raises(ValueError, match=named):
        LSM6DSLErrors(**figures)


@parts
def test_hundred_sensors_are_spread_as_documented(part: type[Any]) -> None:
    """The figures have a normal distribution that ends at three sigma. The test is the Kolmogorov-Smirnov test.

    Among 40 figures, a probability below 1 % is expected; a probability below 0.01 % is not.
    """
    drawn = [of_quality(part, "typical", seed) for seed in range(100)]
    for name, sigma in SIGMAS[part].items():
        for axis in range(len(drawn[0][name])):
            figures = np.array([errors[name][axis] for errors in drawn]) / sigma
            assert stats.kstest(figures, stats.truncnorm(-3, 3).cdf).pvalue > 1e-4, name
            assert stats.kstest(figures * 3, stats.truncnorm(-3, 3).cdf).pvalue < 1e-4, "would be told"


@parts
def test_worst_sensors_have_errors_of_either_sign(part: type[Any]) -> None:
    signs = {
        float(np.sign(of_quality(part, "worst", seed)[next(iter(SIGMAS[part]))][0])) for seed in range(20)
    }

    assert signs == {-1.0, 1.0}


@parts
def test_unknown_quality_error_lists_known_qualities(part: type[Any]) -> None:
    with pytest.raises(ValueError, match=f"perfect.*{', '.join(QUALITIES)}"):
        part.of_quality("perfect", 0)
