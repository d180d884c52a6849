"""The LIS2MDL beyond the contract (datasheet DocID030621 Rev 3; application note AN5069 Rev 2)."""

from __future__ import annotations

import pytest

from tests.support.notes import kinds, texts
from tests.support.sensor_fakes import (
    LIS2MDL_TEMPERATURE,
    MAGNETOMETER,
    PS_PER_MS,
    PS_PER_S,
    PS_PER_US,
    Chip,
    step,
)
from tests.support.words import Words

OFFSET_X_REG_L, CFG_REG_A, CFG_REG_B, CFG_REG_C, STATUS_REG = 0x45, 0x60, 0x61, 0x62, 0x67


def field_of(chip: Chip, *counts: int) -> None:
    """Set a field of this number of LSB in the world."""
    chip.set("magnetic_field_mgauss", *(1.5 * count for count in counts))


def test_output_equals_example_of_application_note() -> None:
    """AN5069 section 6: the bytes 21 00 1D FF CB FE are 33, -227 and -309 LSB."""
    chip = Chip("LIS2MDL")
    field_of(chip, 33, -227, -309)
    chip.write(CFG_REG_A, 0x8C)
    chip.wait(PS_PER_S)

    assert chip.read(0x68, 6) == bytes.fromhex("21001dffcbfe")
    chip.write(CFG_REG_C, 0x08)
    assert chip.read(0x68, 6) == bytes.fromhex("0021ff1dfecb"), "BLE turns the words"


# -- single measurements --------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("config_a", "config_b", "turn_on_us"),
    [
        (0x81, 0x00, 9400),  # AN5069 Table 8, high resolution
        (0x91, 0x00, 6400),  # low power
        (0x8D, 0x02, 9400 + 10_000),  # offset cancellation: one period (100 Hz) more
        (0x91, 0x02, 6400 + 100_000),
    ],
)
def test_single_measurement_ends_in_idle(config_a: int, config_b: int, turn_on_us: int) -> None:
    chip = Chip("LIS2MDL")
    chip.write(CFG_REG_B, config_b)
    chip.write(CFG_REG_A, config_a)

    chip.wait(turn_on_us * PS_PER_US - 1)
    assert chip.byte(CFG_REG_A) == config_a
    assert chip.byte(STATUS_REG) == 0
    chip.wait(1)
    assert chip.byte(CFG_REG_A) == config_a | 0x03
    assert chip.byte(STATUS_REG) == 0x0F
    assert chip.counts(MAGNETOMETER) == (133, 0, -267)
    chip.wait(PS_PER_S)
    assert chip.byte(STATUS_REG) == 0, "no second sample"


def test_trigger_during_measurement_does_not_restart_it() -> None:
    """ST's examples write MD = 01 in the loop in which they poll."""
    chip = Chip("LIS2MDL")
    chip.write(CFG_REG_A, 0x81)
    for _ in range(4):
        chip.wait(2 * PS_PER_MS)
        chip.write(CFG_REG_A, 0x81)

    chip.wait(1400 * PS_PER_US - 1)
    assert not chip.is_ready(MAGNETOMETER)
    chip.wait(1)
    assert chip.is_ready(MAGNETOMETER)


def test_trigger_after_measurement_starts_next_one() -> None:
    """This also applies if the first measurement was not read, and without clearing its flag."""
    chip = Chip("LIS2MDL")
    chip.write(CFG_REG_A, 0x81)
    chip.wait(20 * PS_PER_MS)
    chip.write(CFG_REG_A, 0x81)

    assert chip.byte(STATUS_REG) == 0x0F
    chip.wait(9400 * PS_PER_US)
    assert chip.byte(STATUS_REG) == 0xFF, "the first one was never read"
    assert chip.byte(CFG_REG_A) == 0x83


def test_single_measurement_is_sampled_at_its_trigger() -> None:
    chip = Chip("LIS2MDL")
    field_of(chip, 1, 1, 1)
    before = chip.world.signals["magnetic_field_mgauss"]
    field_of(chip, 2, 2, 2)
    chip.world.signals["magnetic_field_mgauss"] = step(
        before, chip.world.signals["magnetic_field_mgauss"], 0.015
    )

    chip.write(CFG_REG_A, 0x81)
    chip.wait(PS_PER_S)
    assert chip.counts(MAGNETOMETER) == (1, 1, 1)
    chip.write(CFG_REG_A, 0x81)
    chip.wait(PS_PER_S)
    assert chip.counts(MAGNETOMETER) == (2, 2, 2)


@pytest.mark.parametrize("idle", [0x82, 0x83])
def test_both_idle_codes_measure_nothing(idle: int) -> None:
    chip = Chip("LIS2MDL")
    chip.write(CFG_REG_A, idle)
    chip.wait(PS_PER_S)

    assert chip.byte(STATUS_REG) == 0
    assert chip.byte(CFG_REG_A) == idle


# -- hard-iron offset, self-test, overrun ---------------------------------------------------------------


def test_hard_iron_offset_registers_are_subtracted() -> None:
    """AN5069 section 9. Both ends saturate."""
    chip = Chip("LIS2MDL")
    field_of(chip, 100, -32000, 32000)
    chip.write(OFFSET_X_REG_L, *(40).to_bytes(2, "little"), *(1000).to_bytes(2, "little"), 0x18, 0xFC)
    chip.write(CFG_REG_A, 0x8C)
    chip.wait(PS_PER_S)

    assert chip.counts(MAGNETOMETER) == (60, -32768, 32767)
    chip.write(OFFSET_X_REG_L, 0, 0, 0, 0, 0, 0)
    chip.wait(PS_PER_S)
    assert chip.counts(MAGNETOMETER) == (100, -32000, 32000)


def test_self_test_shift_is_within_limits() -> None:
    """AN5069 figure 4 and datasheet T3: 15 to 500 mgauss."""
    chip = Chip("LIS2MDL")
    chip.configure(((CFG_REG_A, 0x8C), (CFG_REG_B, 0x02), (CFG_REG_C, 0x10)))
    chip.wait(60 * PS_PER_MS)
    before = chip.counts(MAGNETOMETER)

    chip.write(CFG_REG_C, 0x12)
    chip.wait(60 * PS_PER_MS)
    after = chip.counts(MAGNETOMETER)

    assert all(15 <= 1.5 * (b - a) <= 500 for a, b in zip(before, after, strict=True))


def test_overrun_bits_are_set_per_unread_axis() -> None:
    """Datasheet T38. The high byte of an axis clears its flags; any high byte clears Zyxda and Zyxor."""
    chip = Chip("LIS2MDL")
    chip.write(CFG_REG_A, 0x8C)
    chip.t_ps = MAGNETOMETER.sample_ps(0)

    chip.read(0x6A, 2)
    assert chip.byte(STATUS_REG) == 0b0000_0101
    chip.t_ps = MAGNETOMETER.sample_ps(1)
    assert chip.byte(STATUS_REG) == 0b0101_1111
    chip.read(0x69)
    assert chip.byte(STATUS_REG) == 0b0100_0110


def test_field_burst_wraps_before_temperature() -> None:
    """After 0x6D comes 0x68, not the temperature, as PX4's driver notes."""
    chip = Chip("LIS2MDL")
    field_of(chip, 1, 2, 3)
    chip.set("temperature_degc", 26.0)
    chip.write(CFG_REG_A, 0x8C)
    chip.wait(PS_PER_S)

    assert chip.read(0x68, 8) == bytes((1, 0, 2, 0, 3, 0, 1, 0))
    assert chip.read(0x6E, 2) == b"\x08\x00"


# -- reset and temperature ------------------------------------------------------------------------------


def test_soft_reset_enters_idle() -> None:
    """Datasheet 8.5: 5 us; ST's driver writes 0x20 and polls."""
    chip = Chip("LIS2MDL")
    chip.configure(((CFG_REG_A, 0x8C), (CFG_REG_B, 0x02), (CFG_REG_C, 0x10), (OFFSET_X_REG_L, 0x40)))
    chip.wait(PS_PER_S)

    chip.write(CFG_REG_A, 0x20)
    chip.wait(5 * PS_PER_US - 1)
    assert chip.byte(CFG_REG_A) == 0x23
    chip.wait(1)
    assert chip.byte(CFG_REG_A) == 0x03
    assert [chip.byte(address) for address in (CFG_REG_B, CFG_REG_C, OFFSET_X_REG_L)] == [0, 0, 0]
    assert chip.counts(MAGNETOMETER) == (0, 0, 0)


def test_soft_reset_can_be_repeated_without_polling() -> None:
    chip = Chip("LIS2MDL")
    chip.write(CFG_REG_A, 0x20)
    chip.wait(PS_PER_MS)
    chip.write(CFG_REG_A, 0x20)

    assert chip.byte(CFG_REG_A) == 0x23
    chip.wait(5 * PS_PER_US)
    assert chip.byte(CFG_REG_A) == 0x03


def test_reboot_takes_20_ms_and_ends_in_idle(words: Words) -> None:
    """AN5069 section 7. REBOOT together with SOFT_RST is forbidden."""
    chip = Chip("LIS2MDL")
    chip.write(CFG_REG_A, 0x8C)
    chip.write(CFG_REG_A, 0xCC)

    chip.wait(20 * PS_PER_MS - 1)
    assert chip.byte(CFG_REG_A) == 0xCF
    chip.wait(1)
    assert chip.byte(CFG_REG_A) == 0x8F
    assert chip.notes == []
    chip.write(CFG_REG_A, 0x63)
    assert kinds(chip.notes) == ["forbidden"]
    words("sensors", texts(chip.notes))


def test_thermometer_needs_comp_temp_en() -> None:
    """Datasheet T26: the bit must be 1 for correct operation. The bit may be switched during measurements."""
    chip = Chip("LIS2MDL")
    chip.set("temperature_degc", 30.0)
    chip.write(CFG_REG_A, 0x0C)
    chip.wait(PS_PER_S)
    assert chip.counts(LIS2MDL_TEMPERATURE) == (0,)

    chip.write(CFG_REG_A, 0x8C)
    chip.wait(10 * PS_PER_MS)
    assert chip.counts(LIS2MDL_TEMPERATURE) == (40,)

    chip.write(CFG_REG_A, 0x0C)
    chip.set("temperature_degc", 35.0)
    chip.wait(PS_PER_S)
    assert chip.counts(LIS2MDL_TEMPERATURE) == (40,)


def test_drdy_pin_does_not_slow_repeated_measurements() -> None:
    """Each measurement writes CFG_REG_A. A thousand writes must not add a thousand hooks to a read."""
    chip = Chip("LIS2MDL")
    chip.write(0x62, 0x01)  # CFG_REG_C: DRDY_on_PIN
    for _ in range(1500):
        chip.write(CFG_REG_A, 0x81)
    chip.wait(20 * PS_PER_MS)

    assert chip.is_ready(MAGNETOMETER)
    chip.counts(MAGNETOMETER)
    assert not chip.is_ready(MAGNETOMETER)
