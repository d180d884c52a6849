"""Sensirion's driver of the LPS22 family."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import pytest

from fcu_emulator import Board
from fcu_emulator.emulator.adapters import SensirionI2C, virtual_time
from tests.support.driver_fakes import SETTLED_S, settled

sensirion_i2c_driver = pytest.importorskip("sensirion_i2c_driver", reason="pip install -e '.[test]'")
i2c_channel = pytest.importorskip("sensirion_driver_adapters.i2c_adapter.i2c_channel")
device = pytest.importorskip("sensirion_i2c_lps22.device")

HPA, DEGC = 1 / 4096, 1 / 100  # one LSB (LPS22HB datasheet T3)
CODES = [1, 2, 3, 4, 5]  # ODR 1, 10, 25, 50, 75 Hz (LPS22HB datasheet T17)


@pytest.fixture
def board() -> Iterator[Board]:
    board = settled()
    with virtual_time(board, sensirion_i2c_driver):
        yield board


def driver(board: Board, address: int = 0x5D) -> Any:
    connection = sensirion_i2c_driver.I2cConnection(SensirionI2C(board.i2c2, board.run_for))
    return device.Lps22Device(i2c_channel.I2cChannel(connection, address))


def test_whoami_answers_after_50_ms(board: Board) -> None:
    assert driver(board).whoami() == 0xB1
    assert 0.05 < board.now_s < 0.051


@pytest.mark.parametrize(("hpa", "degc"), [(300.0, -20.0), (1013.25, 25.0), (1090.017, 61.37)])
def test_one_shot_values_equal_those_of_world(board: Board, hpa: float, degc: float) -> None:
    sensor = driver(board)
    board.world.set_temperature(degc)
    board.world.set_pressure(hpa)
    sensor.start_one_shot_measurement()
    assert sensor.read_pressure().value == pytest.approx(hpa, abs=HPA)
    assert sensor.read_temperature().value == pytest.approx(degc, abs=DEGC)


@pytest.mark.parametrize("code", CODES)
def test_continuous_values_equal_those_of_world(board: Board, code: int) -> None:
    """The driver switches the address increment off and reads single bytes."""
    sensor = driver(board)
    board.world.set_pressure(987.654)
    sensor.start_continious_measurement(code)
    board.run_for(SETTLED_S)
    assert sensor.read_pressure_single_bytes().value == pytest.approx(987.654, abs=HPA)
    assert sensor.read_temperature_single_bytes().value == pytest.approx(25.0, abs=DEGC)


def test_burst_without_increment_repeats_its_first_byte(board: Board) -> None:
    """LPS22HB datasheet 9.6, IF_ADD_INC. The driver's documentation has a warning about it."""
    sensor = driver(board)
    board.world.set_pressure(1000 + 0x5A / 4096)
    sensor.start_continious_measurement(5)
    board.run_for(SETTLED_S)
    assert sensor.read_pressure().value == 0x5A5A5A / 4096
    sensor.activate_multi_byte_read()
    assert sensor.read_pressure().value == pytest.approx(1000, abs=0.1)


def test_status_shows_new_data_until_they_are_read(board: Board) -> None:
    sensor = driver(board)
    sensor.start_one_shot_measurement()
    board.run_for(0.1)
    assert (sensor.status().P_DA, sensor.status().T_DA) == (1, 1)
    sensor.read_pressure()
    assert (sensor.status().P_DA, sensor.status().T_DA) == (0, 1)
    sensor.read_temperature()
    assert (sensor.status().P_DA, sensor.status().T_DA) == (0, 0)


def test_reset_ends_continuous_measurement(board: Board) -> None:
    sensor = driver(board)
    sensor.start_continious_measurement(3)
    sensor.swreset()
    board.run_for(0.1)
    assert sensor.get_ctrl_reg1().ODR == 0
    assert sensor.get_ctrl_reg2().IF_ADD_INC == 1


def test_absent_sensor_raises_driver_error(board: Board) -> None:
    with pytest.raises(sensirion_i2c_driver.errors.I2cNackError):
        driver(board, address=0x5C).whoami()
