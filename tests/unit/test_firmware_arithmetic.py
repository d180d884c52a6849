"""C arithmetic: scaling, pressure, temperature, altitude, single precision."""

from __future__ import annotations

import math

import numpy as np
import pytest

from fcu_emulator.firmware_model.c_semantics import c_pow, f32, float_divide, int_divide
from fcu_emulator.firmware_model.drivers.lps22hb import pressure_hpa, temperature_degc
from fcu_emulator.firmware_model.ecompass import getAltitude
from fcu_emulator.firmware_model.sensor_data import (
    ACC_MG_PER_LSB,
    GYRO_MDPS_PER_LSB,
    MAG_MGAUSS_PER_LSB,
    scale_table,
)


@pytest.mark.parametrize("sensitivity", [ACC_MG_PER_LSB, GYRO_MDPS_PER_LSB, MAG_MGAUSS_PER_LSB])
def test_scaling_equals_truncated_single_precision_product(sensitivity: float) -> None:
    raw = np.arange(0x10000, dtype=np.uint16).view(np.int16)
    expected = np.trunc(raw.astype(np.float32) * np.float32(sensitivity)).astype(np.int32)
    assert scale_table(sensitivity) == tuple(expected.tolist())


def test_sensitivities_are_those_of_lab() -> None:
    assert (ACC_MG_PER_LSB, GYRO_MDPS_PER_LSB, MAG_MGAUSS_PER_LSB) == (0.122, 70.0, 1.5)


def test_truncation_of_odd_field_values_is_toward_zero() -> None:
    table = scale_table(MAG_MGAUSS_PER_LSB)  # odd raw gives +-(3k + 1), never 2 mod 3
    assert [table[raw & 0xFFFF] for raw in (-3, -1, 0, 1, 3)] == [-4, -1, 0, 1, 4]


@pytest.mark.parametrize(
    ("raw", "printed"),
    [
        (4003431, "977.400024"),  # 97740 becomes 977.400024
        (4003471, "977.400024"),
        (0, "0.000000"),
        (-4096, "-1.000000"),
        (-40, "0.000000"),  # int32 truncation toward zero, and the integer 0 has no sign
        (-(2**23), "-2048.000000"),
        (2**23 - 1, "2047.989990"),  # (raw * 100) / 4096 = 204799
    ],
)
def test_pressure_is_printed_as_on_slides(raw: int, printed: str) -> None:
    assert f"{pressure_hpa(raw):f}" == printed


def test_pressure_equals_single_precision_over_range() -> None:
    raw = np.arange(260 * 4096, 1260 * 4096, 997, dtype=np.int32)
    expected = (raw * np.int32(100) // np.int32(4096)).astype(np.float32) / np.float32(100)
    assert [pressure_hpa(value) for value in raw.tolist()] == expected.tolist()


@pytest.mark.parametrize(
    ("raw", "printed"),
    [
        (2159, "21.500000"),
        (-2159, "-21.500000"),
        (-9, "0.000000"),
        (2123, "21.200001"),
        (-32768, "-327.600006"),
    ],
)
def test_temperature_is_truncated_to_tenths(raw: int, printed: str) -> None:
    assert f"{temperature_degc(raw):f}" == printed


def test_altitude_of_floor_is_exactly_zero() -> None:
    assert math.copysign(1.0, getAltitude(977.4, 21.5, 977.4)) == 1.0
    assert getAltitude(977.4, 21.5, 977.4) == 0.0


def test_altitude_is_correct_in_standard_atmosphere() -> None:
    # ICAO: 898.746 hPa and 8.5 degC at 1000 m, 1013.25 hPa at 0 m
    assert getAltitude(898.746, 8.5, 1013.25) == pytest.approx(1000, abs=2)


@pytest.mark.parametrize("press", [260.0, 900.0, 976.2, 977.39, 1260.0])
@pytest.mark.parametrize("temperature", [-10.0, 21.5])
def test_altitude_equals_hypsometric_formula(press: float, temperature: float) -> None:
    # h = ((P0/P)^(1/5.257) - 1) * (T + 273.15) / 0.0065, here by way of logarithms
    expected = math.expm1((math.log(977.4) - math.log(press)) / 5.257) * (temperature + 273.15) / 0.0065
    assert getAltitude(press, temperature, 977.4) == pytest.approx(expected, rel=1e-6)


@pytest.mark.parametrize(
    ("press", "zero_level", "expected"),
    [(0.0, 977.4, math.inf), (0.0, 0.0, math.nan), (-1.0, 977.4, math.nan), (977.4, 0.0, -45330.77)],
)
def test_altitude_of_absurd_pressures_is_same_in_c(press: float, zero_level: float, expected: float) -> None:
    assert getAltitude(press, 21.5, zero_level) == pytest.approx(expected, nan_ok=True)


@pytest.mark.parametrize("value", [0.1, -0.0, 1e39, -1e39, 1e-46, 3.4028235677973366e38, math.inf])
def test_f32_rounds_as_numpy_does(value: float) -> None:
    with np.errstate(over="ignore", under="ignore"):
        expected = float(np.float32(value))
    assert (f32(value), math.copysign(1.0, f32(value))) == (expected, math.copysign(1.0, value))


def test_f32_keeps_nan() -> None:
    assert math.isnan(f32(math.nan))


@pytest.mark.parametrize(
    ("a", "b", "quotient"), [(7, 2, 3), (-7, 2, -3), (7, -2, -3), (-7, -2, 3), (0, -3, 0)]
)
def test_int_divide_truncates_toward_zero(a: int, b: int, quotient: int) -> None:
    assert int_divide(a, b) == quotient  # C11 6.5.5


@pytest.mark.parametrize(
    ("a", "b", "quotient"),
    [(1.0, 0.0, math.inf), (-1.0, 0.0, -math.inf), (1.0, -0.0, -math.inf), (1.0, 4.0, 0.25)],
)
def test_float_divide_by_zero_is_infinity(a: float, b: float, quotient: float) -> None:
    assert float_divide(a, b) == quotient


def test_undefined_quotients_and_powers_are_nan() -> None:
    assert math.isnan(float_divide(0.0, 0.0))
    assert math.isnan(float_divide(math.nan, 0.0))
    assert math.isnan(c_pow(-2.0, 0.5))
    assert c_pow(2.0, 0.5) == math.sqrt(2.0)
