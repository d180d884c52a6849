"""Use of the LIS2MDL by real drivers, step by step (ST's example programs; AN5069)."""

from __future__ import annotations

import numpy as np
import pytest

from fcu_emulator.sensors.lis2mdl import LIS2MDLErrors
from tests.support.sensor_fakes import MAGNETOMETER, PS_PER_MS, Chip

OFFSET_X_REG_L, WHO_AM_I, CFG_REG_A, CFG_REG_B, CFG_REG_C, STATUS_REG = 0x45, 0x4F, 0x60, 0x61, 0x62, 0x67
ZYXDA = 0x08
OFF_CANC_AND_ONE_SHOT = 0x12


def set_field(chip: Chip, register: int, mask: int, value: int) -> None:
    """Write a field as ST's drivers do: read, change and write back."""
    chip.write(register, chip.byte(register) & ~mask | value)


def read_when_ready(chip: Chip) -> tuple[int, ...]:
    """Poll the status every millisecond, as the examples do; a sample is due within 100 ms plus turn-on."""
    for _ in range(120):
        if chip.byte(STATUS_REG) & ZYXDA:
            return chip.counts(MAGNETOMETER)
        chip.wait(PS_PER_MS)
    raise AssertionError("no data within 120 ms")


def test_soft_reset_ends_within_four_polls() -> None:
    """ST's driver writes 0x20 and polls at most four times, 1 ms apart."""
    chip = Chip("LIS2MDL")
    chip.configure(((CFG_REG_A, 0x8C), (CFG_REG_B, 0x02)))
    chip.wait(33 * PS_PER_MS)
    assert chip.byte(WHO_AM_I) == 0x40

    chip.write(CFG_REG_A, 0x20)
    polls = 0
    while chip.byte(CFG_REG_A) & 0x20:
        polls += 1
        chip.wait(PS_PER_MS)

    assert polls <= 4
    assert (chip.byte(CFG_REG_A), chip.byte(CFG_REG_B)) == (0x03, 0x00)


def test_polled_data_equal_field() -> None:
    """Set BDU, 10 Hz, cancellation, temperature compensation and continuous mode, each by read-modify-write."""
    chip = Chip("LIS2MDL", LIS2MDLErrors(set_reset_offset_mgauss=(90.0, 90.0, 90.0)))
    for register, mask, value in (
        (CFG_REG_C, 0x10, 0x10),
        (CFG_REG_A, 0x0C, 0x00),
        (CFG_REG_B, 0x02, 0x02),
        (CFG_REG_A, 0x80, 0x80),
        (CFG_REG_A, 0x03, 0x00),
    ):
        set_field(chip, register, mask, value)

    assert [read_when_ready(chip) for _ in range(10)] == [(133, 0, -267)] * 10
    assert chip.notes == []


def test_md_writes_in_loop_do_not_restart_measurement() -> None:
    """The example triggers and polls in the same loop: repeated writes of MD = 01 must not restart the measurement."""
    chip = Chip("LIS2MDL")
    set_field(chip, CFG_REG_A, 0x80, 0x80)
    found = []
    for _ in range(60):
        set_field(chip, CFG_REG_A, 0x03, 0x01)
        if chip.byte(STATUS_REG) & ZYXDA:
            found.append(chip.counts(MAGNETOMETER))
        chip.wait(PS_PER_MS)

    assert found == [(133, 0, -267)] * 5, "every 10 ms: 9.4 ms and the rest of a millisecond"


def test_mean_of_two_single_measurements_cancels_offset() -> None:
    """AN5069 section 8."""
    chip = Chip("LIS2MDL", LIS2MDLErrors(set_reset_offset_mgauss=(90.0, -45.0, 60.0)))
    chip.configure(((CFG_REG_B, OFF_CANC_AND_ONE_SHOT), (CFG_REG_A, 0x8F)))
    pairs = []
    for _ in range(2):
        chip.write(CFG_REG_A, 0x8D)
        pairs.append(read_when_ready(chip))

    assert pairs[0] != pairs[1]
    assert np.mean(pairs, axis=0) == pytest.approx([133, 0, -267], abs=0.5)


@pytest.mark.parametrize("config_b", [0x02, 0x00], ids=["application note", "ST's example"])
@pytest.mark.parametrize("seed", range(3))
def test_self_test_moves_mean_within_limits(config_b: int, seed: int) -> None:
    """AN5069 figure 4: the mean of 50 samples moves by 15 to 500 mgauss, on a typical sensor with its noise."""
    chip = Chip("LIS2MDL", LIS2MDLErrors.of_quality("typical", seed), seed)

    def mean_of_50() -> np.ndarray[tuple[int], np.dtype[np.float64]]:
        read_when_ready(chip)  # to be discarded
        return 1.5 * np.mean([read_when_ready(chip) for _ in range(50)], axis=0)

    chip.configure(((CFG_REG_A, 0x8C), (CFG_REG_B, config_b), (CFG_REG_C, 0x10)))
    chip.wait(20 * PS_PER_MS)
    before = mean_of_50()
    chip.write(CFG_REG_C, 0x12)
    chip.wait(60 * PS_PER_MS)
    moved = mean_of_50() - before
    chip.configure(((CFG_REG_C, 0x10), (CFG_REG_A, 0x83)))

    assert np.all((moved >= 15) & (moved <= 500))
    assert chip.byte(CFG_REG_A) == 0x83


def test_six_offset_bytes_are_written_in_one_burst() -> None:
    """ST's driver writes 0x45 to 0x4A in one burst. These bytes are the counts of the field, so the result is 0."""
    chip = Chip("LIS2MDL")
    chip.write(OFFSET_X_REG_L, *(133).to_bytes(2, "little"), 0, 0, *(0x10000 - 267).to_bytes(2, "little"))
    chip.write(CFG_REG_A, 0x8C)

    assert read_when_ready(chip) == (0, 0, 0)
