"""The LIS2MDL's threshold interrupt in INT_SOURCE_REG (datasheet 8.8 to 8.11; AN5069 10)."""

from __future__ import annotations

import pytest

from fcu_emulator.sensors import LIS2MDL
from fcu_emulator.sensors.lis2mdl import LIS2MDLErrors
from tests.support.lis2mdl_fakes import (
    CFG_REG_A,
    CFG_REG_B,
    IEA,
    IEL,
    IEN,
    INT_CRTL_REG,
    INT_ON_PIN,
    INT_SOURCE_REG,
    INT_THS_L_REG,
    OFFSET_X_REG_L,
    PERIOD_PS,
    XYZ,
    at,
    played,
    sources,
    threshold,
    watched,
    x_counts,
)
from tests.support.sensor_fakes import MAGNETOMETER, Chip, constant


@pytest.mark.parametrize(
    ("field", "expected"),
    [
        ((101, 0, 0), 0x80),
        ((0, 101, 0), 0x40),
        ((0, 0, 101), 0x20),
        ((-101, 0, 0), 0x10),
        ((0, -101, 0), 0x08),
        ((0, 0, -101), 0x04),
        ((101, -101, 101), 0x80 | 0x08 | 0x20),
        ((100, -100, 0), 0x00),
    ],
)
def test_each_axis_is_compared_both_ways(field: tuple[float, float, float], expected: int) -> None:
    """Datasheet T36: above the positive or below the negative threshold. INT (bit 0) is set with any of these bits."""
    chip = played(field)
    threshold(chip, 100, XYZ | IEA | IEN)

    assert sources(chip, 1) == [expected | (expected != 0)]


def test_disabled_axes_are_not_compared() -> None:
    chip = played((200, 200, 200))
    threshold(chip, 100, 0x40 | IEA | IEN)

    assert sources(chip, 1) == [0x41]


def test_unlatched_register_follows_latest_sample() -> None:
    chip = x_counts(0, 200, 200, 0, -200)
    threshold(chip, 100, XYZ | IEA | IEN)

    assert sources(chip, 5) == [0x00, 0x81, 0x81, 0x00, 0x11]


def test_latched_crossing_stays_until_register_is_read() -> None:
    """AN5069 10: reading clears all bits of the register."""
    chip = x_counts(0, 200, -200, 0, 0)
    threshold(chip, 100, XYZ | IEA | IEL | IEN)

    chip.t_ps = at(4)
    assert [chip.byte(INT_SOURCE_REG), chip.byte(INT_SOURCE_REG)] == [0x80 | 0x10 | 0x01, 0x00]


def test_latched_interrupt_returns_with_next_sample_after_read() -> None:
    chip = x_counts(200)
    threshold(chip, 100, XYZ | IEA | IEL | IEN)

    chip.t_ps = at(0)
    assert [chip.byte(INT_SOURCE_REG), chip.byte(INT_SOURCE_REG)] == [0x81, 0x00]
    chip.t_ps = at(1)
    assert chip.byte(INT_SOURCE_REG) == 0x81


def test_int_bit_is_active_low_with_iea_0() -> None:
    """Datasheet T35."""
    chip = x_counts(0, 200)
    threshold(chip, 100, XYZ | IEN)

    assert sources(chip, 2) == [0x01, 0x80]


@pytest.mark.parametrize("idle_level", [0, 1])
def test_int_bit_of_disabled_generator_is_configurable(idle_level: int) -> None:
    """No document states the value with IEN = 0 and IEA = 0. With IEA = 1 it is 0."""
    still = constant(0.0, 0.0, 0.0), constant(25.0)
    part = LIS2MDL(*still, int_idle_level=1 if idle_level else 0)

    assert part.read(INT_SOURCE_REG, 1, 0)[0] == idle_level
    part.write(INT_CRTL_REG, bytes([XYZ | IEA]), 0)
    assert part.read(INT_SOURCE_REG, 1, 0)[0] == 0


@pytest.mark.parametrize(
    ("after_offset", "expected"),
    [
        (0x00, 0x81),  # 300 measured
        (0x08, 0x00),  # 300 - 250 in the output
    ],
)
def test_hard_iron_offset_applies_with_int_on_dataoff(after_offset: int, expected: int) -> None:
    """Datasheet T28."""
    chip = x_counts(300)
    chip.write(OFFSET_X_REG_L, 250, 0)
    chip.write(CFG_REG_B, after_offset)
    threshold(chip, 100, XYZ | IEA | IEN)

    assert sources(chip, 1) == [expected]
    assert chip.counts(MAGNETOMETER) == (50, 0, 0)


@pytest.mark.parametrize(
    ("counts", "field", "expected"),
    [
        (0x7FFF, -32768, 0x11),
        (0x7FFF, 32767, 0x00),
        (0x8000, -32768, 0x00),
        (0xFFFF, 32767, 0x00),  # unsigned: not -1
        (0x0000, 1, 0x81),
        (0x0000, 0, 0x00),
    ],
)
def test_threshold_is_unsigned_16_bits(counts: int, field: int, expected: int) -> None:
    """Datasheet T38 shows TH15 to TH0."""
    chip = x_counts(field)
    threshold(chip, counts, XYZ | IEA | IEN)

    assert sources(chip, 1) == [expected]


@pytest.mark.parametrize("latch", [0, IEL])
def test_range_overflow_is_latched_until_read(latch: int) -> None:
    """MROI is latched in both modes, but the crossing only with IEL."""
    chip = x_counts(0, 40000, 0, 0)
    threshold(chip, 100, XYZ | IEA | latch | IEN)

    chip.t_ps = at(2)
    assert chip.byte(INT_SOURCE_REG) == (0x83 if latch else 0x02)
    assert chip.byte(INT_SOURCE_REG) == 0x00
    chip.t_ps = at(3)
    assert chip.byte(INT_SOURCE_REG) == 0x00


def test_full_scale_value_is_not_overflow() -> None:
    chip = played((32767, -32768, 0))
    threshold(chip, 0xFFFF, XYZ | IEA | IEN)

    assert sources(chip, 1) == [0x00]


def test_overflow_needs_ien() -> None:
    """AN5069 10.2. The datasheet states that it is always enabled."""
    chip = x_counts(40000)
    threshold(chip, 100, XYZ | IEA)

    assert sources(chip, 1) == [0x00]


def test_samples_before_ien_are_not_compared() -> None:
    chip = x_counts(200, 200, 0)
    threshold(chip, 100, XYZ | IEA | IEL)
    chip.t_ps = at(1)
    chip.write(INT_CRTL_REG, XYZ | IEA | IEL | IEN)

    assert chip.byte(INT_SOURCE_REG) == 0x00
    chip.t_ps = at(5)
    assert chip.byte(INT_SOURCE_REG) == 0x00


def test_switching_generator_off_clears_register() -> None:
    chip = x_counts(200, 0)
    threshold(chip, 100, XYZ | IEA | IEL | IEN)
    chip.t_ps = at(0)
    chip.write(INT_CRTL_REG, XYZ | IEA | IEL)
    assert chip.byte(INT_SOURCE_REG) == 0x00
    chip.t_ps = at(1)
    chip.write(INT_CRTL_REG, XYZ | IEA | IEL | IEN)

    assert chip.byte(INT_SOURCE_REG) == 0x00


def test_new_threshold_applies_from_next_sample() -> None:
    chip = x_counts(200)
    threshold(chip, 100, XYZ | IEA | IEN)
    chip.t_ps = at(3)
    chip.write(INT_THS_L_REG, 0x2C, 0x01)  # 300

    assert chip.byte(INT_SOURCE_REG) == 0x81
    chip.t_ps = at(4)
    assert chip.byte(INT_SOURCE_REG) == 0x00


@pytest.mark.parametrize("single", [False, True])
def test_comparison_includes_output_noise(single: bool) -> None:
    """The bits show X above or below 0 exactly when the output of X is, also after times without reads."""
    chip = Chip("LIS2MDL", LIS2MDLErrors(noise_mgauss=30.0), seed=2)
    chip.set("magnetic_field_mgauss", 0.0, 0.0, 0.0)
    for _ in range(3):
        chip.write(CFG_REG_A, 0x8C)
        chip.wait(7 * PERIOD_PS)
        chip.write(CFG_REG_A, 0x8F)
    threshold(chip, 0, 0x80 | IEA | IEN)
    found = []
    for _ in range(50):
        if single:
            chip.write(CFG_REG_A, 0x81)
        chip.wait(PERIOD_PS)
        x = chip.counts(MAGNETOMETER)[0]
        found.append(chip.byte(INT_SOURCE_REG) == (0x81 if x > 0 else 0x11 if x < 0 else 0x00))

    assert all(found)


def test_single_measurement_is_compared() -> None:
    chip = x_counts(200)
    threshold(chip, 100, XYZ | IEA | IEL | IEN)
    chip.write(CFG_REG_A, 0x83)
    chip.write(CFG_REG_A, 0x81)

    chip.t_ps = at(0) - 1
    assert chip.byte(INT_SOURCE_REG) == 0x00
    chip.t_ps = at(0)
    assert chip.byte(INT_SOURCE_REG) == 0x81


def test_soft_reset_clears_latched_interrupt() -> None:
    chip = x_counts(200)
    threshold(chip, 100, XYZ | IEA | IEL | IEN)
    edges = watched(chip, INT_ON_PIN)
    chip.t_ps = at(0) + 1

    chip.write(CFG_REG_A, 0x20)

    assert chip.byte(INT_SOURCE_REG) == 0x00
    assert chip.part.pins()[0].level is None
    assert edges == [(0, 0), (at(0), 1)]


def test_comparison_uses_field_of_its_sample_time() -> None:
    chip = x_counts(200)
    threshold(chip, 100, XYZ | IEA | IEL | IEN)
    chip.t_ps = at(3)
    chip.part.world_changed(chip.t_ps)
    chip.set("magnetic_field_mgauss", 0.0, 0.0, 0.0)

    assert chip.byte(INT_SOURCE_REG) == 0x81
    chip.t_ps = at(4)
    assert chip.byte(INT_SOURCE_REG) == 0x00
