"""Free fall, wake-up, orientation and tap of the LSM6DSL (AN5040 section 5)."""

from __future__ import annotations

import math

import pytest

from tests.support.motion_fakes import (
    CTRL1_XL,
    CTRL3_C,
    CTRL8_XL,
    D6D_SRC,
    ENABLE,
    FREE_FALL,
    FULL_SCALES,
    INT_DUR2,
    LIR,
    MD1_CFG,
    MD2_CFG,
    ON,
    STILL,
    TAP_CFG,
    TAP_SRC,
    TAP_THS_6D,
    WAKE_UP_DUR,
    WAKE_UP_SRC,
    WAKE_UP_THS,
    Bench,
    Sample,
    sample_ps,
    source_bits,
)
from tests.support.notes import kinds, texts
from tests.support.sensor_fakes import PS_PER_S
from tests.support.words import Words

FF_IA, WU_IA = 0x20, 0x08
TAP_IA, SINGLE_TAP, DOUBLE_TAP, TAP_SIGN = 0x40, 0x20, 0x10, 0x08
D6D_IA = 0x40
FLAT: Sample = (0.0, 0.0, 1000.0)


def along(axis: int, mg: float) -> Sample:
    """Return ``mg`` on one axis, and 0 on the others."""
    x, y, z = (mg if number == axis else 0.0 for number in range(3))
    return x, y, z


def numbers(bits: list[int], mask: int) -> list[int]:
    """Return the samples at which any bit of ``mask`` is set."""
    return [number for number, value in enumerate(bits) if value & mask]


# -- free fall (datasheet Tables 199 and 200) ---------------------------------------------------------------


@pytest.mark.parametrize(("code", "mg"), list(enumerate((156, 219, 250, 312, 344, 406, 469, 500))))
@pytest.mark.parametrize("full_scale", [bits for bits, _ in FULL_SCALES])
def test_free_fall_threshold_ignores_full_scale(code: int, mg: int, full_scale: int) -> None:
    for outside, falls in ((mg - 1, True), (mg + 1, False)):
        for axis in range(3):
            for sign in (1, -1):
                bench = Bench([along(axis, sign * outside)], (FREE_FALL, code), (TAP_CFG, ENABLE))
                bench.write(CTRL1_XL, ON | full_scale)
                assert bool(bench.at(5).byte(WAKE_UP_SRC) & FF_IA) is falls


@pytest.mark.parametrize("duration", [0, 1, 6, 31, 32, 63])
def test_free_fall_is_reported_after_its_duration(duration: int) -> None:
    """Free fall is reported FF_DUR periods after the first sample of the fall, and only while the fall lasts."""
    samples = [FLAT] * 5 + [STILL] * 70 + [FLAT] * 2
    writes = (FREE_FALL, (duration & 0x1F) << 3 | 3), (WAKE_UP_DUR, (duration >> 5) << 7)

    bits = source_bits(WAKE_UP_SRC, samples, *writes)

    assert numbers(bits, FF_IA) == list(range(5 + duration, 75))


def test_interrupted_free_fall_restarts() -> None:
    samples = [FLAT, *[STILL] * 4, FLAT, *[STILL] * 6]

    assert numbers(source_bits(WAKE_UP_SRC, samples, (FREE_FALL, 4 << 3 | 3)), FF_IA) == [10, 11]


# -- wake-up (AN5040 5.3) -----------------------------------------------------------------------------------


@pytest.mark.parametrize(("bits", "g"), FULL_SCALES)
@pytest.mark.parametrize("code", [1, 2, 33, 60])
@pytest.mark.parametrize("axis", [0, 1, 2])
def test_wake_up_threshold_is_full_scale_over_64(bits: int, g: int, code: int, axis: int) -> None:
    """The slope is half the step from one sample to the next."""
    threshold = code * g * 1000 / 64
    for factor, wakes in ((0.97, False), (1.03, True)):
        half = threshold * factor  # from one side of zero to the other, so that it fits the range
        samples = [along(axis, -half)] * 3 + [along(axis, half)] * 2
        bench = Bench(samples, (WAKE_UP_THS, code), (TAP_CFG, ENABLE), xl=ON | bits)
        axes = {0: 0x04, 1: 0x02, 2: 0x01}
        assert bench.at(3).byte(WAKE_UP_SRC) & 0x0F == (WU_IA | axes[axis] if wakes else 0)


def test_first_slope_is_half_of_gravity() -> None:
    """AN5040 5.3: there is one spurious wake-up, as with the real sensor, but not when interrupts are enabled later."""
    assert numbers(source_bits(WAKE_UP_SRC, [FLAT] * 5, (WAKE_UP_THS, 15)), WU_IA) == [0]
    assert numbers(source_bits(WAKE_UP_SRC, [FLAT] * 5, (WAKE_UP_THS, 17)), WU_IA) == []

    bench = Bench([FLAT], (WAKE_UP_THS, 15)).at(20)
    bench.write(TAP_CFG, ENABLE)
    assert [bench.at(number).byte(WAKE_UP_SRC) for number in range(21, 25)] == [0, 0, 0, 0]


@pytest.mark.parametrize("duration", [0, 1, 2, 3])
def test_wake_up_needs_wake_dur_samples_over_threshold(duration: int) -> None:
    samples = [STILL] * 2 + [(200.0 * number, 0.0, 0.0) for number in range(1, 6)] + [(1000.0, 0.0, 0.0)] * 3

    bits = source_bits(WAKE_UP_SRC, samples, (WAKE_UP_THS, 2), (WAKE_UP_DUR, duration << 5))

    assert numbers(bits, WU_IA) == list(range(2 + duration, 7))


def test_wake_up_high_pass_lasts_longer_than_slope() -> None:
    """SLOPE_FDS: after a step the slope returns to 0 immediately, but the high-pass at ODR/9 decays."""
    samples = [STILL] * 3 + [(1000.0, 0.0, 0.0)] * 40
    ths = (WAKE_UP_THS, 8)  # 250 mg

    slope = source_bits(WAKE_UP_SRC, samples, ths, (CTRL8_XL, 0x40))
    high_pass = source_bits(WAKE_UP_SRC, samples, ths, (CTRL8_XL, 0x40), (TAP_CFG, 0x10))

    assert numbers(slope, WU_IA) == [3]
    decay = 1 / (1 + 2 * math.pi / 9)  # one pole at ODR/9
    assert numbers(high_pass, WU_IA) == [3 + n for n in range(10) if 1000 * decay ** (n + 1) > 250]


# -- orientation (AN5040 5.4) -------------------------------------------------------------------------------

POSITIONS = [(2, 1, 0x20), (2, -1, 0x10), (1, 1, 0x08), (1, -1, 0x04), (0, 1, 0x02), (0, -1, 0x01)]


@pytest.mark.parametrize(("axis", "sign", "bit"), POSITIONS)
def test_orientation_is_reported_at_its_second_sample(axis: int, sign: int, bit: int) -> None:
    before = (2 if axis != 2 else 0, 1)
    samples = [along(before[0], 1000.0)] * 4 + [along(axis, sign * 1000.0)] * 4

    bits = source_bits(D6D_SRC, samples, (TAP_THS_6D, 0x40))

    old = 0x20 if before[0] == 2 else 0x02
    assert bits == [0, D6D_IA | old, old, old, old, D6D_IA | bit, bit, bit]


@pytest.mark.parametrize(("code", "angle"), list(enumerate((80, 70, 60, 50))))
@pytest.mark.parametrize("full_scale", [bits for bits, _ in FULL_SCALES])
def test_orientation_needs_other_axes_outside_threshold_angle(code: int, angle: int, full_scale: int) -> None:
    """An orientation is recognised while no second axis is within SIXD_THS of the vertical, for any full scale."""
    for tilt, known in ((90 - angle - 1, True), (90 - angle + 1, False)):
        x, z = 1000 * math.sin(math.radians(tilt)), 1000 * math.cos(math.radians(tilt))
        bench = Bench([(x, 0.0, z)], (TAP_THS_6D, code << 5), (TAP_CFG, ENABLE), xl=ON | full_scale)
        assert bench.at(5).byte(D6D_SRC) == (0x20 if known else 0)


def test_single_sample_is_not_orientation() -> None:
    samples = [FLAT] * 3 + [along(0, 1000.0)] + [FLAT] * 3

    assert numbers(source_bits(D6D_SRC, samples, (TAP_THS_6D, 0x40)), D6D_IA) == [1]


def test_4d_ignores_z() -> None:
    """AN5040 5.4.2 sets D4D_EN to enable 4D; the sentence in the datasheet says the opposite."""
    samples = [along(0, 1000.0)] * 3 + [FLAT] * 3 + [along(1, -1000.0)] * 3

    bits = source_bits(D6D_SRC, samples, (TAP_THS_6D, 0x80 | 0x40))

    assert bits == [0, D6D_IA | 0x02, *[0x02] * 5, D6D_IA | 0x04, 0x04]


# -- tap (AN5040 5.5) ---------------------------------------------------------------------------------------


def bumps(*starts: tuple[int, int], length: int = 80, mg: float = 1000.0) -> list[Sample]:
    """Return rest with ramps on X, each (first sample, samples over the threshold). Their slope is mg/2."""
    values, level = [], 0.0
    for number in range(length):
        for first, count in starts:
            if first <= number < first + count:
                level += mg * (1 if number % 2 else -1)
        values.append((level, 0.0, 0.0))
    return values


TAP_X = (TAP_CFG, 0x08)
TAP_THS = (TAP_THS_6D, 4)  # 250 mg at 2 g


@pytest.mark.parametrize(("bits", "g"), FULL_SCALES)
@pytest.mark.parametrize("code", [1, 15, 31])
def test_tap_threshold_is_32nd_of_full_scale(bits: int, g: int, code: int) -> None:
    threshold = code * g * 1000 / 32
    for factor, taps in ((0.95, False), (1.02, True)):
        half = 0.98 * threshold * factor
        samples = [(-half, 0.0, 0.0)] * 30 + [(2 * threshold * factor - half, 0.0, 0.0)] * 3
        bench = Bench(samples, (TAP_THS_6D, code), (TAP_CFG, ENABLE | 0x08), xl=ON | bits)
        assert bool(bench.at(31).byte(TAP_SRC) & SINGLE_TAP) is taps


@pytest.mark.parametrize(("shock", "samples"), [(0, 4), (1, 8), (2, 16), (3, 24)])
def test_tap_must_end_within_shock(shock: int, samples: int) -> None:
    for length, taps in ((1, True), (samples, True), (samples + 1, False)):
        bits = source_bits(TAP_SRC, bumps((10, length)), TAP_X, TAP_THS, (INT_DUR2, shock))
        assert numbers(bits, SINGLE_TAP)[:1] == ([10 + length] if taps else [])


@pytest.mark.parametrize(("quiet", "samples"), [(0, 2), (1, 4), (2, 8), (3, 12)])
def test_tap_flag_lasts_for_quiet_window(quiet: int, samples: int) -> None:
    bits = source_bits(TAP_SRC, bumps((10, 1)), TAP_X, TAP_THS, (INT_DUR2, quiet << 2))

    assert numbers(bits, TAP_IA) == list(range(11, 11 + samples))


@pytest.mark.parametrize(("dur", "samples"), [(0, 16), (1, 32), (2, 64)])
def test_second_tap_counts_after_quiet_within_dur(dur: int, samples: int) -> None:
    writes = TAP_X, TAP_THS, (INT_DUR2, dur << 4 | 1 << 2), (WAKE_UP_THS, 0x80)
    quiet_over = 10 + 1 + 4
    for second, doubles in (
        (quiet_over - 1, False),
        (quiet_over, True),
        (quiet_over + samples - 1, True),
        (quiet_over + samples, False),
    ):
        bits = source_bits(TAP_SRC, bumps((10, 1), (second, 1), length=100), *writes)
        assert numbers(bits, SINGLE_TAP)[0] == 11, "the single tap is reported as well"
        assert numbers(bits, DOUBLE_TAP)[:1] == ([second + 1] if doubles else [])


def test_clear_single_double_tap_bit_disables_double_taps() -> None:
    bits = source_bits(TAP_SRC, bumps((10, 1), (20, 1)), TAP_X, TAP_THS)

    assert numbers(bits, SINGLE_TAP) == [11, 12, 21, 22]
    assert not numbers(bits, DOUBLE_TAP)


@pytest.mark.parametrize(("axis", "enable", "bit"), [(0, 0x08, 0x04), (1, 0x04, 0x02), (2, 0x02, 0x01)])
@pytest.mark.parametrize("sign", [1, -1])
def test_axis_and_sign_of_tap_are_reported(axis: int, enable: int, bit: int, sign: int) -> None:
    samples = [STILL] * 5 + [along(axis, sign * 800.0)] * 5

    for enabled in range(0x02, 0x10, 2):
        bits = source_bits(TAP_SRC, samples, (TAP_CFG, enabled), TAP_THS)
        expected = TAP_IA | SINGLE_TAP | bit | (TAP_SIGN if sign < 0 else 0)
        assert bits[6] == (expected if enabled & enable else 0)


# -- pulsed and latched (AN5040 section 5) ------------------------------------------------------------------


def test_latched_event_stays_until_source_read() -> None:
    bench = Bench(
        [FLAT] * 5 + [STILL] * 10 + [FLAT], (FREE_FALL, 3), (MD1_CFG, 0x10), (TAP_CFG, ENABLE | LIR)
    )

    assert bench.at(100).byte(WAKE_UP_SRC) & FF_IA
    assert bench.byte(WAKE_UP_SRC) & FF_IA == 0
    assert bench.look() == [("INT1", sample_ps(5), 1), ("INT1", sample_ps(100), 0)]


def test_continuing_latched_event_returns_with_next_sample() -> None:
    bench = Bench([STILL], (FREE_FALL, 3), (MD1_CFG, 0x10), (TAP_CFG, ENABLE | LIR))

    assert bench.at(10).byte(WAKE_UP_SRC) & FF_IA
    assert bench.byte(WAKE_UP_SRC) & FF_IA == 0
    assert bench.at(11).byte(WAKE_UP_SRC) & FF_IA


@pytest.mark.parametrize("route", [(MD1_CFG, 0x20), (MD1_CFG, 0x00)], ids=["another event", "nothing"])
def test_unrouted_event_does_not_latch(route: tuple[int, int]) -> None:
    writes = (FREE_FALL, 3), route, (WAKE_UP_THS, 63), (TAP_CFG, ENABLE | LIR)
    bench = Bench([FLAT] * 5 + [STILL] * 10 + [FLAT], *writes)

    assert bench.at(14).byte(WAKE_UP_SRC) & FF_IA
    assert bench.byte(WAKE_UP_SRC) & FF_IA, "nor does reading clear it while it lasts"
    assert bench.at(15).byte(WAKE_UP_SRC) & FF_IA == 0


@pytest.mark.parametrize("pin", [MD1_CFG, MD2_CFG])
@pytest.mark.parametrize(
    ("double", "route", "kept"),
    [
        (0x00, 0x40, SINGLE_TAP),
        (0x80, 0x40, 0),
        (0x80, 0x08, DOUBLE_TAP),
        (0x00, 0x08, 0),
        (0x80, 0x48, DOUBLE_TAP),
    ],
)
def test_single_double_tap_selects_latched_tap(pin: int, double: int, route: int, kept: int) -> None:
    """AN5040 5.5.3."""
    writes = (TAP_CFG, ENABLE | LIR | 0x08), TAP_THS, (WAKE_UP_THS, double), (pin, route)
    bench = Bench(bumps((10, 1), (20, 1), length=200), *writes).at(150)

    assert bench.byte(TAP_SRC) & (SINGLE_TAP | DOUBLE_TAP) == kept
    assert bench.byte(TAP_SRC) == 0


def test_reading_one_source_does_not_clear_others() -> None:
    samples = [FLAT] * 3 + [STILL] * 5 + [along(0, 1000.0)]
    writes = (FREE_FALL, 3), (TAP_THS_6D, 0x40), (MD1_CFG, 0x14), (TAP_CFG, ENABLE | LIR)
    bench = Bench(samples, *writes).at(50)

    assert bench.byte(D6D_SRC) == D6D_IA | 0x02
    assert bench.byte(D6D_SRC) == 0x02
    assert bench.byte(WAKE_UP_SRC) & FF_IA


# -- enable, power-down, reset ------------------------------------------------------------------------------


def test_no_event_is_detected_without_interrupts_enable() -> None:
    bench = Bench([STILL, FLAT] * 20, (FREE_FALL, 7), (TAP_CFG, 0x0E), (MD1_CFG, 0xFC)).at(39)

    assert [bench.byte(register) for register in (WAKE_UP_SRC, TAP_SRC, D6D_SRC)] == [0, 0, 0]
    assert bench.look() == []


@pytest.mark.parametrize("off", [(TAP_CFG, 0x00), (CTRL1_XL, 0x00), (CTRL3_C, 0x05)])
def test_event_ends_when_its_function_is_disabled(off: tuple[int, int]) -> None:
    bench = Bench([STILL], (FREE_FALL, 3), (MD1_CFG, 0x10), (TAP_CFG, ENABLE)).at(10)
    bench.write(*off)

    assert bench.byte(WAKE_UP_SRC) == 0
    assert bench.look() == [("INT1", sample_ps(0), 1), ("INT1", sample_ps(10), 0)]
    bench.wait(PS_PER_S)
    assert len(bench.look()) == 2


def test_power_down_does_not_end_latched_event() -> None:
    bench = Bench([STILL], (FREE_FALL, 3), (MD1_CFG, 0x10), (TAP_CFG, ENABLE | LIR)).at(10)
    bench.write(CTRL1_XL, 0x00)

    assert bench.byte(WAKE_UP_SRC) == FF_IA
    assert bench.byte(WAKE_UP_SRC) == 0


def test_tap_threshold_below_wake_up_threshold_is_noted(words: Words) -> None:
    """AN5040 5.5: the tap threshold must be above the wake-up threshold."""
    bench = Bench([FLAT], (TAP_THS_6D, 4), (WAKE_UP_THS, 7), (TAP_CFG, ENABLE | 0x0E))
    assert bench.notes == []

    bench.write(WAKE_UP_THS, 8)
    assert kinds(bench.notes) == ["forbidden"]
    words("sensors", texts(bench.notes))
