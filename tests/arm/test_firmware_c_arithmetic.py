"""The arithmetic of the C firmware, compiled for this computer, equals the arithmetic of the Python model in every bit.

The lab's arithmetic has single-precision scaling, integer pressure and temperature, and float32 stores of doubles.
"""

from __future__ import annotations

import ctypes
import math
import shutil
import struct
import subprocess
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from fcu_emulator.firmware_model import arm
from fcu_emulator.firmware_model.c_semantics import f32
from fcu_emulator.firmware_model.drivers.lps22hb import pressure_hpa, temperature_degc
from fcu_emulator.firmware_model.ecompass import (
    MAG_MAX_START,
    MAG_MIN_START,
    MagCalibration,
    eCompass,
    getAltitude,
)
from fcu_emulator.firmware_model.sensor_data import (
    ACC_MG_PER_LSB,
    GYRO_MDPS_PER_LSB,
    MAG_MGAUSS_PER_LSB,
    AxesRaw,
    scale_table,
    unpack_axes,
)

pytestmark = pytest.mark.skipif(shutil.which("gcc") is None, reason="gcc is not installed")

GLOBALS = '#include "motion.h"\nAxesRaw_TypeDef acc, mag;\nfloat press_zero_level;\n'
FLAGS = ("-O2", "-std=gnu11", "-ffp-contract=off", "-shared", "-fPIC", "-lm")

int16 = st.integers(-0x8000, 0x7FFF)
milli_g = st.integers(-4000, 4000)
milligauss = st.integers(-50_000, 50_000)


class Axes(ctypes.Structure):
    """The C structure ``AxesRaw_TypeDef``."""

    _fields_ = (("AXIS_X", ctypes.c_int32), ("AXIS_Y", ctypes.c_int32), ("AXIS_Z", ctypes.c_int32))

    def values(self) -> tuple[int, int, int]:
        return self.AXIS_X, self.AXIS_Y, self.AXIS_Z


@pytest.fixture(scope="module")
def c(tmp_path_factory: pytest.TempPathFactory) -> ctypes.CDLL:
    """Return a library with the pure parts of the firmware: conversion.c of support/, motion.c of solution/."""
    folder = tmp_path_factory.mktemp("arithmetic")
    (folder / "globals.c").write_text(GLOBALS)
    support, solution = arm.sources() / "support", arm.sources() / "solution"
    library = folder / "arithmetic.so"
    files = (folder / "globals.c", support / "conversion.c", solution / "motion.c")
    includes = (f"-I{support}", f"-I{solution}")
    subprocess.run(["gcc", *includes, *map(str, files), *FLAGS, "-o", str(library)], check=True)
    return loaded(library)


def loaded(library: Path) -> ctypes.CDLL:
    c = ctypes.CDLL(str(library))
    c.PressureFromBytes.restype = c.TemperatureFromBytes.restype = c.getAltitude.restype = ctypes.c_float
    c.getAltitude.argtypes = (ctypes.c_float, ctypes.c_float)
    c.AxesFromBytes.argtypes = (ctypes.c_char_p, ctypes.c_float, ctypes.POINTER(Axes))
    return c


def set_axes(c: ctypes.CDLL, name: str, values: tuple[int, int, int]) -> None:
    axes = Axes.in_dll(c, name)
    axes.AXIS_X, axes.AXIS_Y, axes.AXIS_Z = values


def bits(value: float) -> bytes:
    """Return the bits of the float32, which distinguish 0.0 from -0.0. All NaN are equal."""
    return b"nan" if math.isnan(value) else struct.pack("<f", value)


@pytest.mark.parametrize("per_lsb", [ACC_MG_PER_LSB, GYRO_MDPS_PER_LSB, MAG_MGAUSS_PER_LSB])
@given(raw=st.tuples(int16, int16, int16))
def test_c_scales_and_turns_axes_as_python_does(
    c: ctypes.CDLL, per_lsb: float, raw: tuple[int, int, int]
) -> None:
    data, axes, scale = struct.pack("<hhh", *raw), Axes(), scale_table(per_lsb)
    c.AxesFromBytes(data, per_lsb, ctypes.byref(axes))
    x, y, z = unpack_axes(data)

    assert axes.values() == (-scale[y], scale[x], scale[z])


@given(raw=st.integers(-0x80_0000, 0x7F_FFFF))
def test_c_converts_pressure_as_python_does(c: ctypes.CDLL, raw: int) -> None:
    assert c.PressureFromBytes(raw.to_bytes(3, "little", signed=True)) == pressure_hpa(raw)


def test_pressure_equals_value_on_slides(c: ctypes.CDLL) -> None:
    """The raw value 4003431 prints 977.400024."""
    assert f"{c.PressureFromBytes((4003431).to_bytes(3, 'little')):f}" == "977.400024"


@given(raw=int16)
def test_c_converts_temperature_as_python_does(c: ctypes.CDLL, raw: int) -> None:
    assert c.TemperatureFromBytes(raw.to_bytes(2, "little", signed=True)) == temperature_degc(raw)


@given(acc=st.tuples(milli_g, milli_g, milli_g), mag=st.tuples(milligauss, milligauss, milligauss))
def test_angles_are_equal_in_every_bit(
    c: ctypes.CDLL, acc: tuple[int, int, int], mag: tuple[int, int, int]
) -> None:
    set_axes(c, "acc", acc)
    set_axes(c, "mag", mag)
    c.eCompass()
    angles = [ctypes.c_float.in_dll(c, name).value for name in ("pitch", "roll", "azimuth")]

    assert list(map(bits, angles)) == list(map(bits, eCompass(AxesRaw(*acc), AxesRaw(*mag), 1.0)))


@given(press=st.floats(0, 1300, width=32), zero_level=st.floats(250, 1300, width=32), raw_temperature=int16)
def test_altitude_is_equal_in_every_bit(
    c: ctypes.CDLL, press: float, zero_level: float, raw_temperature: int
) -> None:
    temperature = temperature_degc(raw_temperature)
    ctypes.c_float.in_dll(c, "press_zero_level").value = zero_level

    assert bits(c.getAltitude(press, temperature)) == bits(getAltitude(press, temperature, zero_level))


@given(samples=st.lists(st.tuples(milligauss, milligauss, milligauss), min_size=1, max_size=20))
def test_c_calibrates_every_sample_as_python_does(
    c: ctypes.CDLL, samples: list[tuple[int, int, int]]
) -> None:
    least, most = AxesRaw(*[MAG_MIN_START] * 3), AxesRaw(*[MAG_MAX_START] * 3)
    set_axes(c, "mag_min", (MAG_MIN_START,) * 3)
    set_axes(c, "mag_max", (MAG_MAX_START,) * 3)
    for sample in samples:
        mag = AxesRaw(*sample)
        MagCalibration(mag, least, most)
        set_axes(c, "mag", sample)
        c.MagCalibration()

        assert Axes.in_dll(c, "mag").values() == (mag.AXIS_X, mag.AXIS_Y, mag.AXIS_Z)


def test_f32_of_python_model_equals_c_float() -> None:
    assert f32(0.122) == ctypes.c_float(0.122).value
