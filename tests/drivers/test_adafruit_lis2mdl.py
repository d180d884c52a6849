"""Adafruit's CircuitPython driver of the LIS2MDL."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from fcu_emulator import Board
from fcu_emulator.emulator.adapters import BusioI2C, virtual_time
from fcu_emulator.emulator.buses.i2c import I2CFault
from tests.support.driver_fakes import (
    ATTITUDES,
    SETTLED_S,
    Vector,
    board_axes,
    changes,
    field_ut,
    settled,
    within,
)

adafruit_lis2mdl = pytest.importorskip("adafruit_lis2mdl", reason="pip install -e '.[test]'")

LSB_UT = 0.15  # LIS2MDL datasheet T3: 1.5 mgauss
RATES_HZ = {"Rate_10_HZ": 10, "Rate_20_HZ": 20, "Rate_50_HZ": 50, "Rate_100_HZ": 100}


class Bench:
    """A board with the driver at its LIS2MDL."""

    def __init__(self, board: Board) -> None:
        self.board = board
        self.sensor = adafruit_lis2mdl.LIS2MDL(BusioI2C(board.i2c2))

    def field_ut(self) -> Vector:
        return board_axes(self.sensor.magnetic)


@pytest.fixture
def bench() -> Iterator[Bench]:
    board = settled()
    with virtual_time(board, adafruit_lis2mdl):
        yield Bench(board)


def test_driver_waits_in_virtual_time(bench: Bench) -> None:
    """The driver waits 0.1 s after the reset, 0.1 s after the reboot, 0.03 s at the end, and for the transfers."""
    assert 0.23 < bench.board.now_s < 0.24


@pytest.mark.parametrize("attitude", ATTITUDES)
@pytest.mark.parametrize("low_power", [False, True])
def test_field_equals_that_of_world(bench: Bench, attitude: Vector, low_power: bool) -> None:
    bench.sensor.low_power = low_power
    bench.board.world.set_attitude(*attitude)
    bench.board.run_for(SETTLED_S)
    assert within(bench.field_ut(), field_ut(bench.board), LSB_UT)


def test_driver_offsets_remove_hard_iron(bench: Bench) -> None:
    """AN5069 section 9: OFFSET_REG is subtracted from the output."""
    bench.board.run_for(SETTLED_S)
    clean = field_ut(bench.board)
    bench.board.world.set_hard_iron(300, -450, 600)
    bench.board.run_for(SETTLED_S)
    assert within(bench.field_ut(), (clean[0] + 30, clean[1] - 45, clean[2] + 60), LSB_UT)
    sensor = bench.sensor
    sensor.x_offset, sensor.y_offset, sensor.z_offset = -45.0, -30.0, 60.0  # raw axes: X = board Y, Y = -X
    bench.board.run_for(SETTLED_S)
    assert within(bench.field_ut(), clean, 2 * LSB_UT)  # the driver cuts the offset to whole LSB
    assert (sensor.x_offset, sensor.y_offset, sensor.z_offset) == pytest.approx((-45, -30, 60), abs=LSB_UT)


@pytest.mark.parametrize("name", RATES_HZ)
def test_data_come_at_rate_set_by_driver(bench: Bench, name: str) -> None:
    rate = getattr(adafruit_lis2mdl.DataRate, name)
    bench.sensor.data_rate = rate
    assert bench.sensor.data_rate == rate
    bench.board.world.set_magnetic_field(300, 0, 0)  # strong enough that no two samples are the same
    bench.board.run_for(SETTLED_S)
    bench.board.world.sweep("yaw", to_deg=60, duration_s=2.5)
    bench.board.run_for(0.2)
    count = changes(bench.board, lambda: bench.sensor._raw_x, 2.0, 0.002)
    assert abs(count - 2 * RATES_HZ[name]) <= 2


def test_error_identifies_sensor_that_does_not_answer(bench: Bench) -> None:
    bench.board.i2c2.inject(I2CFault("absent", address=0x1E))
    with pytest.raises(ValueError, match="No I2C device at address: 0x1e"):
        adafruit_lis2mdl.LIS2MDL(BusioI2C(bench.board.i2c2))
