"""Adafruit's CircuitPython driver of the LSM6DS family: its class LSM6DS3TR-C, which has the same WHO_AM_I."""

from __future__ import annotations

from collections.abc import Iterator
from math import degrees

import pytest

from fcu_emulator import Board
from fcu_emulator.emulator.adapters import BusioI2C, virtual_time
from tests.support.driver_fakes import (
    ATTITUDES,
    G_M_S2,
    SETTLED_S,
    Vector,
    acceleration_g,
    board_axes,
    changes,
    rate_dps,
    settled,
    within,
)

adafruit_lsm6ds = pytest.importorskip("adafruit_lsm6ds", reason="pip install -e '.[test]'")
lsm6ds3trc = pytest.importorskip("adafruit_lsm6ds.lsm6ds3trc")
lsm6dsox = pytest.importorskip("adafruit_lsm6ds.lsm6dsox")

ACCEL_MG = {"RANGE_2G": 0.061, "RANGE_4G": 0.122, "RANGE_8G": 0.244, "RANGE_16G": 0.488}  # LSM6DSL T3
GYRO_MDPS = {
    "RANGE_125_DPS": 4.375,
    "RANGE_250_DPS": 8.75,
    "RANGE_500_DPS": 17.5,
    "RANGE_1000_DPS": 35.0,
    "RANGE_2000_DPS": 70.0,
}
RATES_HZ = {
    "RATE_12_5_HZ": 12.5,
    "RATE_26_HZ": 26,
    "RATE_52_HZ": 52,
    "RATE_104_HZ": 104,
    "RATE_208_HZ": 208,
    "RATE_416_HZ": 416,
}


class Bench:
    """A board with the driver at its LSM6DSL."""

    def __init__(self, board: Board) -> None:
        self.board = board
        self.sensor = lsm6ds3trc.LSM6DS3TRC(BusioI2C(board.i2c2), 0x6B)

    def acceleration_g(self) -> Vector:
        x, y, z = self.sensor.acceleration
        return board_axes((x / G_M_S2, y / G_M_S2, z / G_M_S2))

    def rate_dps(self) -> Vector:
        x, y, z = self.sensor.gyro
        return board_axes((degrees(x), degrees(y), degrees(z)))


@pytest.fixture
def bench() -> Iterator[Bench]:
    board = settled()
    with virtual_time(board, adafruit_lsm6ds):
        yield Bench(board)


def test_driver_waits_in_virtual_time(bench: Bench) -> None:
    """The driver waits twice 0.2 s after setting a range, and for the transfers."""
    assert 0.4 < bench.board.now_s < 0.41


@pytest.mark.parametrize("attitude", ATTITUDES)
@pytest.mark.parametrize("name", ACCEL_MG)
def test_acceleration_equals_that_of_world(bench: Bench, name: str, attitude: Vector) -> None:
    bench.sensor.accelerometer_range = getattr(adafruit_lsm6ds.AccelRange, name)
    bench.board.world.set_attitude(*attitude)
    bench.board.run_for(SETTLED_S)
    assert within(bench.acceleration_g(), acceleration_g(bench.board), ACCEL_MG[name] / 1000)


@pytest.mark.parametrize(("name", "full_scale_g"), [("RANGE_2G", 2), ("RANGE_4G", 4), ("RANGE_8G", 8)])
def test_acceleration_saturates_at_full_scale(bench: Bench, name: str, full_scale_g: float) -> None:
    """A shake of 15 g is added to 1 g. A read at the peak of the shake gives saturated 16 bits."""
    bench.sensor.accelerometer_data_rate = adafruit_lsm6ds.Rate.RATE_416_HZ
    bench.sensor.accelerometer_range = getattr(adafruit_lsm6ds.AccelRange, name)
    start_s = bench.board.now_s
    bench.board.world.shake("up", amplitude_g=15, frequency_hz=5, duration_s=1)
    bench.board.run_for(start_s + 0.4 - bench.board.now_s)
    assert bench.acceleration_g()[2] == pytest.approx(32767 * ACCEL_MG[name] / 1000)
    assert bench.acceleration_g()[2] < full_scale_g


@pytest.mark.parametrize("axis", ["roll", "pitch", "yaw"])
@pytest.mark.parametrize("name", GYRO_MDPS)
def test_angular_rate_equals_that_of_world(bench: Bench, name: str, axis: str) -> None:
    """The board turns at 100 deg/s about each axis in turn; the sign must be correct, too."""
    bench.sensor.gyro_range = getattr(adafruit_lsm6ds.GyroRange, name)
    for to_deg in (-300, 0):
        bench.board.world.sweep(axis, to_deg=to_deg, duration_s=3)
        bench.board.run_for(SETTLED_S)
        truth = rate_dps(bench.board)
        assert max(map(abs, truth)) == pytest.approx(100)
        assert within(bench.rate_dps(), truth, GYRO_MDPS[name] / 1000)
        bench.board.run_for(3 - SETTLED_S)


@pytest.mark.parametrize("name", RATES_HZ)
def test_data_come_at_rate_set_by_driver(bench: Bench, name: str) -> None:
    """Nominal rates of the LSM6DSL datasheet, T46 and T50; both sensors have the same rate."""
    bench.sensor.accelerometer_data_rate = getattr(adafruit_lsm6ds.Rate, name)
    bench.sensor.gyro_data_rate = getattr(adafruit_lsm6ds.Rate, name)
    bench.board.run_for(SETTLED_S)
    bench.board.world.sweep("pitch", to_deg=80, duration_s=1.5)
    bench.board.run_for(0.2)
    assert abs(changes(bench.board, bench.acceleration_g, 1.0, 0.0008) - RATES_HZ[name]) <= 2


@pytest.mark.parametrize("degc", [-20.0, 0.0, 25.0, 61.3])
def test_temperature_equals_that_of_world(bench: Bench, degc: float) -> None:
    bench.board.world.set_temperature(degc)
    bench.board.run_for(SETTLED_S)
    assert bench.sensor.temperature == pytest.approx(degc, abs=1 / 256)  # T4: 256 LSB/degC


def test_sensor_keeps_latest_data_after_shutdown(bench: Bench) -> None:
    """AN5040 3.1."""
    bench.board.run_for(SETTLED_S)
    before = bench.acceleration_g()
    bench.sensor.accelerometer_data_rate = adafruit_lsm6ds.Rate.RATE_SHUTDOWN
    bench.board.world.set_attitude(90, 0, 0)
    bench.board.run_for(SETTLED_S)
    assert bench.acceleration_g() == before
    bench.sensor.accelerometer_data_rate = adafruit_lsm6ds.Rate.RATE_52_HZ
    bench.board.run_for(SETTLED_S)
    assert within(bench.acceleration_g(), acceleration_g(bench.board), 0.122e-3)


def test_settings_can_be_read_until_reset(bench: Bench) -> None:
    sensor = bench.sensor
    sensor.gyro_data_rate = adafruit_lsm6ds.Rate.RATE_208_HZ
    sensor.high_pass_filter = adafruit_lsm6ds.AccelHPF.HPF_DIV9
    assert sensor.accelerometer_data_rate == adafruit_lsm6ds.Rate.RATE_104_HZ
    assert sensor.gyro_data_rate == adafruit_lsm6ds.Rate.RATE_208_HZ
    assert sensor.high_pass_filter == adafruit_lsm6ds.AccelHPF.HPF_DIV9
    sensor.reset()
    assert sensor.accelerometer_data_rate == adafruit_lsm6ds.Rate.RATE_SHUTDOWN
    assert sensor.gyro_data_rate == adafruit_lsm6ds.Rate.RATE_SHUTDOWN
    assert sensor.high_pass_filter == adafruit_lsm6ds.AccelHPF.SLOPE


def test_missing_sensor_is_reported_by_driver(bench: Bench) -> None:
    """SA0 is high on this board: the sensor has 0x6B, and the driver's default 0x6A has no device."""
    i2c = BusioI2C(bench.board.i2c2)
    with pytest.raises(ValueError, match="No I2C device at address: 0x6a"):
        lsm6ds3trc.LSM6DS3TRC(i2c)
    with pytest.raises(RuntimeError, match="Failed to find LSM6DSOX"):
        lsm6dsox.LSM6DSOX(i2c, 0x6B)
