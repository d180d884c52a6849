"""Supply current for the configured mode: figures from the datasheets' tables."""

from __future__ import annotations

import pytest

from fcu_emulator import Board
from tests.support.sensor_fakes import Chip


@pytest.mark.parametrize(
    ("writes", "microampere"),
    [
        ((), 3),
        ([(0x10, 0x40)], 150),  # 104 Hz, high performance
        ([(0x15, 0x10), (0x10, 0x40)], 44),  # 104 Hz, normal
        ([(0x15, 0x10), (0x10, 0x10)], 9),  # 12.5 Hz, low power
        ([(0x15, 0x10), (0x10, 0xB0)], 4.5),  # 1.6 Hz
        ([(0x10, 0xB0)], 150),  # the same code is 12.5 Hz in high performance
        ([(0x10, 0xA0)], 160),  # 6664 Hz
        ([(0x11, 0x40)], 555),
        ([(0x16, 0x80), (0x11, 0x30)], 270),
        ([(0x10, 0xA8), (0x11, 0x6C)], 650),  # the lab's setting
        ([(0x10, 0xF0)], 3),  # a reserved code measures nothing
    ],
)
def test_lsm6dsl_current_follows_its_setting(writes: list[tuple[int, int]], microampere: float) -> None:
    chip = Chip("LSM6DSL")
    for address, value in writes:
        chip.write(address, value)
    assert chip.part.supply_current_ua() == microampere


def test_sensors_have_documented_current_after_power_on() -> None:
    """The modes are power-down, idle, power-down."""
    assert Board().supply_current_ua() == {"LSM6DSL": 3.0, "LIS2MDL": 1.5, "LPS22HB": 1.0}


def test_sensors_have_documented_current_under_lab_firmware() -> None:
    """Both LSM6DSL sensors in high performance, LIS2MDL at 100 Hz with OFF_CANC, LPS22HB at 25 Hz in low current.

    The figure of the LPS22HB at 1 Hz is 3 uA.
    """
    board = Board(firmware="lab3")
    board.run_for(1.5)
    assert board.supply_current_ua() == {"LSM6DSL": 650.0, "LIS2MDL": 1130.0, "LPS22HB": 51.0}
