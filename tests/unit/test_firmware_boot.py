"""Boot: the exact text, the exact transactions, and the effect of a missing sensor."""

from __future__ import annotations

import pytest

from fcu_emulator.firmware_model import FIRMWARES, Lab3, LabFirmware, Settings, Template
from tests.support.firmware_fakes import LED1, LED2, LIS2MDL, LPS22HB, LSM6DSL, FakeHal, run_until_power_off

BANNER = b"STEVAL-FCU001V1 FH rev.1.0 - Sep 2017\n\n"
BOOT = (  # the lab's text
    BANNER + b"LSM6DSL MEMS Accelerometer initialized and enabled\n"
    b"LSM6DSL MEMS Gyroscope initialized and enabled\n"
    b"LIS2MDL Magnetometer initialized and enabled\n"
    b"LPS22HB Pressure sensor initialized and enabled\n"
    b"LPS22HB Temperature sensor initialized and enabled\n"
    b"LAB3 Init...\n"
)

# The order of ST's firmware, without what only SPI with three wires needs, and without I2C being switched off
# and with IF_ADD_INC set instead of cleared; then the first sample is awaited and read.
TRANSACTIONS = """
L R 0F 6A | L R 12 04 | L W 12 04 | L R 12 04 | L W 12 44 | L R 0A 00 | L W 0A 00
L R 10 00 | L W 10 00 | L R 10 00 | L W 10 00
L R 0F 6A | L R 12 44 | L W 12 44 | L R 12 44 | L W 12 44 | L R 0A 00 | L W 0A 00
L R 11 00 | L W 11 00 | L R 11 00 | L W 11 0C
M R 4F 40 | M R 60 03 | M W 60 03 | M R 62 00 | M W 62 10
M R 60 03 | M W 60 0F | M R 62 10 | M W 62 10
P R 11 10 | P W 11 94 | P R 0F B1 | P R 1A 00 | P W 1A 01 | P R 10 00 | P W 10 00 | P R 10 00 | P W 10 00
P R 10 00 | P W 10 00 | P R 10 00 | P W 10 02 | P R 11 10 | P W 11 10
L R 10 00 | L W 10 40 | L R 11 0C | L W 11 4C | M R 60 0F | M W 60 0C
P R 10 02 | P W 10 32 | P R 10 32 | P R 10 32 | P W 10 32 | P R 10 32
L R 10 40 | L W 10 A0 | L R 10 A0 | L W 10 A8
L R 17 00 | L W 17 00 | L R 17 00 | L W 17 80 | L R 17 80 | L W 17 E0
L R 10 A8 | L W 10 A8 | L R 15 00 | L W 15 01 | L W 11 6C | M W 60 8C | M W 61 02
P R 27 03 | P R 28 67163D | P R 2B 6608
"""
FIRMWARE_CLASSES = pytest.mark.parametrize("firmware_class", [Lab3, Template])


def parsed(table: str) -> list[tuple[str, int, int, bytes]]:
    devices = {"L": LSM6DSL, "M": LIS2MDL, "P": LPS22HB}
    rows = [row.split() for line in table.strip().splitlines() for row in line.split("|")]
    return [
        (kind, devices[device], int(register, 16), bytes.fromhex(data))
        for device, kind, register, data in rows
    ]


def booted(firmware_class: type[LabFirmware], settings: Settings | None = None) -> FakeHal:
    hal = FakeHal(power_off_at=2)
    hal.set_pressure(4003431)
    run_until_power_off(firmware_class, hal, settings)
    return hal


@FIRMWARE_CLASSES
def test_boot_text_equals_lab(firmware_class: type[LabFirmware]) -> None:
    assert b"".join(booted(firmware_class).transmissions[:7]) == BOOT


def test_banner_setting_selects_fw_text() -> None:
    assert booted(Lab3, Settings(banner="FW")).transmissions[0] == BANNER.replace(b"FH", b"FW")


@FIRMWARE_CLASSES
def test_boot_transactions_are_in_st_order(firmware_class: type[LabFirmware]) -> None:
    expected = parsed(TRANSACTIONS)
    assert booted(firmware_class).transactions[: len(expected)] == expected


def test_final_registers_equal_list_of_lab() -> None:
    registers = booted(Lab3).registers
    lsm6dsl = {
        register: registers[LSM6DSL][register] for register in (0x0A, 0x10, 0x11, 0x12, 0x13, 0x15, 0x17)
    }
    assert lsm6dsl == {0x0A: 0, 0x10: 0xA8, 0x11: 0x6C, 0x12: 0x44, 0x13: 0, 0x15: 0x01, 0x17: 0xE0}
    assert registers[LIS2MDL][0x60:0x63] == bytes.fromhex("8C0210")
    assert registers[LPS22HB][0x10:0x12] == bytes.fromhex("3210")
    assert registers[LPS22HB][0x1A] == 0x01


def test_banner_is_followed_by_one_second_delay() -> None:
    hal = FakeHal(power_off_at=1)
    run_until_power_off(Lab3, hal)
    assert hal.delays_ms == [1000]
    assert hal.text == BANNER


def test_leds_are_outputs_and_dark_after_boot() -> None:
    hal = FakeHal(power_off_at=1)
    run_until_power_off(Lab3, hal)
    assert hal.pin_events == [("init", LED1, 0), ("write", LED1, 1), ("init", LED2, 0), ("write", LED2, 1)]


def test_timer_runs_at_800_hz_after_boot() -> None:
    hal = booted(Lab3)
    assert hal.timer_running
    assert hal.timer is not None
    prescaler, period = hal.timer
    assert 84_000_000 / (prescaler + 1) / (period + 1) == 800


def test_st_timer_values_can_be_selected() -> None:
    assert booted(Lab3, Settings(timer_prescaler=51, timer_period=1999)).timer == (51, 1999)


@pytest.mark.parametrize("device", [LSM6DSL, LIS2MDL, LPS22HB])
@pytest.mark.parametrize("fault", ["silent", "another part"])
def test_missing_sensor_stops_boot_after_banner(device: int, fault: str) -> None:
    hal = FakeHal(power_off_at=20)
    if fault == "silent":
        hal.silent.add(device)
    else:
        hal.registers[device][0x4F if device == LIS2MDL else 0x0F] = 0x55
    run_until_power_off(Lab3, hal)
    assert hal.text == BANNER
    assert hal.pins == {LED1: 1, LED2: 1}
    assert not hal.timer_running


def test_boot_waits_for_first_pressure_as_zero_level() -> None:
    class SlowBarometer(FakeHal):
        def HAL_Delay(self, delay_ms: int) -> None:
            super().HAL_Delay(delay_ms)
            if len(self.delays_ms) == 6:  # the reset, then five polls
                self.registers[LPS22HB][0x27] = 0x03
                self.set_pressure(4003431)

    hal = SlowBarometer(power_off_at=7)
    hal.registers[LPS22HB][0x27] = 0x00
    hal.set_pressure(0x2F6666)  # shown before the first conversion
    firmware = run_until_power_off(Lab3, hal)
    assert hal.delays_ms == [1000, 1, 1, 1, 1, 1, 1000]
    assert f"{firmware.press_zero_level:f}" == "977.400024"
    assert firmware.temperature == 21.5


def test_barometer_without_conversions_does_not_stop_boot() -> None:
    hal = FakeHal(power_off_at=102)
    hal.registers[LPS22HB][0x27] = 0x00
    run_until_power_off(Lab3, hal)
    assert hal.delays_ms == [1000, *[1] * 100, 1000]
    assert hal.text.startswith(BOOT)


def test_barometer_lost_after_setup_does_not_stop_boot() -> None:
    class Dying(FakeHal):
        def HAL_UART_Transmit(self, data: bytes, timeout_ms: int) -> int:
            if data.startswith(b"LAB3"):
                self.silent.add(LPS22HB)
            return super().HAL_UART_Transmit(data, timeout_ms)

    hal = Dying(power_off_at=2)
    firmware = run_until_power_off(Lab3, hal)
    assert firmware.press_zero_level == 0.0
    assert b"Altitude: nan m \n\r" in hal.text


def test_registry_lists_both_firmwares() -> None:
    assert dict(FIRMWARES) == {"lab3": Lab3, "template": Template}
