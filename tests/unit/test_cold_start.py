"""Power-on: sensors that load their trimming values do not answer (AN5040 5.7: 15 ms; AN5069 3: 20 ms)."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from fcu_emulator import Board, I2CNackError
from fcu_emulator.emulator.clock import PS_PER_MS
from fcu_emulator.emulator.python_cpu.hal import VirtualHal
from fcu_emulator.emulator.trace import BusTransfer, DeviceNote
from tests.support.board_fakes import script
from tests.support.words import Words

ADDRESS = {"LSM6DSL": 0x6B, "LIS2MDL": 0x1E, "LPS22HB": 0x5D}
CHIP_SELECT = {"LSM6DSL": "PA8", "LIS2MDL": "PB12", "LPS22HB": "PC13"}
IDENTITY = {"LSM6DSL": (0x0F, 0x6A), "LIS2MDL": (0x4F, 0x40), "LPS22HB": (0x0F, 0xB1)}
BOOT_MS = {"LSM6DSL": 15, "LIS2MDL": 20}
HAL_OK, HAL_ERROR = 0, 1
slow_parts = pytest.mark.parametrize("part", BOOT_MS)


def notes(board: Board) -> list[tuple[str, str, str]]:
    return [(note.device, note.what, note.text) for note in board.trace.of(DeviceNote)]


@slow_parts
def test_sensor_acknowledges_after_its_boot(part: str) -> None:
    board = Board(cold_start=True)
    register, identity = IDENTITY[part]
    board.run_until_ps(BOOT_MS[part] * PS_PER_MS - 1)
    with pytest.raises(I2CNackError) as caught:
        board.i2c2.write_read(ADDRESS[part], bytes([register]), 1)
    assert (caught.value.address, caught.value.byte_index) == (ADDRESS[part], 0)
    assert board.i2c2.write_read(ADDRESS[part], bytes([register]), 1) == bytes([identity])


@slow_parts
def test_refusal_during_boot_is_noted_once_with_reason(part: str, words: Words) -> None:
    board = Board(cold_start=True)
    with pytest.raises(I2CNackError):
        board.i2c2.write_read(ADDRESS[part], b"\x0f", 6)
    with pytest.raises(I2CNackError):
        board.i2c2.bus.read_from(ADDRESS[part], 0x0F, 6)  # the short way that firmware takes
    with pytest.raises(I2CNackError):
        board.i2c2.write(ADDRESS[part], b"\x10\x00")

    found = notes(board)
    assert [(device, what) for device, what, _ in found] == 3 * [(part, "not accessible")]
    assert all(f" {BOOT_MS[part]} ms" in text for _, _, text in found)
    words("sensors", found[0][2])
    (result,) = {event.result for event in board.trace.of(BusTransfer)}
    assert f"0x{ADDRESS[part]:02X}" in result
    words("sensors", result)


@pytest.mark.parametrize("first", ["start", "read_from"])
def test_any_first_access_after_boot_is_answered(first: str) -> None:
    board = Board(cold_start=True)
    board.run_for(0.02)
    if first == "read_from":
        assert board.i2c2.bus.read_from(0x6B, 0x0F, 1) == b"\x6a"
    else:
        assert board.i2c2.write_read(0x6B, b"\x0f", 1) == b"\x6a"
    assert notes(board) == []


@slow_parts
def test_write_during_boot_is_lost(part: str) -> None:
    register = {"LSM6DSL": 0x73, "LIS2MDL": 0x45}[part]
    board = Board(cold_start=True)
    with pytest.raises(I2CNackError):
        board.i2c2.write(ADDRESS[part], bytes([register, 0x55]))
    board.run_for(0.02)
    assert board.i2c2.write_read(ADDRESS[part], bytes([register]), 1) == b"\x00"


@slow_parts
def test_spi_reads_ff_and_ignores_writes_during_boot(part: str) -> None:
    """The decision of ``sensors.spi``: reads give 0xFF, and commands are lost."""
    register, identity = IDENTITY[part]
    board = Board(wiring="fcu001v1", cold_start=True)
    board.spi2.configure(mode=3, wires=3 if part == "LIS2MDL" else 4)
    target = {"LSM6DSL": 0x73, "LIS2MDL": 0x45}[part]
    board.spi2.write(CHIP_SELECT[part], bytes([target, 0x55]))
    assert board.spi2.write_read(CHIP_SELECT[part], bytes([0x80 | register]), 3) == b"\xff\xff\xff"
    assert [(device, what) for device, what, _ in notes(board)] == 2 * [(part, "not accessible")]

    board.run_until_ps(BOOT_MS[part] * PS_PER_MS)
    assert board.spi2.write_read(CHIP_SELECT[part], bytes([0x80 | register]), 1) == bytes([identity])
    assert board.spi2.write_read(CHIP_SELECT[part], bytes([0x80 | target]), 1) == b"\x00"


def test_barometer_answers_immediately_with_boot_status() -> None:
    """LPS22HB datasheet 9.15, BOOT_STATUS. The 5 ms are an assumption."""
    board = Board(cold_start=True)
    assert board.i2c2.write_read(0x5D, b"\x0f", 1) == b"\xb1"
    assert board.i2c2.write_read(0x5D, b"\x25", 1) == b"\x80"
    board.run_for(0.005)
    assert board.i2c2.write_read(0x5D, b"\x25", 1) == b"\x00"


@pytest.mark.parametrize("part", ADDRESS)
def test_sensors_answer_at_time_0_without_cold_start(part: str) -> None:
    """The reset button has the same result, because it does not affect the sensors' supply."""
    register, identity = IDENTITY[part]
    board = Board()
    assert board.i2c2.write_read(ADDRESS[part], bytes([register]), 1) == bytes([identity])
    assert board.i2c2.write_read(0x5D, b"\x25", 1) == b"\x00"
    assert notes(board) == []


def test_firmware_gets_hal_error_until_boot_ends() -> None:
    results: list[tuple[int, bytes]] = []

    def main(hal: VirtualHal) -> None:
        results.append(hal.HAL_I2C_Mem_Read(0x6B << 1, 0x0F, 1))
        hal.HAL_Delay(20)
        results.append(hal.HAL_I2C_Mem_Read(0x6B << 1, 0x0F, 1))

    board = Board(firmware=script(main), cold_start=True)
    board.run_for(0.1)
    assert [result for result, _ in results] == [HAL_ERROR, HAL_OK]
    assert results[1][1] == b"\x6a"


def test_cold_board_measures_as_usual_after_boot() -> None:
    """After its boot, the LSM6DSL has the same samples as an LSM6DSL that was powered long before."""
    found = []
    for cold_start in (False, True):
        board = Board(seed=3, cold_start=cold_start)
        board.run_until(6000)  # it takes its time to become as warm as the other one
        board.i2c2.write(0x6B, b"\x10\xa8")
        board.run_for(0.1)
        found.append(board.i2c2.write_read(0x6B, b"\x28", 6))
    assert found[0] == found[1] != bytes(6)


def test_scenario_uptime_determines_boot_state_and_heating(tmp_path: Path) -> None:
    text = "schema = 1\nquestion = '?'\nduration = '2s'\nuptime = '{}'\n"
    text += "[sensors]\nquality = 'ideal'\n[board]\nheating_degc = 5\nthermal_s = 1\n"
    register, identity = IDENTITY["LSM6DSL"]
    for powered_ms in (0, 5, 15):
        path = tmp_path / f"{powered_ms}.toml"
        path.write_text(text.format(f"{powered_ms}ms"), encoding="utf-8")
        board = Board(scenario=path)
        warmer = 5 * (1 - np.exp(-powered_ms / 1000))
        assert board.world.board_temperature_degc(0.0)[0] == pytest.approx(25 + warmer, abs=1e-12)
        if powered_ms < BOOT_MS["LSM6DSL"]:
            with pytest.raises(I2CNackError):
                board.i2c2.write_read(ADDRESS["LSM6DSL"], bytes([register]), 1)
        board.run_until_ps(max(BOOT_MS["LSM6DSL"] - powered_ms, 0) * PS_PER_MS)
        assert board.i2c2.write_read(ADDRESS["LSM6DSL"], bytes([register]), 1) == bytes([identity])
