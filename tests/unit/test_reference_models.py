"""Independent programs recover the inputs of the sensors; ``python -m tests.support.reference_models`` prints results."""

from __future__ import annotations

import pytest

from tests.support import reference_models


@pytest.fixture(scope="module")
def moved() -> reference_models.Moved:
    return reference_models.moved_by_hand()


@pytest.mark.parametrize(
    ("name", "moved_deg", "gravity_deg"),
    [
        ("accelerometer alone", (3.0, 9.0), 0.2),
        ("imufusion", (0.0, 1.0), 0.3),
        ("ahrs, Madgwick", (0.0, 2.0), 0.5),
    ],
)
def test_filters_recover_attitude_of_moved_board(
    moved: reference_models.Moved, name: str, moved_deg: tuple[float, float], gravity_deg: float
) -> None:
    """The tilt is correct at rest.

    In motion, its error is caused by the acceleration: without acceleration, the error is gone.
    """
    pytest.importorskip(reference_models.FILTERS[name][0])
    still, waved, without_motion = reference_models.attitude_errors(moved, name)
    assert still < 0.5  # a tremor, of 10 mg at most
    assert moved_deg[0] < waved < moved_deg[1]
    assert without_motion < min(waved, gravity_deg)


def test_passing_magnet_equals_dipole_of_magpylib() -> None:
    pytest.importorskip("magpylib")
    difference, field = reference_models.magnet_difference_mgauss()
    assert difference < 1e-6 * field


def test_earth_field_equals_published_test_values() -> None:
    """The field agrees to 0.1 nT, the last digit of NCEI's test values."""
    pytest.importorskip("wmm")
    difference, field = reference_models.field_difference_nt()
    assert field > 40_000
    assert difference < 0.1
