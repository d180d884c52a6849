"""Bursts that wrap in the LSM6DSL (AN5040 Rev 3, 4.7)."""

from __future__ import annotations

import pytest

from tests.support.sensor_fakes import PS_PER_S, Chip, ramp

CTRL1_XL, CTRL2_G, CTRL3_C, CTRL5_C, CTRL7_G = 0x10, 0x11, 0x12, 0x14, 0x16
ROUNDING_STATUS = 0x04
STATUS_PATTERN = (0x1B, 0x1C, 0x1D, 0x1E, 0x53)

PATTERNS = {  # ROUNDING[2:0]: first and last address
    1: (0x28, 0x2D),  # accelerometer
    2: (0x22, 0x27),  # gyroscope
    3: (0x22, 0x2D),  # gyroscope and accelerometer
    4: (0x2E, 0x33),  # sensor hub 1 to 6
    5: (0x28, 0x33),  # accelerometer and sensor hub 1 to 6
    6: (0x22, 0x39),  # gyroscope, accelerometer, sensor hub 1 to 12
    7: (0x22, 0x33),  # gyroscope, accelerometer, sensor hub 1 to 6
}


def measuring(*writes: tuple[int, int]) -> Chip:
    chip = Chip("LSM6DSL")
    chip.world.signals["acceleration_g"] = ramp((0.1, 0.2, 0.3), (0.01, 0.02, 0.03))
    chip.world.signals["angular_rate_dps"] = ramp((10.0, 20.0, 30.0), (1.0, 2.0, 3.0))
    chip.configure(((CTRL1_XL, 0x40), (CTRL2_G, 0x40), *writes))
    chip.wait(PS_PER_S)
    return chip


@pytest.mark.parametrize(("code", "pattern"), PATTERNS.items())
def test_burst_wraps_in_its_pattern(code: int, pattern: tuple[int, int]) -> None:
    first, last = pattern
    length = last - first + 1
    once = measuring().read(first, length)
    chip = measuring((CTRL5_C, code << 5))

    assert chip.read(first, 3 * length) == 3 * once
    assert chip.part.advance(first, length) == first
    assert chip.part.advance(last, 1) == first
    assert chip.notes == []


@pytest.mark.parametrize("code", PATTERNS)
def test_bursts_outside_patterns_do_not_wrap(code: int) -> None:
    chip = measuring((CTRL5_C, code << 5))
    last = PATTERNS[code][1]

    for address in set(range(0x80)) - {last, 0x3F}:
        assert chip.part.advance(address, 1) == (address + 1) % 0x80


def test_bursts_without_rounding_do_not_wrap() -> None:
    chip = measuring((CTRL5_C, 7 << 5), (CTRL5_C, 0x00))

    assert chip.part.advance(0x22, 24) == 0x3A


def test_rounding_status_wraps_over_source_registers() -> None:
    chip = measuring((CTRL7_G, ROUNDING_STATUS))
    one_by_one = bytes(chip.byte(address) for address in STATUS_PATTERN)

    assert one_by_one[3] & 0x07 == 0x07
    assert chip.read(0x1B, 10) == 2 * one_by_one
    visited = [chip.part.advance(0x1B, count) for count in range(10)]
    assert visited == [*STATUS_PATTERN, *STATUS_PATTERN]


def test_both_roundings_can_be_enabled_together() -> None:
    chip = measuring((CTRL5_C, 1 << 5), (CTRL7_G, ROUNDING_STATUS))

    assert chip.part.advance(0x2D, 1) == 0x28
    assert chip.part.advance(0x1E, 1) == 0x53


@pytest.mark.parametrize("ctrl5", [0x00, 3 << 5])
def test_fifo_data_always_wraps(ctrl5: int) -> None:
    chip = measuring((CTRL5_C, ctrl5))

    assert [chip.part.advance(0x3D, count) for count in range(5)] == [0x3D, 0x3E, 0x3F, 0x3E, 0x3F]


def test_no_burst_wraps_without_increment() -> None:
    chip = measuring((CTRL5_C, 1 << 5), (CTRL3_C, 0x00))

    assert chip.read(0x2D, 4) == 4 * chip.read(0x2D)


def test_software_reset_ends_rounding() -> None:
    chip = measuring((CTRL5_C, 1 << 5), (CTRL7_G, ROUNDING_STATUS), (CTRL3_C, 0x01))

    assert chip.part.advance(0x2D, 1) == 0x2E
    assert chip.part.advance(0x1E, 1) == 0x1F


def test_wrapped_burst_releases_held_word() -> None:
    """BDU holds the pair from the read of its low byte to the read of its high byte. The next round has newer data."""
    chip = measuring((CTRL3_C, 0x44), (CTRL5_C, 1 << 5))
    low = chip.read(0x28)
    old = chip.read(0x2A, 4)
    chip.wait(PS_PER_S)
    data = chip.read(0x29, 11)

    assert data[5:] == chip.read(0x28, 6)
    assert low + data[:1] != data[5:7]
    assert old != data[1:5] == data[7:]
