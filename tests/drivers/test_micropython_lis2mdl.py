"""A MicroPython driver of the LIS2MDL, with the interface of ``machine.I2C``."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from fcu_emulator import Board, I2CNackError
from fcu_emulator.emulator.adapters import MachineI2C, virtual_time
from tests.support.driver_fakes import ATTITUDES, SETTLED_S, Vector, board_axes, field_ut, settled, within

package = pytest.importorskip("micropython_lis2mdl", reason="pip install -e '.[test]'")
lis2mdl = pytest.importorskip("micropython_lis2mdl.lis2mdl")

LSB_UT = 0.15  # LIS2MDL datasheet T3: 1.5 mgauss
RATES = ["RATE_10_HZ", "RATE_20_HZ", "RATE_50_HZ", "RATE_100_HZ"]


@pytest.fixture
def board() -> Iterator[Board]:
    board = settled()
    with virtual_time(board, package):
        yield board


@pytest.mark.parametrize("attitude", ATTITUDES)
@pytest.mark.parametrize("rate", RATES)
def test_field_equals_that_of_world(board: Board, rate: str, attitude: Vector) -> None:
    """The driver reads the three axes in one burst, without bit 7 of the sub-address, which this sensor does not need."""
    sensor = lis2mdl.LIS2MDL(MachineI2C(board.i2c2))
    sensor.data_rate = getattr(lis2mdl, rate)
    sensor.low_pass_filter_mode = lis2mdl.LPF_ENABLED
    board.world.set_attitude(*attitude)
    board.run_for(SETTLED_S)
    assert within(board_axes(sensor.magnetic), field_ut(board), LSB_UT)
    assert (sensor.data_rate, sensor.low_pass_filter_mode) == (rate, "LPF_ENABLED")


def test_one_shot_measures_once_then_reports_power_down(board: Board) -> None:
    """AN5069 3.3: after the measurement MD reads 11, idle, a code for which the driver has no name."""
    sensor = lis2mdl.LIS2MDL(MachineI2C(board.i2c2))
    sensor.operation_mode = lis2mdl.POWER_DOWN
    board.world.set_attitude(0, 0, 90)
    board.run_for(SETTLED_S)
    sensor.operation_mode = lis2mdl.ONE_SHOT
    assert sensor.operation_mode == "ONE_SHOT"
    board.run_for(0.05)
    assert within(board_axes(sensor.magnetic), field_ut(board), LSB_UT)
    with pytest.raises(IndexError):
        _ = sensor.operation_mode


def test_reset_waits_10_ms_and_enters_idle(board: Board) -> None:
    sensor = lis2mdl.LIS2MDL(MachineI2C(board.i2c2))
    before_s = board.now_s
    sensor.low_power_mode = lis2mdl.LP_ENABLED
    sensor.reset()
    assert 0.010 < board.now_s - before_s < 0.011
    assert sensor.low_power_mode == "LP_DISABLED"


def test_absent_sensor_raises_os_error(board: Board) -> None:
    with pytest.raises(OSError, match="0x1C") as refused:
        lis2mdl.LIS2MDL(MachineI2C(board.i2c2), 0x1C)
    assert isinstance(refused.value.__cause__, I2CNackError)
