"""Sensors that are slightly turned on their board: they measure the true vector in turned axes."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from fcu_emulator import Board
from fcu_emulator.sensors import SENSORS, Sensor
from fcu_emulator.sensors.lsm6dsl import LSM6DSLErrors
from tests.support.scenario_files import write

HEAD = "schema = 1\nquestion = '?'\nduration = '2s'\n[sensors]\nquality = 'ideal'\n"


@pytest.mark.parametrize("turned_deg", [(1.0, 0.0, 0.0), (0.0, -0.7, 0.0), (0.3, 0.5, -1.0)])
def test_turned_sensor_measures_in_its_turned_axes(turned_deg: tuple[float, float, float]) -> None:
    """Compared with scipy's rotation. The model is of first order, whose error at 1 degree is 2e-4."""
    found = LSM6DSLErrors(misalignment_deg=turned_deg).mounted()
    exact = Rotation.from_rotvec(np.radians(turned_deg)).inv().as_matrix()
    np.testing.assert_allclose(found, exact, atol=2e-4)


def test_misaligned_sensor_measures_tilted_gravity(tmp_path: Path) -> None:
    """The sensor is turned about its X axis: Y measures the sine of 1 degree of gravity."""
    figures = "[sensors.lsm6dsl]\nmisalignment_deg = [1, 0, 0]\n"
    board = Board(scenario=write(tmp_path, HEAD + figures))
    board.run_for(1.9)
    raw = board.sensors["LSM6DSL"].read(0x28, 6, board.clock.now_ps)
    x, y, z = np.frombuffer(raw, "<i2") * 0.122
    assert x == pytest.approx(0, abs=0.1)
    assert y == pytest.approx(1000 * np.sin(np.radians(1)), abs=0.1)
    assert z == pytest.approx(1000, abs=0.2)


@pytest.mark.parametrize("part", SENSORS.values(), ids=lambda part: part.NAME)
def test_ideal_sensors_and_barometers_are_not_turned(part: type[Sensor]) -> None:
    np.testing.assert_array_equal(part.ERRORS().mounted(), np.eye(3))
    has_axes = any(quantity.axes == 3 for quantity in part.SIGNALS)
    assert np.any(part.ERRORS.of_quality("typical", 1).mounted() != np.eye(3)) == has_axes
