"""CTRL4_C.DRDY_MASK: no data-ready for samples that should be discarded (AN5040 Rev 3, Tables 12 to 16)."""

from __future__ import annotations

from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.support.filter_fakes import at_rate
from tests.support.sensor_fakes import ACCELEROMETER, GYROSCOPE, PS_PER_S, Channel, Chip, Writes

CTRL1_XL, CTRL2_G, CTRL3_C, CTRL4_C, CTRL6_C, CTRL7_G, CTRL8_XL = 0x10, 0x11, 0x12, 0x13, 0x15, 0x16, 0x17
INT1_CTRL, STATUS_REG, OUT_XL = 0x0D, 0x1E, 0x28
FIFO_CTRL3, FIFO_CTRL5, FIFO_STATUS1, FIFO_DATA_OUT = 0x08, 0x0A, 0x3A, 0x3E
MASK = (CTRL4_C, 0x08)


def hidden(chip: Chip, channel: Channel, writes: Writes, most: int = 600) -> int:
    """Return the number of samples after ``writes`` before data-ready is set."""
    began_ps = chip.t_ps
    chip.configure(writes)
    for number in range(most):
        chip.t_ps = began_ps + channel.sample_ps(number) - 1
        assert not chip.is_ready(channel)
        chip.wait(1)
        if chip.is_ready(channel):
            return number
    raise AssertionError(f"no data-ready after {most} samples")


def running(writes: Writes) -> Chip:
    """Return a sensor long after it was switched on, with all data read."""
    chip = Chip("LSM6DSL")
    chip.configure((MASK, *writes))
    chip.wait(5 * PS_PER_S)
    chip.read(0x22, 12)
    return chip


LOW_POWER, NARROW, SLOPE = (CTRL6_C, 0x10), 0x02, (CTRL8_XL, 0x04)


@pytest.mark.parametrize(
    ("code", "wide", "narrow"),
    [(1, 0, 1), (2, 0, 1), (3, 1, 1), (4, 1, 2), (7, 1, 2), (8, 2, 2), (9, 3, 4), (10, 13, 13)],
)
def test_accelerometer_turn_on_hides_documented_samples(code: int, wide: int, narrow: int) -> None:
    """Table 13."""
    channel, ctrl1 = at_rate(ACCELEROMETER, code), code << 4
    assert hidden(Chip("LSM6DSL"), channel, (MASK, (CTRL1_XL, ctrl1))) == wide
    assert hidden(Chip("LSM6DSL"), channel, (MASK, (CTRL1_XL, ctrl1 | NARROW))) == narrow
    assert hidden(Chip("LSM6DSL"), channel, (MASK, SLOPE, (CTRL1_XL, ctrl1))) == narrow


@pytest.mark.parametrize(("ctrl1", "samples"), [(0x40, 0), (0x42, 1), (0x70, 1), (0xB0, 0)])
def test_accelerometer_low_power_turn_on_hides_documented_samples(ctrl1: int, samples: int) -> None:
    """Table 13. 833 Hz is always high performance, for any XL_HM_MODE."""
    channel = replace(ACCELEROMETER, rate_hz={0x70: 833, 0xB0: ACCELEROMETER.rate_hz / 65}.get(ctrl1, 104))
    assert hidden(Chip("LSM6DSL"), channel, (MASK, LOW_POWER, (CTRL1_XL, ctrl1))) == samples


@pytest.mark.parametrize(
    ("before", "change", "code", "samples"),
    [
        (((CTRL1_XL, 0x40),), ((CTRL1_XL, 0x60),), 6, 2),  # Table 13's 1, and 1
        (((CTRL1_XL, 0x40),), ((CTRL1_XL, 0xA0),), 10, 14),
        (((CTRL1_XL, 0xA0),), ((CTRL1_XL, 0x60),), 6, 2),
        (((CTRL1_XL, 0xA0),), ((CTRL1_XL, 0x80),), 8, 5),
        (((CTRL1_XL, 0x80),), ((CTRL1_XL, 0x90),), 9, 5),
        (((LOW_POWER), (CTRL1_XL, 0x40)), ((CTRL1_XL, 0x60),), 6, 2),
        (((CTRL1_XL, 0x60),), ((CTRL6_C, 0x10), (CTRL1_XL, 0x40)), 4, 1),
        (((CTRL1_XL, 0x40),), ((CTRL1_XL, 0x4C),), 4, 0),  # another full scale
    ],
)
def test_accelerometer_changes_hide_documented_samples(
    before: Writes, change: Writes, code: int, samples: int
) -> None:
    """Table 12."""
    chip = running(before)
    channel = at_rate(ACCELEROMETER, code)
    if samples == 0:  # the rate goes on: count from its last sample
        chip.t_ps = channel.sample_ps(600)
        chip.counts(channel)
    assert hidden(chip, channel, change) == samples


@pytest.mark.parametrize(
    ("code", "off", "on"),
    [(1, 2, 2), (2, 3, 3), (4, 3, 4), (5, 3, 5), (6, 3, 6), (7, 3, 9), (8, 135, 135), (10, 540, 540)],
)
def test_gyroscope_turn_on_hides_documented_samples(code: int, off: int, on: int) -> None:
    """Table 16, without and with LPF1. The larger number of a range is used."""
    channel, ctrl2 = at_rate(GYROSCOPE, code), (CTRL2_G, code << 4)
    assert hidden(Chip("LSM6DSL"), channel, (MASK, ctrl2)) == off
    assert hidden(Chip("LSM6DSL"), channel, ((CTRL4_C, 0x0A), ctrl2)) == on


@pytest.mark.parametrize(
    ("before", "change", "code", "samples"),
    [
        ((), ((CTRL7_G, 0x80), (CTRL2_G, 0x40)), 4, 1),  # low power and normal
        (((CTRL2_G, 0x40),), ((CTRL2_G, 0x60),), 6, 2),
        (((CTRL7_G, 0x80), (CTRL2_G, 0x40)), ((CTRL2_G, 0x30),), 3, 1),
        (((CTRL4_C, 0x48), (CTRL2_G, 0x60)), ((CTRL4_C, 0x08),), 6, 3),  # out of sleep
    ],
)
def test_gyroscope_changes_hide_documented_samples(
    before: Writes, change: Writes, code: int, samples: int
) -> None:
    """Tables 14 and 15."""
    channel = at_rate(GYROSCOPE, code)
    if before:
        channel = replace(channel, turn_on_ps=0)
    assert hidden(running(before), channel, change) == samples


# -- what is hidden -------------------------------------------------------------------------------------

FAST = at_rate(ACCELEROMETER, 10)


def fast(*writes: tuple[int, int]) -> Chip:
    chip = Chip("LSM6DSL")
    chip.configure((*writes, (CTRL1_XL, 0xA0)))
    return chip


def test_no_sample_is_hidden_without_mask_bit() -> None:
    assert hidden(Chip("LSM6DSL"), FAST, ((CTRL1_XL, 0xA0),)) == 0


def test_masked_samples_can_be_read() -> None:
    chip = fast(MASK)
    chip.t_ps = FAST.sample_ps(0)
    assert chip.counts(FAST) == (0, 0, 0x4009)


def test_low_byte_read_keeps_flag_masked() -> None:
    chip = fast(MASK)
    chip.t_ps = FAST.sample_ps(5)
    chip.byte(OUT_XL)
    assert chip.byte(STATUS_REG) & 0x01 == 0


@pytest.mark.parametrize("pulsed", [0x00, 0x80])
def test_drdy_pin_is_masked(pulsed: int) -> None:
    chip = fast(MASK, (0x0B, pulsed), (INT1_CTRL, 0x01))
    edges: list[int] = []
    chip.part.pins()[0].observe(lambda at_ps, level: edges.append(at_ps))
    chip.t_ps = FAST.sample_ps(12)
    chip.byte(OUT_XL)
    chip.part.catch_up(chip.t_ps)
    assert edges == []
    assert chip.part.next_event_ps() == FAST.sample_ps(13)

    chip.t_ps = FAST.sample_ps(13)
    chip.part.catch_up(chip.t_ps)
    assert edges[0] == FAST.sample_ps(13)


def test_data_ready_before_rate_change_is_masked() -> None:
    chip = fast(MASK, (INT1_CTRL, 0x01))
    chip.wait(PS_PER_S)
    assert chip.is_ready(FAST)
    chip.write(CTRL1_XL, 0x90)
    assert not chip.is_ready(FAST)
    chip.part.catch_up(chip.t_ps)
    assert chip.part.pins()[0].level == 0


def test_fifo_words_of_masked_samples_are_tagged() -> None:
    """The tag is 7FFF, one of the values in AN5040, until the 13 samples of Table 13 are over."""
    chip = fast(MASK, (CTRL3_C, 0x44), (FIFO_CTRL3, 0x01), (FIFO_CTRL5, 0x56))
    chip.t_ps = FAST.sample_ps(14)
    words = [chip.counts(replace(FAST, address=FIFO_DATA_OUT, axes=1))[0] for _ in range(45)]

    assert words[:39] == [0x7FFF] * 39
    assert words[39:] == [0, 0, 0x4009] * 2


@given(st.lists(st.integers(1, FAST.sample_ps(20)), min_size=1, max_size=8))
def test_drdy_mask_does_not_depend_on_reads(moments: list[int]) -> None:
    looked, last_ps = fast(MASK), max(moments)
    for t_ps in sorted(moments):
        looked.t_ps = t_ps
        looked.byte(STATUS_REG)
    alone = fast(MASK)
    alone.t_ps = looked.t_ps = last_ps

    assert looked.byte(STATUS_REG) == alone.byte(STATUS_REG)
