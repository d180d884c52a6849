"""The LSM6DSL's accelerometer filters for a driver: sines, steps, starts (AN5040 Rev 3, 3.7)."""

from __future__ import annotations

import math

import pytest

from tests.support.filter_fakes import at_rate, measured
from tests.support.notes import kinds, texts
from tests.support.sensor_fakes import ACCELEROMETER, PS_PER_S, Channel, Chip, Writes, constant, step
from tests.support.words import Words

CTRL1_XL, CTRL2_G, CTRL5_C, CTRL6_C, CTRL7_G, CTRL8_XL, X_OFS_USR = 0x10, 0x11, 0x14, 0x15, 0x16, 0x17, 0x73
HALF_POWER = math.sqrt(0.5)


def stepped(writes: Writes, samples: int, code: int = 6, narrow: int = 0) -> tuple[Chip, Channel]:
    """Return a sensor with a step from 0 g to 1 g on every axis after sample 9, at a time ``samples`` later."""
    channel, chip = at_rate(ACCELEROMETER, code), Chip("LSM6DSL")
    at_s = (channel.sample_ps(9) + 1000) / PS_PER_S
    chip.world.signals[channel.name] = step(constant(0, 0, 0), constant(1, 1, 1), at_s)
    chip.configure((*writes, (CTRL1_XL, code << 4 | narrow)))
    chip.t_ps = channel.sample_ps(9 + samples)
    return chip, channel


# -- accelerometer: bandwidths (AN5040 Table 10) -----------------------------------------------------------

XL_416 = at_rate(ACCELEROMETER, 6)


@pytest.mark.parametrize(
    ("ctrl1", "ctrl8", "bandwidth"),
    [
        (0x62, 0x00, 416 / 4),  # LPF1_BW_SEL
        (0x60, 0x80, 416 / 50),
        (0x60, 0xA0, 416 / 100),
        (0x60, 0xC0, 416 / 9),
        (0x60, 0xE0, 416 / 400),
        (0x62, 0xC0, 416 / 9),  # LPF1_BW_SEL is not in this path
        (0x60, 0x04, 416 / 4),  # slope
        (0x60, 0x24, 416 / 100),
        (0x60, 0x44, 416 / 9),
        (0x60, 0x64, 416 / 400),
        (0x62, 0x84, 416 / 4),  # HP_SLOPE_XL_EN goes before LPF2_XL_EN
    ],
)
def test_power_is_half_at_bandwidth(ctrl1: int, ctrl8: int, bandwidth: float) -> None:
    gain = abs(measured(XL_416, ((CTRL8_XL, ctrl8), (CTRL1_XL, ctrl1)), bandwidth, skip=2500, count=1300))
    assert gain == pytest.approx(HALF_POWER, rel=0.005)


@pytest.mark.parametrize("ctrl8", [0x00, 0x08])
def test_samples_without_filter_equal_those_of_world(ctrl8: int) -> None:
    """Samples can only show up to ODR/2. INPUT_COMPOSITE has no effect without a filter."""
    found = measured(XL_416, ((CTRL8_XL, ctrl8), (CTRL1_XL, 0x60)), 150.0, skip=0)
    assert found == pytest.approx(1.0, abs=1e-4)


def test_input_composite_adds_odr_4_filter() -> None:
    plain, narrow = (
        abs(measured(XL_416, ((CTRL8_XL, ctrl8), (CTRL1_XL, 0x60)), 416 / 4, skip=300))
        for ctrl8 in (0xC0, 0xC8)
    )
    assert narrow / plain == pytest.approx(HALF_POWER, rel=0.01)


@pytest.mark.parametrize(
    ("code", "bw0", "bandwidth"),
    [(10, 0, 1500.0), (10, 1, 400.0), (9, 1, 400.0), (8, 1, 400.0), (7, 0, 400.0)],
)
def test_bw0_xl_selects_analog_filter(code: int, bw0: int, bandwidth: float) -> None:
    """1500 Hz at 1666 Hz and above, or 400 Hz with BW0_XL = 1; always 400 Hz at lower rates. LPF1 at ODR/2 follows."""
    channel = at_rate(ACCELEROMETER, code)
    writes = ((CTRL1_XL, code << 4 | bw0),)
    gain = abs(measured(channel, writes, bandwidth, skip=200, count=1300, world=True))
    lpf1 = 1.0 if code == 10 else 1.0 / math.sqrt(1.0 + (bandwidth / (float(channel.rate_hz) / 2)) ** 8)
    assert gain == pytest.approx(HALF_POWER * lpf1, rel=0.01)


def test_low_power_has_no_analog_filter() -> None:
    """AN5040 3.7: only in high performance. At 208 Hz no other filter is visible, at 833 Hz there is no low power."""
    high_performance_always = ((CTRL6_C, 0x10), (CTRL1_XL, 0x70))
    gain = measured(at_rate(ACCELEROMETER, 7), high_performance_always, 400.0, 200, 1300, world=True)
    assert abs(gain) < 0.71
    normal = ((CTRL6_C, 0x10), (CTRL1_XL, 0x50))
    gain = measured(at_rate(ACCELEROMETER, 5), normal, 90.0, 200, world=True)
    assert abs(gain) == pytest.approx(1.0, abs=1e-3)  # LPF1 at 740 Hz; 400 Hz would take 1e-3 more


# -- accelerometer: settling and first samples -------------------------------------------------------------


@pytest.mark.parametrize(
    ("ctrl8", "samples"), [(0x00, 1), (0x80, 40), (0xA0, 80), (0xC0, 15), (0xE0, 320)], ids=hex
)
def test_step_has_settled_after_documented_samples(ctrl8: int, samples: int) -> None:
    """AN5040 Table 10, samples to settle, to 5 %. A quarter of them is not enough."""
    chip, channel = stepped(((CTRL8_XL, ctrl8),), samples)
    settled = chip.counts(channel)
    chip, _ = stepped(((CTRL8_XL, ctrl8),), samples // 4)

    assert settled == pytest.approx((16393,) * 3, rel=0.05)
    assert max(chip.counts(channel)) < 0.9 * 16393


@pytest.mark.parametrize(
    ("ctrl8", "narrow", "end"),
    [(0x00, 0x02, 16393), (0x04, 0x00, 0), (0x0C, 0x00, 0)],
    ids=["LPF1 at ODR/4", "slope", "slope behind LPF1 at ODR/4"],
)
def test_short_filters_settle_in_14_samples(ctrl8: int, narrow: int, end: int) -> None:
    """AN5040 Table 10, to 1 % of the step. After the first sample they have not settled."""
    found = [stepped(((CTRL8_XL, ctrl8),), count, narrow=narrow) for count in (1, 14)]
    first, last = (chip.counts(channel)[0] for chip, channel in found)

    assert last == pytest.approx(end, abs=0.01 * 16393)
    assert abs(first - end) > 0.1 * 16393


def test_second_sample_after_step_depends_on_setting() -> None:
    found = [stepped(((CTRL8_XL, ctrl8),), 2)[0].counts(XL_416)[0] for ctrl8 in (0x00, 0xC0, 0x80, 0xE0)]
    assert found == sorted(found, reverse=True)
    assert len(set(found)) == 4


def test_low_pass_starts_settled_on_first_sample() -> None:
    chip = Chip("LSM6DSL")
    chip.configure(((CTRL8_XL, 0xE0), (CTRL1_XL, 0x60)))
    for number in (0, 1, 10, 5000):
        chip.t_ps = XL_416.sample_ps(number)
        assert chip.counts(XL_416) == (0, 0, 0x4009)


def test_slope_filter_starts_with_half_first_sample() -> None:
    """AN5040 3.7: (a[n] - a[n-1]) / 2 with a[-1] = 0, which causes the spurious wake-up of 5.3."""
    chip = Chip("LSM6DSL")
    chip.configure(((CTRL8_XL, 0x04), (CTRL1_XL, 0x60)))
    found = []
    for number in range(3):
        chip.t_ps = XL_416.sample_ps(number)
        found.append(chip.counts(XL_416))

    assert found == [(0, 0, 8197), (0, 0, 0), (0, 0, 0)]


@pytest.mark.parametrize(("code", "samples"), [(1, 80), (2, 15), (3, 320)])
def test_high_pass_removes_gravity(code: int, samples: int) -> None:
    chip = Chip("LSM6DSL")
    chip.configure(((CTRL8_XL, 0x04 | code << 5), (CTRL1_XL, 0x60)))

    chip.t_ps = XL_416.sample_ps(0)
    assert chip.counts(XL_416)[2] > 0.6 * 16393
    chip.t_ps = XL_416.sample_ps(samples)
    assert abs(chip.counts(XL_416)[2]) < 0.06 * 16393
    chip.t_ps = XL_416.sample_ps(10 * samples)
    assert chip.counts(XL_416) == (0, 0, 0)


def test_reference_mode_subtracts_sample_at_enable() -> None:
    """AN5040 3.7."""
    chip = Chip("LSM6DSL")
    chip.set("acceleration_g", 0.1, 0.2, 0.3)
    chip.configure(((CTRL8_XL, 0x74), (CTRL1_XL, 0x60)))
    chip.t_ps = XL_416.sample_ps(0)
    assert chip.counts(XL_416) == (0, 0, 0)

    later = step(constant(0.1, 0.2, 0.3), constant(0.2, 0.2, 0.0), (chip.t_ps + 1) / PS_PER_S)
    chip.world.signals["acceleration_g"] = later
    chip.part.world_changed()
    for number in (1, 5000):
        chip.t_ps = XL_416.sample_ps(number)
        assert chip.counts(XL_416) == (1639, 0, -4918)  # 0.1 g and -0.3 g at 0.061 mg
    chip.write(CTRL8_XL, 0x00)
    chip.t_ps = XL_416.sample_ps(5001)
    assert chip.counts(XL_416) == (3279, 3279, 0)


def test_filter_applies_to_self_test_not_user_offset() -> None:
    chip = Chip("LSM6DSL")
    chip.set("acceleration_g", 0.0, 0.0, 0.0)
    chip.configure(((CTRL8_XL, 0xE0), (CTRL1_XL, 0x60)))
    chip.t_ps = XL_416.sample_ps(100)
    chip.counts(XL_416)

    chip.write(X_OFS_USR, 0x40)
    chip.t_ps = XL_416.sample_ps(101)
    assert chip.counts(XL_416) == (1025, 0, 0)  # 64 * 2^-10 g at 0.061 mg
    chip.write(CTRL5_C, 0x01)
    chip.t_ps = XL_416.sample_ps(102)
    assert 0 < chip.counts(XL_416)[1] < 0.01 * 0.8 / 0.000061
    chip.t_ps = XL_416.sample_ps(5000)
    assert chip.counts(XL_416)[1] == round(0.8 / 0.000061)


def test_full_scale_change_keeps_filter_state() -> None:
    changed, channel = stepped(((CTRL8_XL, 0xE0),), 60)
    changed.write(CTRL1_XL, 0x6C)  # 8 g, 0.244 mg
    unchanged, _ = stepped(((CTRL8_XL, 0xE0),), 150)
    changed.t_ps = unchanged.t_ps

    expected = unchanged.counts(channel)[0] * 0.061
    assert 200 < expected < 900
    assert changed.counts(channel)[0] * 0.244 == pytest.approx(expected, abs=0.16)


def test_filter_change_restarts_with_next_sample() -> None:
    chip, channel = stepped(((CTRL8_XL, 0xE0),), 20)
    chip.counts(channel)
    chip.write(CTRL8_XL, 0x80)
    chip.t_ps = channel.sample_ps(30)
    assert chip.counts(channel) == (16393,) * 3


@pytest.mark.parametrize(
    "writes",
    [
        ((CTRL8_XL, 0x90),),
        ((CTRL8_XL, 0x14),),
        ((CTRL2_G, 0x50), (CTRL7_G, 0xC0)),
    ],
)
def test_setting_without_its_condition_is_noted(writes: Writes, words: Words) -> None:
    chip = Chip("LSM6DSL")
    chip.configure(writes)
    assert kinds(chip.notes) == ["forbidden"]
    words("sensors", texts(chip.notes))
