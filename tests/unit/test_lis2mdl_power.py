"""The LIS2MDL's power-on, REBOOT, supply current and bus settings (datasheet; AN5069 sections 3 and 7)."""

from __future__ import annotations

import pytest

from fcu_emulator.sensors import LIS2MDL
from tests.support.notes import kinds, texts
from tests.support.sensor_fakes import (
    LIS2MDL_TEMPERATURE,
    MAGNETOMETER,
    PS_PER_MS,
    PS_PER_S,
    PS_PER_US,
    Chip,
    constant,
)
from tests.support.words import Words

CFG_REG_A, CFG_REG_B, CFG_REG_C, STATUS_REG = 0x60, 0x61, 0x62, 0x67
BOOT_PS = 20 * PS_PER_MS


# -- power-on and REBOOT --------------------------------------------------------------------------------


def test_registers_answer_20_ms_after_power_on() -> None:
    part = LIS2MDL(constant(0.0, 0.0, 0.0), constant(25.0), powered_on_ps=PS_PER_MS)

    assert [part.accessible(PS_PER_MS + ps) for ps in (0, BOOT_PS - 1, BOOT_PS)] == [False, False, True]


def test_default_sensor_was_powered_on_long_ago() -> None:
    assert Chip("LIS2MDL").part.accessible(0)


def test_sensor_is_idle_after_power_on() -> None:
    part = LIS2MDL(constant(0.0, 0.0, 0.0), constant(25.0), powered_on_ps=0)

    assert part.read(CFG_REG_A, 1, BOOT_PS) == b"\x03"
    assert part.read(STATUS_REG, 1, PS_PER_S) == b"\x00"


def test_reboot_ends_in_idle_after_one_measurement() -> None:
    """AN5069 section 7. The registers keep the written values."""
    chip = Chip("LIS2MDL")
    chip.set("temperature_degc", 30.0)
    chip.configure(((CFG_REG_B, 0x02), (CFG_REG_C, 0x10), (CFG_REG_A, 0xCC)))

    chip.wait(BOOT_PS - 1)
    assert (chip.byte(CFG_REG_A), chip.byte(STATUS_REG)) == (0xCF, 0x00)
    chip.wait(1)
    assert (chip.byte(CFG_REG_A), chip.byte(STATUS_REG)) == (0x8F, 0x0F)
    assert chip.counts(MAGNETOMETER) == (133, 0, -267)
    assert chip.counts(LIS2MDL_TEMPERATURE) == (40,)
    assert (chip.byte(CFG_REG_B), chip.byte(CFG_REG_C)) == (0x02, 0x10)
    chip.wait(PS_PER_S)
    assert chip.byte(STATUS_REG) == 0x00
    assert chip.part.accessible(chip.t_ps)


def test_read_modify_write_does_not_restart_reboot() -> None:
    chip = Chip("LIS2MDL")
    chip.write(CFG_REG_A, 0xC3)
    chip.wait(BOOT_PS // 2)
    chip.write(CFG_REG_A, chip.byte(CFG_REG_A))

    chip.wait(BOOT_PS // 2)
    assert (chip.byte(CFG_REG_A), chip.byte(STATUS_REG)) == (0x83, 0x0F)


def test_other_writes_do_not_disturb_reboot() -> None:
    chip = Chip("LIS2MDL")
    chip.write(CFG_REG_A, 0xC3)
    chip.wait(BOOT_PS // 2)
    chip.write(CFG_REG_C, 0x10)

    chip.wait(BOOT_PS // 2)
    assert (chip.byte(CFG_REG_A), chip.byte(STATUS_REG)) == (0x83, 0x0F)


def test_measurement_requested_during_reboot_starts_after_it() -> None:
    chip = Chip("LIS2MDL")
    chip.write(CFG_REG_A, 0xC3)
    chip.wait(PS_PER_MS)
    chip.write(CFG_REG_A, 0x8C)

    chip.wait(19 * PS_PER_MS + 9400 * PS_PER_US - 1)
    assert chip.byte(STATUS_REG) == 0x00
    chip.wait(1)
    assert chip.byte(STATUS_REG) == 0x0F


def test_soft_reset_cancels_measurement_of_reboot() -> None:
    chip = Chip("LIS2MDL")
    chip.write(CFG_REG_A, 0xC3)
    chip.wait(PS_PER_MS)
    chip.write(CFG_REG_A, 0x20)

    chip.wait(PS_PER_S)
    assert (chip.byte(CFG_REG_A), chip.byte(STATUS_REG)) == (0x03, 0x00)


# -- supply current -------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("low_power", "cancelling", "microampere"),
    [
        (False, False, (100, 200, 475, 950)),
        (True, False, (25, 50, 125, 250)),
        (False, True, (120, 235, 575, 1130)),
        (True, True, (50, 100, 235, 460)),
    ],
)
def test_current_in_continuous_mode_equals_datasheet(
    low_power: bool, cancelling: bool, microampere: tuple[int, ...]
) -> None:
    """The datasheet's and AN5069's figures at 10, 20, 50 and 100 Hz."""
    chip = Chip("LIS2MDL")
    chip.write(CFG_REG_B, 0x02 * cancelling)
    found = []
    for code in range(4):
        chip.write(CFG_REG_A, 0x80 | 0x10 * low_power | code << 2)
        found.append(chip.part.supply_current_ua())

    assert found == list(microampere)


@pytest.mark.parametrize(
    ("config_a", "single_hz", "microampere"),
    [
        (0x83, 0, 1.5),
        (0x81, 0, 1.5),
        (0x83, 1, (100 - 1.5) / 10 + 1.5),
        (0x93, 4, (25 - 1.5) * 0.4 + 1.5),
        (0x81, 10, 100),
        (0x8D, 10, 100),  # ODR does not matter
    ],
)
def test_current_in_idle_and_single_mode_is_documented(
    config_a: int, single_hz: float, microampere: float
) -> None:
    """The formula is (I10 - Ipd) * ODR / 10 + Ipd."""
    part = LIS2MDL(constant(0.0, 0.0, 0.0), constant(25.0))
    part.write(CFG_REG_A, bytes([config_a]), 0)

    assert part.supply_current_ua(single_hz) == pytest.approx(microampere)


# -- bus ------------------------------------------------------------------------------------------------


def test_i2c_dis_silences_i2c_until_soft_reset() -> None:
    """Datasheet T29. After that, the reset can only come over SPI."""
    chip = Chip("LIS2MDL")
    assert not chip.part.i2c_off
    chip.write(CFG_REG_C, 0x20)
    assert chip.part.i2c_off
    chip.write(CFG_REG_A, 0x20)
    assert not chip.part.i2c_off


def test_spi_wires_depend_on_4wspi() -> None:
    """ST's driver and AN5069 Rev 4 allow the bit 4WSPI; the datasheet says "must be 0"."""
    chip = Chip("LIS2MDL")
    assert chip.part.spi_wires() == 3
    chip.write(CFG_REG_C, 0x04)
    assert chip.part.spi_wires() == 4
    chip.write(CFG_REG_A, 0x20)
    assert chip.part.spi_wires() == 3


@pytest.mark.parametrize("config_a", [0x0C, 0x0D, 0x1C])
def test_measuring_without_temperature_compensation_is_noted(config_a: int, words: Words) -> None:
    """Datasheet 8.5: COMP_TEMP_EN "must be 1". The sensor measures nevertheless."""
    chip = Chip("LIS2MDL")
    chip.write(CFG_REG_A, config_a)
    assert kinds(chip.notes) == ["forbidden"]
    words("sensors", texts(chip.notes))
    chip.wait(20 * PS_PER_MS)
    assert chip.byte(STATUS_REG) & 0x08


@pytest.mark.parametrize("config_a", [0x8C, 0x8D, 0x03, 0x0F, 0x20, 0x40])
def test_nothing_is_noted_while_idle_or_compensated(config_a: int) -> None:
    chip = Chip("LIS2MDL")
    chip.write(CFG_REG_A, config_a)
    assert chip.notes == []
