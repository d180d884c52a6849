"""eCompass: ranges, symmetries, physics, and an independent implementation in numpy."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from fcu_emulator.firmware_model.ecompass import eCompass
from fcu_emulator.firmware_model.sensor_data import AxesRaw_TypeDef

DETERMINISTIC = settings(derandomize=True, database=None, deadline=None, max_examples=200)

Vector = tuple[int, int, int]
anything = st.integers(-(2**31) + 1, 2**31 - 1) | st.integers(-2, 2)
mg = st.integers(-4000, 4000)
mgauss = st.integers(-1000, 1000)
any_vectors = st.tuples(anything, anything, anything)
acc_vectors = st.tuples(mg, mg, mg)
mag_vectors = st.tuples(mgauss, mgauss, mgauss)
mus = st.floats(0.01, 1.0)
angles_deg = st.floats(-180, 180)
tilts_deg = st.floats(-90, 90)

FIELD = (210, 0, -430)  # mgauss, x to magnetic north, z up: central Europe
SCALE = 1_000_000  # integers per g or gauss in the physics tests, so that quantisation is no excuse
TOLERANCE_DEG = 0.001


def angles(acc: Vector, mag: Vector = (0, 0, 0), mu: float = 1.0) -> tuple[float, float, float]:
    return eCompass(AxesRaw_TypeDef(*acc), AxesRaw_TypeDef(*mag), mu)


def difference_deg(a: float, b: float) -> float:
    return abs((a - b + 180) % 360 - 180)


def in_numpy(acc: NDArray[np.int64], mag: NDArray[np.int64], mu: float) -> NDArray[np.float32]:
    """Return the lab's angles for (n, 3) arrays: computed in float64, with results stored in float32."""

    def single(values: NDArray[np.float64]) -> NDArray[np.float64]:
        return values.astype(np.float32).astype(np.float64)

    g_x, g_y, g_z = acc.T.astype(np.float64)
    b_x, b_y, b_z = mag.T.astype(np.float64)
    pitch = single(np.arctan2((-acc[:, 0]).astype(np.float64), np.sqrt(g_y**2 + g_z**2)))
    roll = single(np.arctan2(g_y, np.sqrt(mu * g_x**2 + g_z**2)))
    by2 = single(b_z * np.sin(roll) - b_y * np.cos(roll))
    bz2 = single(b_y * np.sin(roll) + b_z * np.cos(roll))
    bx3 = single(b_x * np.cos(pitch) + bz2 * np.sin(pitch))
    yaw = single(np.arctan2(by2, bx3))
    return (np.column_stack((pitch, roll, yaw)) * (180 / np.pi)).astype(np.float32)


@DETERMINISTIC
@given(any_vectors, any_vectors, mus)
def test_angles_are_finite_float32_in_range(acc: Vector, mag: Vector, mu: float) -> None:
    pitch, roll, yaw = angles(acc, mag, mu)
    assert abs(pitch) <= 90
    assert abs(roll) <= 90
    assert abs(yaw) <= 180
    assert [float(np.float32(angle)) for angle in (pitch, roll, yaw)] == [pitch, roll, yaw]


@DETERMINISTIC
@given(st.lists(st.tuples(acc_vectors, mag_vectors), min_size=1, max_size=40), mus)
def test_angles_agree_with_independent_implementation(pairs: list[tuple[Vector, Vector]], mu: float) -> None:
    acc, mag = (np.array(vectors, dtype=np.int64) for vectors in zip(*pairs, strict=True))
    expected = in_numpy(acc, mag, mu)
    got = np.array([angles(*pair, mu) for pair in pairs])
    # Not "equal": numpy's vector sin may differ from math.h's in the last bit of a double.
    assert np.abs((got - expected + 180) % 360 - 180).max() <= 3e-5


@pytest.mark.parametrize(
    ("acc", "pitch", "roll"),
    [
        ((0, 0, 1000), 0.0, 0.0),
        ((-1000, 0, 0), 90.0, 0.0),
        ((1000, 0, 0), -90.0, 0.0),
        ((0, 1000, 0), 0.0, 90.0),
        ((0, -1000, 0), 0.0, -90.0),
        ((-707, 0, 707), 45.0, 0.0),
        ((0, 707, 707), 0.0, 45.0),
        ((0, 0, -1000), 0.0, 0.0),  # upside down looks flat: the lab's formula cannot tell
        ((0, 0, 0), 0.0, 0.0),
    ],
)
def test_angles_of_tilt_about_one_axis_are_exact(acc: Vector, pitch: float, roll: float) -> None:
    assert angles(acc)[:2] == (pitch, roll)


@pytest.mark.parametrize(
    ("mag", "yaw"), [((200, 0, -400), 0.0), ((0, -200, -400), 90.0), ((0, 200, -400), -90.0)]
)
def test_yaw_grows_counter_clockwise_from_magnetic_north(mag: Vector, yaw: float) -> None:
    assert angles((0, 0, 1000), mag)[2] == yaw  # facing west (+90), the field lies along the board's -Y


def test_flat_board_gives_no_negative_zero() -> None:
    assert [math.copysign(1.0, angle) for angle in angles((0, 0, 1000))] == [1.0, 1.0, 1.0]


@DETERMINISTIC
@given(acc_vectors, mus)
def test_pitch_and_roll_are_odd_functions_of_axis(acc: Vector, mu: float) -> None:
    x, y, z = acc
    pitch, roll, _ = angles(acc, mu=mu)
    assert angles((-x, y, z), mu=mu)[:2] == (-pitch, roll)
    assert angles((x, -y, z), mu=mu)[:2] == (pitch, -roll)
    assert angles((x, y, -z), mu=mu)[:2] == (pitch, roll)


@DETERMINISTIC
@given(acc_vectors)
def test_each_angle_has_sign_of_its_axis(acc: Vector) -> None:
    pitch, roll, _ = angles(acc)
    assert np.sign(pitch) == np.sign(-acc[0])
    assert np.sign(roll) == np.sign(acc[1])


@DETERMINISTIC
@given(mag_vectors)
def test_quarter_turn_adds_90_degrees_to_yaw(mag: Vector) -> None:
    x, y, z = mag
    assume(x or y)
    turns = [(x, y, z), (y, -x, z), (-x, -y, z), (-y, x, z)]
    yaws = [angles((0, 0, 1000), turn)[2] for turn in turns]
    for before, after in zip(yaws, yaws[1:] + yaws[:1], strict=True):
        assert difference_deg(after, before + 90) <= 3e-5


@DETERMINISTIC
@given(acc_vectors, mag_vectors, st.integers(2, 50))
def test_size_of_gravity_does_not_matter(acc: Vector, mag: Vector, factor: int) -> None:
    x, y, z = (component * factor for component in acc)
    for small, large in zip(angles(acc, mag)[:2], angles((x, y, z), mag)[:2], strict=True):
        assert abs(small - large) <= 1e-5


def board_frame(yaw: float, pitch: float, roll: float) -> tuple[Vector, Vector]:
    """Return the measurements of a board that was turned by yaw, then pitch, then roll about its own axes."""
    to_board = Rotation.from_euler("ZYX", [yaw, pitch, roll], degrees=True).inv()
    acc, mag = to_board.apply([[0, 0, SCALE], np.multiply(FIELD, SCALE / 1000)]).round().astype(int).tolist()
    return (acc[0], acc[1], acc[2]), (mag[0], mag[1], mag[2])


@DETERMINISTIC
@given(angles_deg, tilts_deg, angles_deg)
def test_pitch_is_euler_pitch_in_every_attitude(yaw: float, pitch: float, roll: float) -> None:
    assert difference_deg(angles(*board_frame(yaw, pitch, roll))[0], pitch) <= TOLERANCE_DEG


@DETERMINISTIC
@given(angles_deg, tilts_deg)
def test_roll_and_yaw_are_euler_at_zero_pitch(yaw: float, roll: float) -> None:
    _, got_roll, got_yaw = angles(*board_frame(yaw, 0.0, roll))
    assert difference_deg(got_roll, roll) <= TOLERANCE_DEG
    assert difference_deg(got_yaw, yaw) <= TOLERANCE_DEG


@DETERMINISTIC
@given(angles_deg, tilts_deg)
def test_yaw_is_euler_yaw_at_zero_roll(yaw: float, pitch: float) -> None:
    _, got_roll, got_yaw = angles(*board_frame(yaw, pitch, 0.0))
    assert abs(got_roll) <= TOLERANCE_DEG
    assert difference_deg(got_yaw, yaw) <= TOLERANCE_DEG


def test_roll_is_approximation_when_both_are_tilted() -> None:
    _, roll, _ = angles(*board_frame(0.0, 60.0, 60.0))
    # sin(60) cos(60) = 0.4330; sqrt(0.75 + 0.0625) = 0.9014; the slides' formula shows 25.66 degrees
    assert roll == pytest.approx(25.66, abs=0.01)


@DETERMINISTIC
@given(acc_vectors, mus, mus)
def test_smaller_mu_never_reduces_roll(acc: Vector, mu_a: float, mu_b: float) -> None:
    small, large = sorted((mu_a, mu_b))
    assert abs(angles(acc, mu=small)[1]) >= abs(angles(acc, mu=large)[1])


@DETERMINISTIC
@given(acc_vectors, mus)
def test_mu_affects_gx_only_in_roll(acc: Vector, mu: float) -> None:
    x, y, z = acc
    assert angles(acc, mu=mu)[0] == angles(acc)[0]
    assert angles((0, y, z), mu=mu) == angles((0, y, z))
    assume(y)
    tangent = abs(y) / math.sqrt(mu * x * x + z * z) if x or z else math.inf
    assert abs(angles(acc, mu=mu)[1]) == pytest.approx(math.degrees(math.atan(tangent)), abs=1e-5)


def test_mu_keeps_roll_steady_at_90_degrees_pitch() -> None:
    """Question 3: with Gy and Gz near 0, noise of Gy would change the roll a lot without the mu term."""
    assert angles((1000, 1, 0), mu=1.0)[1] == pytest.approx(0.057, abs=0.001)
    assert angles((1000, 1, 0), mu=0.01)[1] == pytest.approx(0.573, abs=0.001)
