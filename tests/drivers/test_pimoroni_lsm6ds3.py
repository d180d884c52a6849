"""Pimoroni's driver of the LSM6DS3 family on an smbus2 bus, and smbus2's own messages."""

from __future__ import annotations

import pytest

from fcu_emulator import Board
from fcu_emulator.emulator.adapters import SMBus
from tests.support.driver_fakes import (
    ATTITUDES,
    SETTLED_S,
    Vector,
    acceleration_g,
    board_axes,
    rate_dps,
    settled,
    within,
)

lsm6ds3 = pytest.importorskip("lsm6ds3", reason="pip install -e '.[test]'")

MODES = ["NORMAL_MODE_104HZ", "NORMAL_MODE_208HZ", "PERFORMANCE_MODE_416HZ"]
G_PER_LSB, DPS_PER_LSB = 0.061e-3, 8.75e-3  # LSM6DSL T3 at +-2 g and 250 dps, which the driver leaves


def readings(board: Board, mode: str) -> tuple[Vector, Vector]:
    """Return the driver's readings in board axes: g and deg/s."""
    sensor = lsm6ds3.LSM6DS3(SMBus(board.i2c2), 0x6B, getattr(lsm6ds3, mode))
    board.run_for(SETTLED_S)
    ax, ay, az, gx, gy, gz = sensor.get_readings()
    acceleration = board_axes((ax * G_PER_LSB, ay * G_PER_LSB, az * G_PER_LSB))
    return acceleration, board_axes((gx * DPS_PER_LSB, gy * DPS_PER_LSB, gz * DPS_PER_LSB))


@pytest.mark.parametrize("attitude", ATTITUDES)
@pytest.mark.parametrize("mode", MODES)
def test_acceleration_equals_that_of_world(mode: str, attitude: Vector) -> None:
    board = settled(attitude)
    acceleration, rate = readings(board, mode)
    assert within(acceleration, acceleration_g(board), G_PER_LSB)
    assert within(rate, (0, 0, 0), DPS_PER_LSB)


@pytest.mark.parametrize("axis", ["roll", "pitch", "yaw"])
@pytest.mark.parametrize("mode", MODES)
def test_angular_rate_equals_that_of_world(mode: str, axis: str) -> None:
    board = settled()
    board.world.sweep(axis, to_deg=-360, duration_s=3)
    _, rate = readings(board, mode)
    assert max(map(abs, rate_dps(board))) == pytest.approx(120)
    assert within(rate, rate_dps(board), DPS_PER_LSB)


def test_combined_messages_of_smbus2_are_accepted() -> None:
    smbus2 = pytest.importorskip("smbus2", reason="needs fcntl (POSIX)")
    bus = SMBus(settled().i2c2)
    read = smbus2.i2c_msg.read(0x6B, 1)
    bus.i2c_rdwr(smbus2.i2c_msg.write(0x6B, [0x0F]), read)
    assert list(read) == [0x6A]
    again = smbus2.i2c_msg.read(0x6B, 2)
    bus.i2c_rdwr(smbus2.i2c_msg.write(0x6B, [0x10, 0x48, 0x5C]), smbus2.i2c_msg.write(0x6B, [0x10]), again)
    assert bytes(again) == b"\x48\x5c"
