"""Start of the LSM6DSL's gyroscope, and sample times of its sensors: alone, together, and with a rate error."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction

import pytest

from fcu_emulator.sensors.lsm6dsl import LSM6DSLErrors
from tests.support.filter_fakes import HZ, at_rate
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
    ramp,
)

CTRL1_XL, CTRL2_G, CTRL4_C, CTRL6_C, CTRL7_G = 0x10, 0x11, 0x13, 0x15, 0x16


def first_sample_ms(chip: Chip) -> float:
    """Return the time in ms until the gyroscope's data-ready flag is set, in steps of 10 us."""
    began_ps = chip.t_ps
    while not chip.is_ready(GYROSCOPE):
        chip.wait(PS_PER_MS // 100)
    return (chip.t_ps - began_ps) / PS_PER_MS


# -- the drive ------------------------------------------------------------------------------------------


@pytest.mark.parametrize("code", [4, 6])
@pytest.mark.parametrize("ctrl7", [0x00, 0x80])
def test_gyroscope_drive_takes_35_ms_after_power_down(code: int, ctrl7: int) -> None:
    """Datasheet Table 4, Ton; in every mode."""
    chip = Chip("LSM6DSL")
    chip.configure(((CTRL7_G, ctrl7), (CTRL2_G, code << 4)))
    assert first_sample_ms(chip) == pytest.approx(35 + 1000 / HZ[code], abs=0.011)


@pytest.mark.parametrize("ms", [0.0, 12.5, 70.0])
def test_gyroscope_turn_on_time_can_be_set(ms: float) -> None:
    """AN5040's Tables 14 to 16 let drivers wait for 70 ms."""
    chip = Chip("LSM6DSL", LSM6DSLErrors(gyro_turn_on_ms=ms))
    chip.write(CTRL2_G, 0x60)
    assert first_sample_ms(chip) == pytest.approx(ms + 1000 / 416, abs=0.011)


def test_sampling_begins_immediately_after_sleep() -> None:
    chip = Chip("LSM6DSL")
    chip.configure(((CTRL4_C, 0x40), (CTRL2_G, 0x60)))
    chip.wait(PS_PER_S)
    chip.write(CTRL4_C, 0x00)
    assert first_sample_ms(chip) == pytest.approx(1000 / 416, abs=0.011)


def test_early_end_of_sleep_waits_for_drive() -> None:
    chip = Chip("LSM6DSL")
    chip.configure(((CTRL4_C, 0x40), (CTRL2_G, 0x60)))
    chip.wait(20 * PS_PER_MS)
    chip.write(CTRL4_C, 0x00)
    assert first_sample_ms(chip) == pytest.approx(15 + 1000 / 416, abs=0.011)


def test_rate_change_does_not_restart_drive() -> None:
    chip = Chip("LSM6DSL")
    chip.write(CTRL2_G, 0x60)
    chip.wait(PS_PER_S)
    chip.counts(GYROSCOPE)
    chip.write(CTRL2_G, 0x40)
    assert first_sample_ms(chip) == pytest.approx(1000 / 104, abs=0.011)


# -- the first samples ----------------------------------------------------------------------------------

TO_DISCARD = {1: 2, 2: 3, 3: 3, 4: 3, 5: 3, 6: 3, 7: 3}  # AN5040 Table 16, LPF1 off


def first_rates(chip: Chip, channel: Channel, began_ps: int, count: int) -> list[float]:
    """Return the first samples on X in dps."""
    found = []
    for number in range(count):
        chip.t_ps = began_ps + channel.sample_ps(number)
        found.append(chip.counts(channel)[0] * 0.00875)
    return found


@pytest.mark.parametrize(("code", "discarded"), TO_DISCARD.items())
def test_gyroscope_start_ends_after_documented_samples(code: int, discarded: int) -> None:
    """The samples that DRDY_MASK hides are too small. All later ones are exact."""
    channel, chip = at_rate(GYROSCOPE, code), Chip("LSM6DSL")
    chip.set("angular_rate_dps", 200.0, 0.0, 0.0)
    chip.write(CTRL2_G, code << 4)
    found = first_rates(chip, channel, 0, 30)

    assert 0 < found[0] < 0.6 * 200
    assert found[discarded:] == pytest.approx([200.0] * (30 - discarded), abs=0.005)


def test_gyroscope_settles_after_sleep() -> None:
    channel, chip = at_rate(GYROSCOPE, 6), Chip("LSM6DSL")
    chip.set("angular_rate_dps", 200.0, 0.0, 0.0)
    chip.configure(((CTRL4_C, 0x40), (CTRL2_G, 0x60)))
    chip.wait(PS_PER_S)
    chip.write(CTRL4_C, 0x00)
    found = first_rates(chip, replace(channel, turn_on_ps=0), PS_PER_S, 4)

    assert 0 < found[0] < 0.6 * 200
    assert found[3] == pytest.approx(200, abs=0.005)


def test_rate_change_needs_no_settling() -> None:
    chip = Chip("LSM6DSL")
    chip.set("angular_rate_dps", 200.0, 0.0, 0.0)
    chip.write(CTRL2_G, 0x60)
    chip.wait(PS_PER_S)
    chip.write(CTRL2_G, 0x50)
    slower = replace(at_rate(GYROSCOPE, 5), turn_on_ps=0)
    assert first_rates(chip, slower, PS_PER_S, 1) == pytest.approx([200], abs=0.005)


# -- both sensors on (AN5040 section 3) -----------------------------------------------------------------


@pytest.mark.parametrize(
    ("first", "second"),
    [
        ((CTRL1_XL, 0x40), (CTRL2_G, 0x40)),
        ((CTRL1_XL, 0x40), (CTRL2_G, 0x50)),
        ((CTRL1_XL, 0x50), (CTRL2_G, 0x30)),
        ((CTRL2_G, 0x40), (CTRL1_XL, 0x40)),
        ((CTRL2_G, 0x30), (CTRL1_XL, 0x50)),
        ((CTRL2_G, 0x50), (CTRL1_XL, 0x30)),
    ],
    ids=str,
)
@pytest.mark.parametrize("between_us", [0, 1234, 54321])
def test_samples_of_both_sensors_coincide(
    first: tuple[int, int], second: tuple[int, int], between_us: int
) -> None:
    chip = Chip("LSM6DSL", LSM6DSLErrors(odr_percent=1.0) if between_us == 1234 else None)
    chip.configure((first,))
    chip.wait(between_us * 10**6)
    chip.configure((second,))
    chip.wait(PS_PER_S)
    slow, fast = ACCELEROMETER, GYROSCOPE
    if chip.byte(CTRL1_XL) > chip.byte(CTRL2_G):
        slow, fast = fast, slow
    chip.read(0x22, 12)
    seen = 0
    for _ in range(5000):
        chip.wait(10 * PS_PER_US)
        ready = chip.is_ready(slow), chip.is_ready(fast)
        seen += ready[0]
        assert ready != (True, False)
        chip.read(0x22, 12)
    assert seen >= 2


def test_second_sensor_waits_at_most_two_periods() -> None:
    chip = Chip("LSM6DSL")
    chip.write(CTRL1_XL, 0x40)
    chip.wait(PS_PER_MS)
    chip.write(CTRL2_G, 0x40)
    assert 35 + 1000 / 104 <= first_sample_ms(chip) <= 35 + 2000 / 104 + 0.01


def test_rates_without_common_multiple_are_not_synchronised() -> None:
    """416 and 833 Hz of datasheet Table 3: the samples are not shifted, and both keep their documented rates."""
    chip = Chip("LSM6DSL")
    chip.configure(((CTRL1_XL, 0x70), (CTRL2_G, 0x60)))
    assert first_sample_ms(chip) == pytest.approx(35 + 1000 / 416, abs=0.011)


# -- tolerance of the rates -----------------------------------------------------------------------------

FASTER: tuple[tuple[Channel, Writes], ...] = (
    (ACCELEROMETER, ((CTRL1_XL, 0x40),)),
    (GYROSCOPE, ((CTRL2_G, 0x40),)),
    (LSM6DSL_TEMPERATURE, ((CTRL1_XL, 0x40),)),
    (replace(LSM6DSL_TEMPERATURE, rate_hz=Fraction(26)), ((CTRL6_C, 0x10), (CTRL1_XL, 0x20))),
)


@pytest.mark.parametrize(("channel", "writes"), FASTER, ids=str)
@pytest.mark.parametrize("percent", [-10.0, 2.5, 10.0])
def test_sensor_rate_may_be_fast_or_slow(channel: Channel, writes: Writes, percent: float) -> None:
    """The error is the same for all rates. The last of a thousand samples shows it."""
    chip = Chip("LSM6DSL", LSM6DSLErrors(odr_percent=percent))
    real = replace(channel, rate_hz=channel.rate_hz * Fraction(1000 + int(10 * percent), 1000))
    chip.configure(writes)
    chip.t_ps = real.sample_ps(999)
    chip.counts(channel)
    chip.t_ps = real.sample_ps(1000) - 1
    assert not chip.is_ready(channel)
    chip.wait(1)
    assert chip.is_ready(channel)


def test_fast_sensor_samples_world_at_earlier_times() -> None:
    chip = Chip("LSM6DSL", LSM6DSLErrors(odr_percent=10.0))
    chip.world.signals["acceleration_g"] = ramp((0.0, 0.0, 0.0), (0.1, 0.0, 0.0))
    chip.write(CTRL1_XL, 0x40)
    channel = replace(ACCELEROMETER, rate_hz=Fraction("114.4"))
    for number in range(100, 110):
        chip.t_ps = channel.sample_ps(number)
        measured = chip.counts(ACCELEROMETER)[0] * 0.061e-3
        assert measured == pytest.approx(0.1 * (number + 1) / 114.4, abs=0.031e-3)
