"""The LSM6DSL beyond the contract (datasheet DocID028475 Rev 7; application note AN5040 Rev 3)."""

from __future__ import annotations

import pytest

from tests.support.notes import kinds, texts
from tests.support.sensor_fakes import (
    ACCELEROMETER,
    GYROSCOPE,
    LSM6DSL_TEMPERATURE,
    PS_PER_MS,
    PS_PER_S,
    PS_PER_US,
    Channel,
    Chip,
    Writes,
    decode,
)
from tests.support.words import Words

CTRL1_XL, CTRL2_G, CTRL3_C, CTRL5_C, CTRL6_C, CTRL7_G = 0x10, 0x11, 0x12, 0x14, 0x15, 0x16
FUNC_CFG_ACCESS, STATUS_REG, X_OFS_USR = 0x01, 0x1E, 0x73


def measured(channel: Channel, writes: Writes, *values: float) -> tuple[int, ...]:
    """Return the counts of a world at rest after ``writes``."""
    chip = Chip("LSM6DSL")
    chip.set(channel.name, *values)
    chip.configure(writes)
    chip.wait(PS_PER_S)
    return chip.counts(channel)


# -- the application note's test vectors ----------------------------------------------------------------


@pytest.mark.parametrize(
    ("channel", "value", "word", "tolerance"),
    [
        # AN5040 Table 17, 2 g. 350 mg / 0.061 mg is 5737.7: the note cuts off; the part's own rounding is not
        # documented and the model rounds to nearest, hence one LSB. 1 g / 0.061 mg is 16393.4: no doubt.
        (ACCELEROMETER, 0.350, 0x1669, 1),
        (ACCELEROMETER, 1.0, 0x4009, 0),
        (ACCELEROMETER, -0.350, 0xE997, 1),
        (ACCELEROMETER, -1.0, 0xBFF7, 0),
        # AN5040 Table 18, 250 dps. 100 dps / 8.75 mdps is 11428.6, cut off likewise; 200 dps gives 22857.1.
        (GYROSCOPE, 100.0, 0x2CA4, 1),
        (GYROSCOPE, 200.0, 0x5949, 0),
        (GYROSCOPE, -100.0, 0xD35C, 1),
        (GYROSCOPE, -200.0, 0xA6B7, 0),
        # AN5040 section 9: whole numbers of LSB.
        (LSM6DSL_TEMPERATURE, 0.0, 0xE700, 0),
        (LSM6DSL_TEMPERATURE, 25.0, 0x0000, 0),
        (LSM6DSL_TEMPERATURE, 50.0, 0x1900, 0),
    ],
    ids=str,
)
def test_output_equals_example_of_application_note(
    channel: Channel, value: float, word: int, tolerance: int
) -> None:
    (expected,) = decode(word.to_bytes(2, "little"))

    for count in measured(channel, channel.scales[0][0], *channel.value(value)):
        assert abs(count - expected) <= tolerance


def test_big_endian_words_have_high_byte_first() -> None:
    """AN5040 4.5.1. A change during a measurement also affects the present sample."""
    chip = Chip("LSM6DSL")
    chip.configure(ACCELEROMETER.scales[0][0])
    chip.wait(PS_PER_S)
    chip.write(CTRL1_XL, 0x00)

    assert chip.read(0x2C, 2) == b"\x09\x40"
    chip.write(CTRL3_C, 0x06)
    assert chip.read(0x2C, 2) == b"\x40\x09"
    assert chip.read(0x28, 6) == bytes(4) + b"\x40\x09"


# -- user offsets and self-tests ------------------------------------------------------------------------


@pytest.mark.parametrize(("ctrl6", "weight_g"), [(0x00, 2**-10), (0x08, 2**-6)])
def test_user_offset_is_subtracted_on_z(ctrl6: int, weight_g: float) -> None:
    """AN5040 4.6. USR_OFF_W selects the weight, which does not depend on the full scale."""
    offsets = ((X_OFS_USR, 10), (X_OFS_USR + 1, 0x100 - 20), (X_OFS_USR + 2, 30), (CTRL6_C, ctrl6))
    for writes, lsb_g in ACCELEROMETER.scales:
        counts = measured(ACCELEROMETER, (*offsets, *writes), 0.1, 0.2, 0.3)

        expected_g = (0.1 + 10 * weight_g, 0.2 - 20 * weight_g, 0.3 - 30 * weight_g)
        assert [count * lsb_g for count in counts] == pytest.approx(expected_g, abs=0.51 * lsb_g)


@pytest.mark.parametrize(
    ("channel", "on", "code", "sign", "low", "high"),
    [
        # AN5040 figure 36 and datasheet T3: 52 Hz, 4 g; 90 to 1700 mg
        (ACCELEROMETER, ((CTRL1_XL, 0x38),), 0x01, 1, 0.090, 1.700),
        (ACCELEROMETER, ((CTRL1_XL, 0x38),), 0x02, -1, 0.090, 1.700),
        # AN5040 figure 37 and datasheet T3: 208 Hz; 20 to 80 dps at 250 dps, 150 to 700 at 2000
        (GYROSCOPE, ((CTRL2_G, 0x50),), 0x04, 1, 20.0, 80.0),
        (GYROSCOPE, ((CTRL2_G, 0x50),), 0x0C, -1, 20.0, 80.0),
        (GYROSCOPE, ((CTRL2_G, 0x5C),), 0x04, 1, 150.0, 700.0),
        (GYROSCOPE, ((CTRL2_G, 0x5C),), 0x0C, -1, 150.0, 700.0),
    ],
    ids=str,
)
def test_self_test_shift_is_within_limits(
    channel: Channel, on: Writes, code: int, sign: int, low: float, high: float
) -> None:
    chip = Chip("LSM6DSL")
    chip.configure(on)
    chip.wait(150 * PS_PER_MS)
    before = chip.counts(channel)

    chip.write(CTRL5_C, code)
    chip.wait(100 * PS_PER_MS)
    after = chip.counts(channel)

    lsb = chip.part.sample_range(channel.name)[2]
    assert all(low <= sign * (b - a) * lsb <= high for a, b in zip(before, after, strict=True))
    chip.write(CTRL5_C, 0x00)
    chip.wait(100 * PS_PER_MS)
    assert chip.counts(channel) == before


# -- reset, boot, banks ---------------------------------------------------------------------------------


def test_sw_reset_bit_clears_itself_after_50_us() -> None:
    """AN5040 5.7."""
    chip = Chip("LSM6DSL")
    chip.write(CTRL1_XL, 0xA8)
    chip.write(CTRL3_C, 0x45)

    chip.wait(50 * PS_PER_US - 1)
    assert chip.byte(CTRL3_C) == 0x05
    chip.wait(1)
    assert chip.byte(CTRL3_C) == 0x04
    assert chip.byte(CTRL1_XL) == 0x00


def test_sw_reset_can_be_repeated_without_polling() -> None:
    chip = Chip("LSM6DSL")
    chip.write(CTRL3_C, 0x05)
    chip.wait(PS_PER_MS)
    chip.write(CTRL1_XL, 0xA8)

    chip.write(CTRL3_C, 0x05)

    assert (chip.byte(CTRL1_XL), chip.byte(CTRL3_C)) == (0x00, 0x05)
    chip.wait(50 * PS_PER_US)
    assert chip.byte(CTRL3_C) == 0x04


def test_sw_reset_empties_outputs() -> None:
    chip = Chip("LSM6DSL")
    chip.configure(ACCELEROMETER.scales[0][0])
    chip.wait(PS_PER_S)

    chip.write(CTRL3_C, 0x05)

    assert chip.counts(ACCELEROMETER) == (0, 0, 0)
    assert [chip.byte(address) for address in range(0x28, 0x2E)] == [0] * 6


def test_boot_takes_15_ms_and_keeps_configuration() -> None:
    """AN5040 5.7."""
    chip = Chip("LSM6DSL")
    chip.configure(((CTRL1_XL, 0x40), (CTRL3_C, 0x44)))
    chip.wait(PS_PER_S)

    chip.write(CTRL3_C, 0xC4)
    chip.wait(15 * PS_PER_MS - 1)
    assert chip.byte(CTRL3_C) == 0xC4
    chip.wait(1)
    assert chip.byte(CTRL3_C) == 0x44
    assert chip.byte(CTRL1_XL) == 0x40
    chip.counts(ACCELEROMETER)
    chip.wait(10 * PS_PER_MS)
    assert chip.is_ready(ACCELEROMETER)


def test_open_bank_hides_main_registers() -> None:
    """Datasheet T22 and sections 11, 12: 0x80 bank A, 0xA0 bank B, 0x00 main."""
    chip = Chip("LSM6DSL")

    chip.write(FUNC_CFG_ACCESS, 0x80)
    assert (chip.part.register_name(0x0F), chip.byte(0x0F)) == ("CONFIG_PEDO_THS_MIN", 0x10)
    chip.write(0x0E, 0x55)
    assert chip.part.register_name(0x28) == "MAG_SI_YY"
    chip.write(FUNC_CFG_ACCESS, 0xA0)
    assert (chip.part.register_name(0x54), chip.byte(0x54)) == ("A_WRIST_TILT_THS", 0x20)
    assert chip.byte(0x0E) == 0x00
    chip.write(FUNC_CFG_ACCESS, 0x00)
    assert (chip.byte(0x0F), chip.byte(0x0E)) == (0x6A, 0x00)
    chip.write(FUNC_CFG_ACCESS, 0x80)
    assert (chip.byte(FUNC_CFG_ACCESS), chip.byte(0x0E)) == (0x80, 0x55)


def test_measurement_continues_while_bank_is_open() -> None:
    chip = Chip("LSM6DSL")
    chip.configure(ACCELEROMETER.scales[0][0])
    chip.write(FUNC_CFG_ACCESS, 0x80)
    chip.wait(PS_PER_S)
    chip.write(FUNC_CFG_ACCESS, 0x00)

    assert chip.is_ready(ACCELEROMETER)
    assert chip.counts(ACCELEROMETER) == (0, 0, 0x4009)


@pytest.mark.parametrize(
    ("address", "value"),
    [
        (CTRL1_XL, 0xC0),  # datasheet T52
        (CTRL2_G, 0xB0),  # datasheet T55
        (CTRL5_C, 0x03),  # datasheet T64
        (CTRL5_C, 0x08),  # datasheet T63
        (CTRL3_C, 0x85),  # AN5040 5.7
        (FUNC_CFG_ACCESS, 0x20),  # datasheet T22
    ],
)
def test_forbidden_code_is_noted(address: int, value: int, words: Words) -> None:
    chip = Chip("LSM6DSL")
    chip.write(address, value)
    chip.wait(PS_PER_S)

    assert kinds(chip.notes) == ["forbidden"]
    words("sensors", texts(chip.notes))
    assert chip.byte(STATUS_REG) == 0, "nothing is measured"
    assert chip.byte(0x0F) == 0x6A, "the main bank stays open"


# -- bursts and rates -----------------------------------------------------------------------------------


def test_burst_without_if_inc_stays_at_address() -> None:
    """Datasheet T59: this applies to reads and writes."""
    chip = Chip("LSM6DSL")
    chip.configure((*ACCELEROMETER.scales[0][0], (CTRL3_C, 0x00)))
    chip.wait(PS_PER_S)

    assert chip.read(0x2D, 6) == b"\x40" * 6
    chip.write(CTRL1_XL, 0x10, 0x20, 0x30)
    assert (chip.byte(CTRL1_XL), chip.byte(CTRL2_G)) == (0x30, 0x00)


@pytest.mark.parametrize(
    ("writes", "rate_hz"),
    [
        (((CTRL2_G, 0x10),), 52),
        (((CTRL2_G, 0x80), (CTRL1_XL, 0x10), (CTRL6_C, 0x10)), 52),
        (((CTRL1_XL, 0x10),), 52),  # 12.5 Hz, but in high performance
        (((CTRL1_XL, 0x10), (CTRL6_C, 0x10)), 12.5),
        (((CTRL1_XL, 0x20), (CTRL6_C, 0x10)), 26),
        (((CTRL1_XL, 0x30), (CTRL6_C, 0x10)), 52),
        (((CTRL1_XL, 0xB0), (CTRL6_C, 0x10)), 52),  # 1.6 Hz is not among the note's exceptions
        (((CTRL1_XL, 0xA0),), 52),
        ((), 0),
        (((CTRL2_G, 0x40), (0x13, 0x40)), 0),  # the gyroscope sleeps
    ],
    ids=str,
)
def test_rate_of_temperature_equals_application_note(writes: Writes, rate_hz: float) -> None:
    """AN5040 section 9."""
    chip = Chip("LSM6DSL")
    chip.configure(writes)
    chip.wait(PS_PER_US)  # a sample's time is rounded up to a whole ps
    seen = 0
    for _ in range(800):
        chip.wait(5 * PS_PER_MS)
        seen += chip.is_ready(LSM6DSL_TEMPERATURE)
        chip.counts(LSM6DSL_TEMPERATURE)

    assert seen == 4 * rate_hz


def test_low_power_code_11_selects_1_6_hz() -> None:
    """Datasheet T52."""
    chip = Chip("LSM6DSL")
    chip.configure(((CTRL6_C, 0x10), (CTRL1_XL, 0xB0)))

    chip.wait(625 * PS_PER_MS - 1)
    assert not chip.is_ready(ACCELEROMETER)
    chip.wait(1)
    assert chip.is_ready(ACCELEROMETER)


def test_accelerometer_and_gyroscope_flags_are_separate() -> None:
    """AN5040 4.3."""
    chip = Chip("LSM6DSL")
    chip.configure(((CTRL1_XL, 0x40), (CTRL2_G, 0x40)))
    chip.wait(PS_PER_S)

    assert chip.byte(STATUS_REG) == 0x07
    chip.read(0x22, 6)
    assert chip.byte(STATUS_REG) == 0x05
    chip.read(0x28, 6)
    assert chip.byte(STATUS_REG) == 0x04
    chip.read(0x21)
    assert chip.byte(STATUS_REG) == 0x00
