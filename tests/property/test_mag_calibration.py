"""Invariants of MagCalibration, and agreement with a slow oracle that stores every sample."""

from __future__ import annotations

import math
from fractions import Fraction

from hypothesis import given, settings
from hypothesis import strategies as st

from fcu_emulator.firmware_model.ecompass import MagCalibration
from fcu_emulator.firmware_model.sensor_data import AxesRaw_TypeDef

DETERMINISTIC = settings(derandomize=True, database=None, deadline=None, max_examples=200)

Vector = tuple[int, int, int]
axis = st.integers(-49152, 49150)  # int16 * 1.5 mgauss
earth_axis = st.integers(
    -9999, 9999
)  # inside the slides' starting extremes, as any field near the earth's is
samples = st.lists(st.tuples(axis, axis, axis), min_size=1, max_size=30)
earth_samples = st.lists(st.tuples(earth_axis, earth_axis, earth_axis), min_size=1, max_size=30)


class Calibration:
    """The slides' globals mag_min and mag_max. ``feed`` takes a sample and returns the calibrated sample."""

    def __init__(self) -> None:
        self.mag_min = AxesRaw_TypeDef(10000, 10000, 10000)
        self.mag_max = AxesRaw_TypeDef(-10000, -10000, -10000)

    def feed(self, sample: Vector) -> Vector:
        mag = AxesRaw_TypeDef(*sample)
        MagCalibration(mag, self.mag_min, self.mag_max)
        return mag.AXIS_X, mag.AXIS_Y, mag.AXIS_Z

    @property
    def extremes(self) -> tuple[Vector, Vector]:
        low, high = self.mag_min, self.mag_max
        return (low.AXIS_X, low.AXIS_Y, low.AXIS_Z), (high.AXIS_X, high.AXIS_Y, high.AXIS_Z)


def fed(sequence: list[Vector]) -> Calibration:
    calibration = Calibration()
    for sample in sequence:
        calibration.feed(sample)
    return calibration


def oracle(history: list[Vector]) -> Vector:
    """Return the last sample minus the centre of all samples so far, in exact arithmetic."""

    def corrected(values: tuple[int, ...]) -> int:
        centre = Fraction(max(-10000, *values) + min(10000, *values), 2)
        return values[-1] - math.trunc(centre)

    x, y, z = map(corrected, zip(*history, strict=True))
    return x, y, z


@DETERMINISTIC
@given(samples)
def test_every_sample_agrees_with_oracle(sequence: list[Vector]) -> None:
    calibration = Calibration()
    for count, sample in enumerate(sequence, start=1):
        assert calibration.feed(sample) == oracle(sequence[:count])


@DETERMINISTIC
@given(earth_axis, earth_axis, earth_axis)
def test_first_sample_gives_zero(x: int, y: int, z: int) -> None:
    assert Calibration().feed((x, y, z)) == (0, 0, 0)


def test_odd_sum_is_divided_toward_zero() -> None:
    assert fed([(-3, 3, 0)]).feed((0, 0, 0)) == (1, -1, 0)  # -3/2 = -1, 3/2 = 1 (C11 6.5.5)


@DETERMINISTIC
@given(samples.flatmap(lambda sequence: st.tuples(st.just(sequence), st.permutations(sequence))))
def test_centre_does_not_depend_on_order(orders: tuple[list[Vector], list[Vector]]) -> None:
    sequence, reordered = orders
    assert fed(reordered).extremes == fed(sequence).extremes


@DETERMINISTIC
@given(samples)
def test_feeding_same_samples_again_changes_no_extreme(sequence: list[Vector]) -> None:
    assert fed(sequence * 2).extremes == fed(sequence).extremes


@DETERMINISTIC
@given(earth_samples)
def test_calibrated_extremes_are_symmetric_about_zero(sequence: list[Vector]) -> None:
    calibration = fed(sequence)
    low, high = calibration.extremes
    lowest, highest = calibration.feed(low), calibration.feed(high)
    for a, b, below, above in zip(low, high, lowest, highest, strict=True):
        assert above - below == b - a
        assert abs(above + below) <= 1  # centred, but for the half that the division drops


@DETERMINISTIC
@given(earth_samples, st.integers(-2000, 2000).map(lambda half: 2 * half))
def test_hard_iron_offset_disappears(sequence: list[Vector], offset: int) -> None:
    def inside(sample: Vector) -> Vector:
        x, y, z = (value // 2 for value in sample)
        return x, y, z

    clean = [inside(sample) for sample in sequence]
    shifted = [(x + offset, y + offset, z + offset) for x, y, z in clean]
    for expected, got in zip(fed(clean).feed(clean[0]), fed(shifted).feed(shifted[0]), strict=True):
        assert abs(got - expected) <= 1  # an odd sum is dropped toward zero on either side of it
