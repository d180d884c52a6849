"""The words of the LSM6DSL's FIFO and its plain modes (AN5040 Rev 3, 8; datasheet 9.4 to 9.8, 9.53 on)."""

from __future__ import annotations

import numpy as np
import pytest

from tests.support.fifo_fakes import (
    BOTH,
    BYPASS,
    CONTINUOUS,
    CTRL1_XL,
    CTRL2_G,
    CTRL3_C,
    EMPTY,
    FIFO,
    FIFO_CTRL3,
    FIFO_CTRL4,
    FIFO_CTRL5,
    FIFO_DATA_OUT,
    FIFO_STATUS1,
    FIFO_TEMP_EN,
    FULL,
    HZ_104,
    HZ_208,
    ONLY_HIGH_DATA,
    OVERRUN,
    PERIOD_PS,
    STOP_ON_FTH,
    TEMPERATURE,
    TIMER_PEDO_FIFO_EN,
    WATERMARK,
    XL,
    XL_ONLY,
    G,
    bench_of,
    fifo_of,
    sample_ps,
    sample_word,
    samples,
    status,
)
from tests.support.notes import kinds, texts
from tests.support.sensor_fakes import PS_PER_MS, PS_PER_S, Chip
from tests.support.words import Words

# -- words ----------------------------------------------------------------------------------------------


def test_fifo_words_are_samples_low_byte_first() -> None:
    chip = fifo_of(CONTINUOUS)
    taken = b""
    for _ in range(5):
        samples(chip, 1)
        taken += chip.read(0x28, 6)

    assert status(chip) == (15, 0x00, 0)
    assert chip.read(FIFO_DATA_OUT, 30) == taken
    assert status(chip) == (0, EMPTY, 0)


@pytest.mark.parametrize(
    ("xl", "g", "dec", "expected"),
    [  # AN5040 section 8's examples of patterns
        (HZ_104, HZ_104, (1, 1, 0, 0), [G, XL]),
        (HZ_104, HZ_208, (1, 2, 0, 0), [G, XL, G]),
        (HZ_208, HZ_104, (2, 1, 4, 0), [G, XL, 0, XL, G, XL, XL]),
    ],
)
def test_fifo_pattern_follows_rates_and_decimation(
    xl: int, g: int, dec: tuple[int, ...], expected: list[int]
) -> None:
    bench = bench_of(CONTINUOUS, xl=xl, g=g, dec=dec)
    words_a_period = 3 * len(expected)
    while bench.fill() < 2 * words_a_period:
        bench.wait(PS_PER_MS)
    bench.words(words_a_period)  # in the first one the slower sensor may not have measured yet
    before = bench.t_ps
    places, words = [], []
    for _ in range(words_a_period):
        low, high = bench.read(0x3C, 2)
        places.append(low | high << 8)
        words += bench.words(1)

    assert places == list(range(words_a_period))
    assert bench.read(0x3C, 2) == b"\0\0"
    possible: dict[int, set[tuple[int, ...]]] = {XL: set(), G: set()}
    for mark, rate in ((XL, (104, 208)[xl - HZ_104]), (G, (104, 208)[g - HZ_104])):
        for sample in range(1, before * rate // PS_PER_S + 1):
            possible[mark].add(tuple(sample_word(mark, sample / rate, axis) for axis in range(3)))
    for place, mark in enumerate(expected):
        found = tuple(words[3 * place : 3 * place + 3])
        assert found in possible[mark] if mark else found == (0, 0, 0)


def test_slower_fifo_stores_every_fourth_sample() -> None:
    """The sensor has 104 Hz and the FIFO 26 Hz."""
    chip = fifo_of(CONTINUOUS, odr=2)
    taken = b""
    for sample in range(12):
        samples(chip, 1)
        if sample % 4 == 0:
            taken += chip.read(0x28, 6)

    assert chip.read(FIFO_DATA_OUT, 18) == taken
    assert status(chip)[1] == EMPTY


def test_faster_fifo_stores_at_sensor_rate() -> None:
    """AN5040 figure 32."""
    chip = fifo_of(CONTINUOUS, odr=10)
    samples(chip, 10)

    assert status(chip)[0] == 30


def test_slower_fifo_starts_with_next_sample_when_enabled() -> None:
    chip = fifo_of(CONTINUOUS, odr=2)
    samples(chip, 3)
    assert status(chip)[0] == 3
    chip.write(FIFO_CTRL5, 0x10)
    chip.write(FIFO_CTRL5, 0x10 | CONTINUOUS)
    samples(chip, 1)

    assert chip.read(FIFO_DATA_OUT, 6) == chip.read(0x28, 6)


def test_gyroscope_comes_first_at_equal_rates() -> None:
    """AN5040 section 3: the accelerometer is synchronised to the gyroscope."""
    bench = bench_of(BYPASS, dec=(1, 1, 0, 0))
    bench.wait(2 * PS_PER_MS)
    bench.write(CTRL2_G, HZ_104 << 4)
    bench.write(FIFO_CTRL5, HZ_104 << 3 | CONTINUOUS)
    bench.t_ps = sample_ps(2 * PS_PER_MS, 104, 1) - 1
    assert bench.fill() == 0
    bench.wait(1)

    assert bench.fill() == 6


def test_high_bytes_alone_share_one_set() -> None:
    """The order is AXh GXh AYh GYh AZh GZh."""
    bench = bench_of(CONTINUOUS, g=HZ_104, dec=(1, 0, 0, 0))
    bench.write(FIFO_CTRL5, 0)
    bench.write(FIFO_CTRL4, ONLY_HIGH_DATA)
    bench.write(FIFO_CTRL5, HZ_104 << 3 | CONTINUOUS)
    bench.wait(PERIOD_PS)

    high = {mark: [sample_word(mark, 1 / 104, axis) >> 8 for axis in range(3)] for mark in (XL, G)}
    pairs = zip(high[XL], high[G], strict=True)
    assert bench.read(FIFO_DATA_OUT, 6) == bytes(byte for pair in pairs for byte in pair)


def test_timestamp_and_steps_are_fourth_data_set() -> None:
    """AN5040 Table 73: TS[15:8], TS[23:16], unused, TS[7:0], steps[7:0], steps[15:8]."""
    bench = bench_of(BYPASS, dec=(0, 0, 0, 1), ctrl2=TIMER_PEDO_FIFO_EN)
    bench.write(0x5C, 0x10)
    bench.write(0x19, 0x20)
    bench.registers.mem[0x4B:0x4D] = b"\x34\x12"
    bench.wait(30 * PS_PER_S + PS_PER_MS)
    bench.write(FIFO_CTRL5, HZ_104 << 3 | CONTINUOUS)
    bench.wait(PERIOD_PS)

    ticks = int(3121 / 104 / 25e-6)
    expected = bytes((ticks >> 8 & 0xFF, ticks >> 16, 0, ticks & 0xFF, 0x34, 0x12))
    assert bench.read(FIFO_DATA_OUT, 6) == expected


def test_temperature_is_fourth_data_set() -> None:
    bench = bench_of(CONTINUOUS, dec=(0, 0, 0, 1), ctrl2=FIFO_TEMP_EN)
    bench.wait(3 * PERIOD_PS)

    assert bench.words(9)[6:] == [0, sample_word(TEMPERATURE, 1 / 52, 0), 0]


def test_hub_outputs_are_third_and_fourth_data_set() -> None:
    bench = bench_of(CONTINUOUS, dec=(0, 0, 1, 1))
    bench.registers.mem[0x2E:0x3A] = bytes(range(1, 13))
    bench.wait(PERIOD_PS)

    assert bench.read(FIFO_DATA_OUT, 12) == bytes(range(1, 13))


def test_unmeasured_sensor_stores_its_register_contents() -> None:
    bench = bench_of(CONTINUOUS, xl=1, g=HZ_104, dec=(1, 1, 0, 0))
    bench.wait(8 * PERIOD_PS)

    assert bench.words(6)[3:] == [0, 0, 0]


def test_stored_sample_survives_setting_change() -> None:
    """The gyroscope leads at 104 Hz. A 12.5 Hz sample of the accelerometer is stored again after a change of FS_XL."""
    chip = Chip("LSM6DSL")
    chip.configure(((CTRL3_C, 0x44), (CTRL1_XL, 0x10), (CTRL2_G, 0x40), (FIFO_CTRL3, XL_ONLY)))
    chip.t_ps = 402 * PS_PER_MS  # just after a sample of the accelerometer
    measured = chip.read(0x28, 6)
    chip.write(FIFO_CTRL5, HZ_104 << 3 | CONTINUOUS)
    chip.write(CTRL1_XL, 0x14)
    samples(chip, 3)

    assert chip.read(FIFO_DATA_OUT, 6) == measured
    chip.wait(80 * PS_PER_MS)
    latest = [chip.read(FIFO_DATA_OUT, 6) for _ in range(status(chip)[0] // 3)][-1]
    assert latest == chip.read(0x28, 6) != measured


# -- reading --------------------------------------------------------------------------------------------


def test_high_byte_read_removes_fifo_word() -> None:
    chip = fifo_of(CONTINUOUS)
    samples(chip, 50)
    first = chip.read(FIFO_DATA_OUT, 1)

    assert chip.read(FIFO_DATA_OUT, 1) == first
    assert status(chip)[0] == 150
    chip.read(FIFO_DATA_OUT + 1, 1)
    assert status(chip)[0] == 149


def test_half_read_word_survives_overwriting() -> None:
    chip = fifo_of(CONTINUOUS, ctrl4=STOP_ON_FTH, watermark=3)
    samples(chip, 1)
    word = chip.read(0x28, 2)

    low = chip.read(FIFO_DATA_OUT, 1)
    samples(chip, 1)
    high = chip.read(FIFO_DATA_OUT + 1, 1)

    assert low + high == word
    assert status(chip)[0] == 3
    assert chip.read(FIFO_DATA_OUT, 6) == chip.read(0x28, 6)


def test_empty_fifo_read_repeats_latest_word_with_note(words: Words) -> None:
    chip = fifo_of(CONTINUOUS)
    samples(chip, 1)
    data = chip.read(FIFO_DATA_OUT, 6)
    assert chip.notes == []

    assert chip.read(FIFO_DATA_OUT, 2) == data[4:]
    assert set(kinds(chip.notes)) == {"forbidden"}
    words("sensors", texts(chip.notes))


def test_burst_over_status_and_data_reads_status_first() -> None:
    chip = fifo_of(CONTINUOUS)
    samples(chip, 2)
    data = chip.read(FIFO_STATUS1, 4 + 12)

    assert data[:4] == bytes((6, 0, 0, 0))
    assert data[10:] == chip.read(0x28, 6)


# -- modes ----------------------------------------------------------------------------------------------


def test_bypass_empties_fifo_and_reads_as_empty() -> None:
    chip = fifo_of(CONTINUOUS)
    samples(chip, 4)
    chip.write(FIFO_CTRL5, HZ_104 << 3)
    samples(chip, 4)

    assert chip.read(FIFO_STATUS1, 4) == bytes((0, EMPTY, 0, 0))
    chip.write(FIFO_CTRL5, HZ_104 << 3 | CONTINUOUS)
    assert status(chip) == (0, EMPTY, 0)


def test_software_reset_empties_fifo() -> None:
    chip = fifo_of(CONTINUOUS, watermark=3)
    samples(chip, 4)
    chip.write(CTRL3_C, 0x01)
    samples(chip, 4)

    assert chip.read(FIFO_STATUS1, 4) == bytes((0, EMPTY, 0, 0))


@pytest.mark.parametrize(("sets", "words"), [(XL_ONLY, 2046), (BOTH, 2046)])
def test_fifo_mode_stops_before_overfull(sets: int, words: int) -> None:
    """AN5040 figures 28 and 29: 2046 words with one set."""
    chip = fifo_of(FIFO, sets)
    rows = words // (3 if sets == XL_ONLY else 6)
    samples(chip, rows - 1)
    assert status(chip)[1] == 0
    samples(chip, 1)
    assert status(chip) == (words, FULL, 0)
    chip.read(FIFO_DATA_OUT, 2)
    chip.wait(100 * PS_PER_S)

    assert status(chip)[:2] == (words - 1, FULL), "reading does not start it again"


def test_fifo_mode_limited_to_watermark_stops_before_watermark() -> None:
    """AN5040: with FTH = 21 and one sensor the FIFO stops at 18, and WaterM is never set."""
    chip = fifo_of(FIFO, ctrl4=STOP_ON_FTH, watermark=21)
    samples(chip, 5)
    assert status(chip)[:2] == (15, 0)
    samples(chip, 1)
    assert status(chip)[:2] == (18, FULL)
    chip.wait(PS_PER_S)
    assert status(chip)[:2] == (18, FULL)


@pytest.mark.parametrize("looks", [0, 3])
def test_mode_change_restarts_stopped_fifo(looks: int) -> None:
    """The change is noted, because it should go through bypass. Earlier reads have no effect."""
    chip = fifo_of(FIFO, ctrl4=STOP_ON_FTH, watermark=60, odr=2)
    for look in range(looks):
        chip.t_ps = look * 170 * PS_PER_MS
        status(chip)
    chip.t_ps = 5 * PS_PER_S + PS_PER_MS
    chip.write(FIFO_CTRL5, 0x10 | CONTINUOUS)
    samples(chip, 1)

    assert status(chip)[:2] == (60, FULL | WATERMARK)
    assert chip.read(FIFO_DATA_OUT, 120)[-6:] == chip.read(0x28, 6)


def test_continuous_mode_limited_to_watermark_reaches_watermark() -> None:
    """AN5040: FULL_SMART at 18, WaterM at 21. Then the oldest words are dropped."""
    chip = fifo_of(CONTINUOUS, ctrl4=STOP_ON_FTH, watermark=21)
    samples(chip, 6)
    assert status(chip)[:2] == (18, FULL)
    samples(chip, 1)
    assert status(chip)[:2] == (21, FULL | WATERMARK)
    samples(chip, 1)
    assert status(chip)[:2] == (21, FULL | WATERMARK | OVERRUN)
    chip.read(FIFO_DATA_OUT, 2)
    assert status(chip)[:2] == (20, FULL)


def test_continuous_mode_overwrites_oldest_words() -> None:
    """There are 2048 words, so the 683rd set overwrites one word. The 11-bit count then reads 0 (AN5040 Table 64)."""
    chip = fifo_of(CONTINUOUS, watermark=2)
    samples(chip, 682)
    assert status(chip) == (2046, WATERMARK | FULL, 0)
    samples(chip, 1)

    assert status(chip) == (0, WATERMARK | FULL | OVERRUN, 1)
    data = chip.read(FIFO_DATA_OUT, 2 * 2048)
    assert data[-6:] == chip.read(0x28, 6)
    assert status(chip)[1] == EMPTY


@pytest.mark.parametrize("looks", [0, 7])
def test_unread_fifo_ends_with_latest_words(looks: int) -> None:
    """Reads in the meantime have no effect. The FIFO runs for 100 s at 104 Hz with a pattern of 5 sets."""
    chip = fifo_of(CONTINUOUS, 0x01 | 4 << 3)
    for look in range(looks):
        chip.t_ps = (look * 13 + 1) * PS_PER_S
        status(chip)
    chip.t_ps = 100 * PS_PER_S

    sets = 10_399 + 2600
    assert status(chip) == (0, FULL | OVERRUN, (3 * sets - 2048) % 15)
    data = chip.read(FIFO_DATA_OUT, 2 * 2048)
    assert data[-6:] == chip.read(0x28, 6)


@pytest.mark.parametrize("hours", [1, 24])
def test_samples_overwritten_before_read_are_not_computed(hours: int) -> None:
    asked: list[int] = []
    chip = fifo_of(CONTINUOUS)
    acceleration = chip.world.signals["acceleration_g"]

    def counted(t_s: np.ndarray) -> np.ndarray:
        asked.append(len(t_s))
        return acceleration(t_s)

    chip.world.signals["acceleration_g"] = counted
    chip.t_ps = hours * 3600 * PS_PER_S

    assert status(chip)[:2] == (0, FULL | OVERRUN)
    assert sum(asked) < 10_000


def test_overrun_words_are_kept_without_new_samples() -> None:
    """With DEC_FIFO_XL = 0, no sensor is in the pattern any more."""
    chip = fifo_of(CONTINUOUS)
    samples(chip, 700)
    chip.write(FIFO_CTRL3, 0)
    last = chip.read(0x28, 6)
    samples(chip, 20)

    assert status(chip)[:2] == (0, FULL | OVERRUN)
    assert chip.read(FIFO_DATA_OUT, 2 * 2048)[-6:] == last


def test_watermark_of_0_is_never_reached() -> None:
    chip = fifo_of(CONTINUOUS)
    samples(chip, 700)

    assert not status(chip)[1] & WATERMARK


def test_nothing_is_stored_without_rate() -> None:
    for odr in (0, 11, 15):
        chip = fifo_of(CONTINUOUS, odr=odr)
        samples(chip, 20)
        assert status(chip) == (0, EMPTY, 0)
