"""The LPS22HB beyond the contract (datasheet DocID027083 Rev 6)."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction

import pytest

from fcu_emulator.sensors import LPS22HB
from tests.support.notes import kinds, texts
from tests.support.sensor_fakes import PRESSURE, PS_PER_S, Chip, constant, ramp
from tests.support.words import Words

CTRL_REG1, CTRL_REG2, RPDS_L, RES_CONF = 0x10, 0x11, 0x18, 0x1A
STATUS, PRESS_OUT_XL = 0x27, 0x28


def test_pressure_equals_example_of_datasheet() -> None:
    """Datasheet 4.5: 3FF58Dh is 4191629 LSB. The 1023.3 hPa in the datasheet are rounded to one decimal."""
    chip = Chip("LPS22HB")
    chip.set("pressure_hpa", 0x3FF58D / 4096)
    chip.set("temperature_degc", 23.45)
    chip.write(CTRL_REG1, 0x50)
    chip.wait(PS_PER_S)

    assert chip.read(PRESS_OUT_XL, 5) == bytes((0x8D, 0xF5, 0x3F)) + (2345).to_bytes(2, "little")
    assert round(0x3FF58D / 4096, 1) == 1023.3


@pytest.mark.parametrize(("code", "rate_hz"), [(1, 1), (2, 10), (3, 25), (4, 50), (5, 75)])
def test_samples_come_at_every_rate(code: int, rate_hz: int) -> None:
    """Datasheet T17; pressure and temperature together."""
    chip = Chip("LPS22HB")
    chip.write(CTRL_REG1, code << 4)
    channel = replace(PRESSURE, rate_hz=Fraction(rate_hz))
    for sample in range(3):
        chip.t_ps = channel.sample_ps(sample) - 1
        assert chip.byte(STATUS) == 0x00
        chip.wait(1)
        assert chip.byte(STATUS) == 0x03
        chip.read(PRESS_OUT_XL, 5)
    chip.write(CTRL_REG1, 0x00)
    chip.wait(10 * PS_PER_S)
    assert chip.byte(STATUS) == 0x00, "power-down"


def test_pressure_outside_specified_range_is_noted_once(words: Words) -> None:
    """Datasheet Table 3: 260 to 1260 hPa. The output outside of this range is not documented, and here it continues."""
    chip = Chip("LPS22HB")
    chip.write(CTRL_REG1, 0x50)
    found = []
    for hpa in (1260.0, 1261.0, 1300.0, 1013.0, 259.0):
        chip.set("pressure_hpa", hpa)
        chip.wait(PS_PER_S)
        assert int.from_bytes(chip.read(PRESS_OUT_XL, 3), "little") == hpa * 4096
        found.append(len(chip.notes))
    assert found == [0, 1, 1, 1, 2]
    assert set(kinds(chip.notes)) == {"out of range"}
    words("sensors", texts(chip.notes))


# -- output ---------------------------------------------------------------------------------------------


def test_burst_wraps_after_temperature() -> None:
    """Datasheet 5.8: 0x2C is followed by 0x28."""
    chip = Chip("LPS22HB")
    chip.write(CTRL_REG1, 0x50)
    chip.wait(PS_PER_S)

    once = chip.read(PRESS_OUT_XL, 5)
    assert chip.read(PRESS_OUT_XL, 15) == 3 * once
    assert chip.read(0x2B, 4) == once[3:] + once[:2]


def test_burst_without_if_add_inc_stays_at_address() -> None:
    chip = Chip("LPS22HB")
    chip.write(CTRL_REG1, 0x50)
    chip.write(CTRL_REG2, 0x00)
    chip.wait(PS_PER_S)

    assert chip.read(0x2A, 4) == b"\x3f" * 4
    chip.write(RPDS_L, 1, 2, 3)
    assert (chip.byte(RPDS_L), chip.byte(RPDS_L + 1)) == (3, 0)


@pytest.mark.parametrize("count", [16, -16, 32767, -32768])
def test_rpds_is_subtracted_in_sixteenths_of_hpa(count: int) -> None:
    """The LSB is the LPS25H's (AN4450), 1/16 hPa, because the datasheet gives none; 24 bits saturate."""
    chip = Chip("LPS22HB")
    chip.write(RPDS_L, *count.to_bytes(2, "little", signed=True))
    chip.write(CTRL_REG1, 0x50)
    chip.wait(PS_PER_S)

    expected = round((1013.25 - count / 16) * 4096)
    assert chip.counts(PRESSURE) == (min(expected, 0x7FFFFF),)


def test_bdu_holds_outputs_until_press_out_h() -> None:
    """Datasheet 9.5: 0x2A must be read after the other bytes."""
    chip = Chip("LPS22HB")
    chip.world.signals["pressure_hpa"] = ramp((300.0,), (100.0,))
    chip.world.signals["temperature_degc"] = ramp((0.0,), (20.0,))
    chip.write(CTRL_REG1, 0x12)
    chip.wait(PS_PER_S)
    old = chip.read(PRESS_OUT_XL, 5)

    chip.read(PRESS_OUT_XL)
    chip.wait(PS_PER_S)
    assert chip.read(0x2B, 2) == old[3:]
    assert chip.read(0x29, 2) == old[1:3]
    assert chip.read(PRESS_OUT_XL, 5) == (500 * 4096).to_bytes(3, "little") + (4000).to_bytes(2, "little")


def test_flags_and_overruns_are_cleared_separately() -> None:
    """Datasheet 9.20. The byte that clears each flag follows the rule of the LPS25H."""
    chip = Chip("LPS22HB")
    chip.write(CTRL_REG1, 0x10)
    chip.wait(PS_PER_S)

    assert chip.byte(STATUS) == 0x03
    chip.read(0x2C)
    assert chip.byte(STATUS) == 0x01
    chip.wait(PS_PER_S)
    assert chip.byte(STATUS) == 0x13
    chip.read(0x2A)
    assert chip.byte(STATUS) == 0x02
    chip.wait(2 * PS_PER_S)
    assert chip.byte(STATUS) == 0x33, "two samples at once overwrite each other"
    chip.read(PRESS_OUT_XL, 5)
    assert chip.byte(STATUS) == 0x00


# -- configuration ------------------------------------------------------------------------------------------


def test_low_current_changed_outside_power_down_is_noted(words: Words) -> None:
    """Datasheet 9.14."""
    chip = Chip("LPS22HB")
    chip.write(RES_CONF, 0x01)
    chip.write(CTRL_REG1, 0x10)
    chip.write(RES_CONF, 0x01)
    assert chip.notes == []

    chip.write(RES_CONF, 0x00)
    assert kinds(chip.notes) == ["forbidden"]
    words("sensors", texts(chip.notes))
    assert chip.byte(RES_CONF) == 0x00


def test_sim_and_i2c_dis_choose_bus() -> None:
    """Datasheet 9.5, 9.6."""
    chip = Chip("LPS22HB")
    assert (chip.part.spi_wires(), chip.part.i2c_off) == (4, False)
    chip.write(CTRL_REG1, 0x01)
    chip.write(CTRL_REG2, 0x18)
    assert (chip.part.spi_wires(), chip.part.i2c_off) == (3, True)
    chip.write(CTRL_REG2, 0x04)
    assert (chip.part.spi_wires(), chip.part.i2c_off) == (4, False)


@pytest.mark.parametrize(
    ("control1", "res_conf", "microampere"),
    [
        (0x00, 0x00, 1),
        (0x10, 0x00, 12),
        (0x10, 0x01, 3),
        (0x20, 0x01, 21),  # from here on the stated approximation: in proportion to the rate
        (0x30, 0x00, 276),
        (0x50, 0x00, 826),
        (0x60, 0x00, 1),
    ],
)
def test_supply_current_equals_datasheet(control1: int, res_conf: int, microampere: float) -> None:
    """Datasheet T3 at 1 Hz and in power-down."""
    chip = Chip("LPS22HB")
    chip.write(RES_CONF, res_conf)
    chip.write(CTRL_REG1, control1)
    assert chip.part.supply_current_ua() == microampere


def test_unit_of_rpds_can_be_single_counts() -> None:
    """The unit is that in the header of ST's driver for the STEVAL-FCU001V1."""
    part = LPS22HB(constant(1000.0), constant(20.0), rpds_counts_per_lsb=1)
    part.write(RPDS_L, b"\x05\x00", 0)
    part.write(CTRL_REG1, b"\x50", 0)
    assert part.read(PRESS_OUT_XL, 3, PS_PER_S) == (1000 * 4096 - 5).to_bytes(3, "little")
