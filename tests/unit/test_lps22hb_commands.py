"""The LPS22HB's ONE_SHOT, SWRESET and BOOT (datasheet 9.6)."""

from __future__ import annotations

import pytest

from fcu_emulator.sensors import LPS22HB
from tests.support.notes import kinds, texts
from tests.support.sensor_fakes import (
    LPS22HB_TEMPERATURE,
    PRESSURE,
    PS_PER_MS,
    PS_PER_S,
    PS_PER_US,
    Chip,
    constant,
)
from tests.support.words import Words

CTRL_REG1, CTRL_REG2, RES_CONF = 0x10, 0x11, 0x1A
INT_SOURCE, STATUS, PRESS_OUT_XL = 0x25, 0x27, 0x28


# -- one shot -------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("res_conf", "conversion_ms"), [(0x00, 13), (0x01, 5)])
def test_one_shot_measures_once(res_conf: int, conversion_ms: int) -> None:
    """Datasheet 9.6. The times are from the LPS22HH, because the LPS22HB's datasheet gives none."""
    chip = Chip("LPS22HB")
    chip.write(RES_CONF, res_conf)
    chip.write(CTRL_REG2, 0x11)

    chip.wait(conversion_ms * PS_PER_MS - 1)
    assert (chip.byte(CTRL_REG2), chip.byte(STATUS)) == (0x11, 0x00)
    chip.wait(1)
    assert (chip.byte(CTRL_REG2), chip.byte(STATUS)) == (0x10, 0x03)
    assert chip.counts(PRESSURE) == (round(1013.25 * 4096),)
    assert chip.counts(LPS22HB_TEMPERATURE) == (2500,)
    chip.wait(PS_PER_S)
    assert chip.byte(STATUS) == 0x00, "no second sample"


def test_write_during_one_shot_does_not_restart_it() -> None:
    """ST's example sets the bit at every poll."""
    chip = Chip("LPS22HB")
    chip.write(CTRL_REG2, 0x11)
    for _ in range(6):
        chip.wait(2 * PS_PER_MS)
        chip.write(CTRL_REG2, 0x11)

    chip.wait(PS_PER_MS - 1)
    assert chip.byte(STATUS) == 0x00
    chip.wait(1)
    assert chip.byte(STATUS) == 0x03


def test_write_of_0_does_not_end_one_shot() -> None:
    chip = Chip("LPS22HB")
    chip.write(CTRL_REG2, 0x11)
    chip.write(CTRL_REG2, 0x10)

    assert chip.byte(CTRL_REG2) == 0x11
    chip.wait(13 * PS_PER_MS)
    assert (chip.byte(CTRL_REG2), chip.byte(STATUS)) == (0x10, 0x03)


def test_one_shot_can_be_repeated() -> None:
    chip = Chip("LPS22HB")
    for _ in range(3):
        chip.write(CTRL_REG2, 0x11)
        chip.wait(13 * PS_PER_MS)
        assert chip.byte(STATUS) == 0x03
        chip.read(PRESS_OUT_XL, 5)


def test_one_shot_at_running_rate_is_noted(words: Words) -> None:
    """Datasheet 9.6: one-shot is permitted only with ODR = 000."""
    chip = Chip("LPS22HB")
    chip.write(CTRL_REG1, 0x30)
    chip.write(CTRL_REG2, 0x11)

    assert kinds(chip.notes) == ["forbidden"]
    words("sensors", texts(chip.notes))
    assert chip.byte(CTRL_REG2) == 0x10
    chip.wait(13 * PS_PER_MS)
    assert chip.byte(STATUS) == 0x00, "no sample before 40 ms"


# -- reset and boot -------------------------------------------------------------------------------------


def test_swreset_resets_only_documented_registers() -> None:
    listed = {
        0x0B: 0x08,
        0x0C: 0x12,
        0x0D: 0x34,
        0x10: 0x32,
        0x12: 0x04,
        0x14: 0x05,
        0x15: 1,
        0x16: 2,
        0x17: 3,
    }
    kept = {0x18: 0x11, 0x19: 0x22, 0x1A: 0x01}
    chip = Chip("LPS22HB")
    for address, value in {**listed, **kept}.items():
        chip.write(address, value)

    chip.write(CTRL_REG2, 0x14)
    assert chip.byte(CTRL_REG2) == 0x14
    chip.wait(10 * PS_PER_US)

    assert {address: chip.byte(address) for address in listed} == dict.fromkeys(listed, 0x00)
    assert {address: chip.byte(address) for address in kept} == kept
    assert chip.byte(CTRL_REG2) == 0x10


def test_swreset_ends_one_shot() -> None:
    chip = Chip("LPS22HB")
    chip.write(CTRL_REG2, 0x11)
    chip.write(CTRL_REG2, 0x14)
    chip.wait(PS_PER_S)

    assert chip.byte(STATUS) == 0x00
    chip.write(CTRL_REG2, 0x11)
    chip.wait(13 * PS_PER_MS)
    assert chip.byte(STATUS) == 0x03


def test_boot_with_swreset_works() -> None:
    """ST's firmware for the STEVAL-FCU001V1 writes 0x94, and the sensor works afterwards."""
    chip = Chip("LPS22HB")
    chip.write(CTRL_REG1, 0x32)
    chip.write(CTRL_REG2, 0x94)

    assert chip.byte(CTRL_REG2) == 0x94
    chip.wait(40 * PS_PER_MS)
    assert (chip.byte(CTRL_REG2), chip.byte(CTRL_REG1)) == (0x10, 0x00)
    chip.write(CTRL_REG1, 0x32)
    chip.wait(40 * PS_PER_MS)
    assert chip.byte(STATUS) == 0x03
    assert chip.notes == []


def test_sensor_measures_with_ctrl_reg2_0xf8() -> None:
    """FIFO_EN in bypass mode gives plain outputs, and BOOT clears itself."""
    chip = Chip("LPS22HB")
    chip.write(CTRL_REG2, 0xF8)
    chip.write(CTRL_REG1, 0x33)

    chip.wait(40 * PS_PER_MS)
    assert chip.byte(CTRL_REG2) == 0x78
    assert chip.read(PRESS_OUT_XL, 5) == round(1013.25 * 4096).to_bytes(3, "little") + b"\xc4\x09"
    assert chip.notes == []
    assert chip.part.i2c_off
    chip.wait(40 * PS_PER_MS)
    assert chip.byte(STATUS) == 0x03


@pytest.mark.parametrize("code", [6, 7])
def test_undefined_rate_measures_nothing_and_is_noted(code: int, words: Words) -> None:
    """Datasheet T17."""
    chip = Chip("LPS22HB")
    chip.write(CTRL_REG1, code << 4)
    chip.wait(PS_PER_S)

    assert kinds(chip.notes) == ["forbidden"]
    words("sensors", texts(chip.notes))
    assert chip.byte(STATUS) == 0x00
    chip.write(CTRL_REG1, code << 4 | 0x02)
    assert len(chip.notes) == 1, "once, when it comes about"


@pytest.mark.parametrize(("control1", "boots_ps"), [(0x00, PS_PER_MS), (0x30, 40 * PS_PER_MS)])
def test_boot_status_is_set_while_sensor_boots(control1: int, boots_ps: int) -> None:
    """Datasheet 9.15; 9.6: the boot takes one period of the data rate."""
    chip = Chip("LPS22HB")
    chip.write(CTRL_REG1, control1)
    chip.write(CTRL_REG2, 0x90)

    chip.wait(boots_ps - 1)
    assert (chip.byte(INT_SOURCE), chip.byte(CTRL_REG2)) == (0x80, 0x90)
    chip.wait(1)
    assert (chip.byte(INT_SOURCE), chip.byte(CTRL_REG2)) == (0x00, 0x10)
    assert chip.byte(CTRL_REG1) == control1


def test_power_on_time_and_counts_can_be_set() -> None:
    """No time is documented. 2F6666h was observed before the first conversion."""
    part = LPS22HB(constant(1000.0), constant(20.0), powered_on_ps=PS_PER_MS, power_on_counts=0x2F6666)

    assert part.accessible(0)
    assert part.read(INT_SOURCE, 1, 6 * PS_PER_MS - 1) == b"\x80"
    assert part.read(INT_SOURCE, 1, 6 * PS_PER_MS) == b"\x00"
    assert part.read(PRESS_OUT_XL, 5, 6 * PS_PER_MS) == b"\x66\x66\x2f\x00\x00"
    part.write(CTRL_REG1, b"\x50", 5 * PS_PER_MS)
    assert part.read(PRESS_OUT_XL, 3, PS_PER_S) == (1000 * 4096).to_bytes(3, "little")


def test_rate_change_ends_one_shot() -> None:
    chip = Chip("LPS22HB")
    chip.write(CTRL_REG2, 0x11)
    chip.write(CTRL_REG1, 0x10)

    assert chip.byte(CTRL_REG2) == 0x10
    chip.wait(PS_PER_S - 1)
    assert chip.byte(STATUS) == 0x00
    chip.wait(1)
    assert chip.byte(STATUS) == 0x03
