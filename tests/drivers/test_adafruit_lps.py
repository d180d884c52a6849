"""Adafruit's CircuitPython drivers of the LPS22 (lps2x) and of the LPS35HW, which have the LPS22HB's registers."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import pytest

from fcu_emulator import Board
from fcu_emulator.emulator.adapters import BusioI2C, virtual_time
from tests.support.driver_fakes import SETTLED_S, changes, settled

adafruit_lps2x = pytest.importorskip("adafruit_lps2x", reason="pip install -e '.[test]'")
adafruit_lps35hw = pytest.importorskip("adafruit_lps35hw")

HPA, DEGC = 1 / 4096, 1 / 100  # one LSB (LPS22HB datasheet T3)
RATES_HZ = {1: 1, 2: 10, 3: 25, 4: 50, 5: 75}  # ODR code (LPS22HB datasheet T17)


@pytest.fixture
def board() -> Iterator[Board]:
    board = settled()
    with virtual_time(board, adafruit_lps2x, adafruit_lps35hw):
        yield board


@pytest.fixture(params=["LPS22", "LPS35HW"])
def sensor(board: Board, request: pytest.FixtureRequest) -> Any:
    i2c = BusioI2C(board.i2c2)
    return adafruit_lps2x.LPS22(i2c) if request.param == "LPS22" else adafruit_lps35hw.LPS35HW(i2c)


@pytest.mark.parametrize("hpa", [300.0, 965.2, 1013.25, 1090.017])
@pytest.mark.parametrize("rate", RATES_HZ)
def test_pressure_equals_that_of_world(board: Board, sensor: Any, rate: int, hpa: float) -> None:
    sensor.data_rate = rate
    board.world.set_pressure(hpa)
    board.run_for(2 * SETTLED_S)
    assert sensor.pressure == pytest.approx(hpa, abs=HPA)
    assert sensor.data_rate == rate


@pytest.mark.parametrize("degc", [-20.0, -0.01, 25.0, 61.37])
def test_temperature_equals_that_of_world(board: Board, sensor: Any, degc: float) -> None:
    board.world.set_temperature(degc)
    board.run_for(SETTLED_S)
    assert sensor.temperature == pytest.approx(degc, abs=DEGC)


@pytest.mark.parametrize("rate", RATES_HZ)
def test_data_come_at_rate_set_by_driver(board: Board, sensor: Any, rate: int) -> None:
    sensor.data_rate = rate
    board.run_for(SETTLED_S)
    board.world.lift(metres=100, duration_s=6)
    board.run_for(1.5)
    assert abs(changes(board, lambda: sensor._raw_pressure, 3.0, 0.004) - 3 * RATES_HZ[rate]) <= 1


def test_reset_ends_measuring_and_keeps_data(board: Board, sensor: Any) -> None:
    board.run_for(SETTLED_S)
    before = sensor.pressure
    sensor.reset()
    assert sensor.data_rate == 0
    board.world.set_pressure(900)
    board.run_for(SETTLED_S)
    assert sensor.pressure == before


def test_driver_waits_for_end_of_one_shot(board: Board) -> None:
    """LPS22HB datasheet 9.6: ONE_SHOT clears itself when the data are ready. The driver polls it."""
    sensor = adafruit_lps35hw.LPS35HW(BusioI2C(board.i2c2))
    sensor.data_rate = adafruit_lps35hw.DataRate.ONE_SHOT
    for hpa in (950.0, 1020.0):
        board.world.set_pressure(hpa)
        board.run_for(1)
        started_s = board.now_s
        sensor.take_measurement()
        assert 0.001 < board.now_s - started_s < 0.04
        assert sensor.pressure == pytest.approx(hpa, abs=HPA)


@pytest.mark.parametrize("enabled", [False, True])
def test_steady_pressure_passes_low_pass_filter(board: Board, enabled: bool) -> None:
    sensor = adafruit_lps35hw.LPS35HW(BusioI2C(board.i2c2))
    sensor.low_pass_enabled = enabled
    board.world.set_pressure(987.654)
    board.run_for(10)
    assert sensor.low_pass_enabled == enabled
    assert sensor.pressure == pytest.approx(987.654, abs=HPA)


def test_driver_for_another_sensor_refuses_lps22hb(board: Board) -> None:
    """The LPS25HB's WHO_AM_I is 0xBD, the LPS22HB's 0xB1 (LPS22HB datasheet 9.3)."""
    with pytest.raises(RuntimeError, match="Failed to find LPS2X! Found chip ID 0xb1"):
        adafruit_lps2x.LPS25(BusioI2C(board.i2c2))
