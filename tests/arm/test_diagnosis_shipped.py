"""Diagnoses of the shipped programs: no diagnosis without a fault, and the cause of each fault."""

from __future__ import annotations

import pytest

from fcu_emulator import Board
from fcu_emulator.emulator.buses.i2c import I2CFault
from fcu_emulator.emulator.chip.diagnosis import Diagnosis
from fcu_emulator.emulator.clock import PS_PER_S
from fcu_emulator.firmware_model.arm import prebuilt
from tests.support.words import Words

LONG_PS = 100 * PS_PER_S


def template(wiring: str, bus: str) -> Board:
    return Board(prebuilt("template", bus), wiring=wiring)


def diagnosed(board: Board) -> Diagnosis:
    assert board.chip is not None
    diagnosis = board.chip.diagnosis()
    assert diagnosis is not None
    return diagnosis


@pytest.mark.parametrize(
    ("program", "wiring", "bus", "scenario"),
    [
        ("solution", "lab3", "I2C2", "figure_eight"),
        ("solution", "lab3", "I2C2", "led_x"),
        ("template", "lab3", "I2C2", "desk"),
        ("template", "fcu001v1", "SPI2", "desk"),
    ],
)
def test_working_program_has_no_diagnosis(program: str, wiring: str, bus: str, scenario: str) -> None:
    board = Board(prebuilt(program, bus), wiring=wiring, scenario=scenario)

    for seconds in (0.0, 0.003, 0.5, 0.7):  # reset, clocks start, a sensor boots, all runs
        board.run_for(seconds)
        assert board.chip is not None
        assert board.chip.diagnosis() is None


def test_slow_bus_is_reported_as_long_callback() -> None:
    """At 100 kHz the four reads do not fit into 1.25 ms."""
    board = Board(prebuilt("template"), wiring="lab3", scenario="slow_bus")
    board.run_for(1.25)
    assert board.chip is not None
    diagnosis = board.chip.diagnosis()

    assert diagnosis is not None
    assert diagnosis.kind == "callback"
    assert not diagnosis.fatal
    assert diagnosis.summary.endswith("the timer's period of 1.25 ms: main() never runs")


@pytest.mark.parametrize(("wiring", "bus"), [("lab3", "I2C2"), ("fcu001v1", "SPI2")])
def test_wrong_identity_is_reported_with_expected_value(wiring: str, bus: str, words: Words) -> None:
    """LIS2MDL datasheet, WHO_AM_I (4Fh): 0x40."""
    board = template(wiring, bus)
    board.sensors.lis2mdl.registers.mem[0x4F] = 0
    board.run_for(0.05)

    diagnosis = diagnosed(board)
    assert diagnosis.kind == "stuck"
    for part in (
        "initializeAllSensors(), sensor_setup.c:20",
        "main(), main.c:34",
        "WHO_AM_I",
        "0x00",
        "0x40",
    ):
        assert part in diagnosis.summary
    assert diagnosis.details[-1].endswith("LIS2MDL: read WHO_AM_I (0x4F): 00")
    words("diagnosis", diagnosis.summary)


def test_firmware_for_spi2_on_i2c2_wiring_is_explained(words: Words) -> None:
    board = template("lab3", "SPI2")
    board.run_for(0.05)
    diagnosis = diagnosed(board)

    assert diagnosis.kind == "stuck"
    for part in ("initializeAllSensors(), sensor_setup.c:12", "main(), main.c:34", "SPI2"):
        assert part in diagnosis.summary
    words("diagnosis", diagnosis.summary)
    words("diagnosis", next(line for line in diagnosis.details if "fcu001v1" in line))


def test_firmware_for_i2c2_on_spi2_wiring_is_explained(words: Words) -> None:
    board = template("fcu001v1", "I2C2")
    board.run_for(0.05)
    diagnosis = diagnosed(board)

    assert diagnosis.kind == "stuck"
    words("diagnosis", diagnosis.summary)
    words("diagnosis", next(line for line in diagnosis.details if "wiring lab3" in line))


@pytest.mark.parametrize("fault", [I2CFault("stuck"), I2CFault("absent", address=0x1E)])
def test_injected_bus_fault_is_named(fault: I2CFault, words: Words) -> None:
    board = template("lab3", "I2C2")
    board.i2c2.bus.inject(fault)
    board.run_for(0.2)

    diagnosis = diagnosed(board)
    assert diagnosis.kind == "stuck"
    words("diagnosis", diagnosis.summary)


def test_temporary_failure_is_not_reported_as_wrong_address() -> None:
    board = template("lab3", "I2C2")
    board.run_for(1.3)
    board.i2c2.bus.inject(I2CFault.in_ps("nack", board.clock.now_ps, LONG_PS, 0x1E))
    board.run_for(0.1)

    assert board.chip is not None
    assert board.chip.diagnosis() is None
