"""Set and reset pulses, offset cancellation and the low-pass filter of the LIS2MDL (AN5069 section 8)."""

from __future__ import annotations

import numpy as np
import pytest

from fcu_emulator.sensors.lis2mdl import LIS2MDLErrors
from tests.support.notes import kinds, texts
from tests.support.sensor_fakes import MAGNETOMETER, PS_PER_MS, PS_PER_S, Chip, constant, step
from tests.support.words import Words

CFG_REG_A, CFG_REG_B, CFG_REG_C = 0x60, 0x61, 0x62
LPF, OFF_CANC, SET_FREQ, ONE_SHOT = 0x01, 0x02, 0x04, 0x10
PERIOD_PS = 10 * PS_PER_MS
TURN_ON_PS = 9400 * PS_PER_MS // 1000
HOFF = LIS2MDLErrors(set_reset_offset_mgauss=(30.0, -60.0, 90.0))
PLUS, MINUS, NONE = (20, -40, 60), (-20, 40, -60), (0, 0, 0)


def chip_with_hoff(config_b: int) -> Chip:
    """Return a sensor without a field, so that it measures the offset."""
    chip = Chip("LIS2MDL", HOFF)
    chip.set("magnetic_field_mgauss", 0.0, 0.0, 0.0)
    chip.write(CFG_REG_B, config_b)
    return chip


def run(chip: Chip, samples: int) -> list[tuple[int, ...]]:
    """Return this number of samples at 100 Hz, beginning with the present sample."""
    found = []
    for _ in range(samples):
        found.append(chip.counts(MAGNETOMETER))
        chip.wait(PERIOD_PS)
    return found


def started(config_b: int) -> Chip:
    """Start at 100 Hz, and go to the time of the first sample."""
    chip = chip_with_hoff(config_b)
    chip.write(CFG_REG_A, 0x8C)
    chip.wait(TURN_ON_PS + (PERIOD_PS if config_b & OFF_CANC else 0))
    return chip


def single(chip: Chip) -> tuple[int, ...]:
    """Return the result of a single measurement."""
    chip.write(CFG_REG_A, 0x8D)
    chip.wait(3 * PERIOD_PS)
    return chip.counts(MAGNETOMETER)


# -- continuous -----------------------------------------------------------------------------------------


@pytest.mark.parametrize("config_b", [0x00, SET_FREQ, LPF])
def test_without_cancellation_every_sample_contains_hoff(config_b: int) -> None:
    assert set(run(started(config_b), 200)) == {PLUS}


@pytest.mark.parametrize("config_b", [OFF_CANC, OFF_CANC | LPF, OFF_CANC | SET_FREQ])
def test_cancellation_removes_hoff_from_first_sample(config_b: int) -> None:
    """Hn = H + Hoff, Hn-1 = H - Hoff, and the output is their mean."""
    assert set(run(started(config_b), 200)) == {NONE}


def test_cancellation_can_be_enabled_while_measuring() -> None:
    """The lab's set-up writes CFG_REG_A first, then CFG_REG_B."""
    chip = started(0x00)
    before = run(chip, 3)
    chip.write(CFG_REG_B, OFF_CANC)

    assert before == [PLUS] * 3
    chip.counts(MAGNETOMETER)  # was taken before
    chip.wait(PERIOD_PS)
    assert set(run(chip, 10)) == {NONE}


@pytest.mark.parametrize(("measured", "kept"), [(10, PLUS), (11, MINUS)])
def test_disabled_cancellation_keeps_latest_polarity_until_set_pulse(
    measured: int, kept: tuple[int, ...]
) -> None:
    """Alternation begins with a reset pulse. Set pulses come every 63 samples after leaving idle."""
    chip = started(OFF_CANC)
    run(chip, measured - 1)
    chip.counts(MAGNETOMETER)
    chip.write(CFG_REG_B, 0x00)
    chip.wait(PERIOD_PS)

    rest = run(chip, 200)
    assert rest == [kept] * (63 - measured) + [PLUS] * (200 - 63 + measured)


def test_set_freq_bit_sends_set_pulse_after_idle() -> None:
    chip = started(OFF_CANC | SET_FREQ)
    run(chip, 10)
    chip.counts(MAGNETOMETER)  # the 11th
    chip.write(CFG_REG_B, SET_FREQ)
    chip.wait(PERIOD_PS)
    assert set(run(chip, 200)) == {MINUS}

    chip.write(CFG_REG_A, 0x8F)
    chip.write(CFG_REG_A, 0x8C)
    chip.wait(TURN_ON_PS)
    assert set(run(chip, 200)) == {PLUS}


# -- single ---------------------------------------------------------------------------------------------


def test_single_measurements_alternate_with_one_shot_cancellation() -> None:
    """The host computes the mean of two samples (AN5069 section 8)."""
    chip = chip_with_hoff(OFF_CANC | ONE_SHOT)
    found = [single(chip) for _ in range(6)]

    assert found == [MINUS, PLUS] * 3
    assert np.mean(found, axis=0) == pytest.approx([0, 0, 0])


@pytest.mark.parametrize("config_b", [0x00, LPF, SET_FREQ, OFF_CANC])
def test_other_single_measurements_contain_hoff(config_b: int) -> None:
    chip = chip_with_hoff(config_b)

    assert [single(chip) for _ in range(4)] == [PLUS] * 4


def test_one_shot_cancellation_needs_off_canc(words: Words) -> None:
    """Datasheet T28: OFF_CANC must be 1 as well."""
    chip = chip_with_hoff(ONE_SHOT)

    assert kinds(chip.notes) == ["forbidden"]
    words("sensors", texts(chip.notes))
    assert [single(chip) for _ in range(2)] == [PLUS] * 2


# -- bandwidth ------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("config_b", "expected"),
    [
        (0x00, [0, 0, 1000, 1000]),
        (LPF, [0, 0, 500, 1000]),
        (OFF_CANC, [0, 0, 500, 1000]),
        (LPF | OFF_CANC, [0, 0, 500, 1000]),
    ],
)
def test_field_step_shows_mean_of_two_with_averaging(config_b: int, expected: list[int]) -> None:
    chip = Chip("LIS2MDL")
    first_ps = TURN_ON_PS + (PERIOD_PS if config_b & OFF_CANC else 0)
    at_s = (first_ps + 1.5 * PERIOD_PS) / PS_PER_S
    chip.world.signals["magnetic_field_mgauss"] = step(
        constant(0.0, 0.0, 0.0), constant(1500.0, 0.0, 0.0), at_s
    )
    chip.write(CFG_REG_B, config_b)
    chip.write(CFG_REG_A, 0x8C)
    chip.wait(first_ps)

    assert [counts[0] for counts in run(chip, 4)] == expected


def test_filter_starts_with_its_first_sample() -> None:
    """The field before the start of measurements has no effect."""
    chip = Chip("LIS2MDL")
    chip.world.signals["magnetic_field_mgauss"] = step(
        constant(0.0, 0.0, 0.0), constant(1500.0, 0.0, 0.0), (TURN_ON_PS - 1000) / PS_PER_S
    )
    chip.write(CFG_REG_B, LPF)
    chip.write(CFG_REG_A, 0x8C)
    chip.wait(TURN_ON_PS)

    assert [counts[0] for counts in run(chip, 2)] == [1000, 1000]


@pytest.mark.parametrize(
    ("config_b", "config_a", "rms", "correlation"),
    [
        (0x00, 0x8C, 4.5, 0.0),
        (LPF, 0x8C, 3.0, 0.5),
        (OFF_CANC, 0x8C, 3.0, 0.5),
        (LPF | OFF_CANC, 0x9C, 6.0, 0.5),
    ],
)
def test_mean_of_two_has_documented_noise(
    config_b: int, config_a: int, rms: float, correlation: float
) -> None:
    """The RMS of Table 3. Neighbouring means share a measurement. This halves the bandwidth. 4000 samples are used."""
    chip = Chip("LIS2MDL", LIS2MDLErrors(noise_mgauss=4.5), seed=4)
    chip.set("magnetic_field_mgauss", 0.0, 0.0, 0.0)
    chip.write(CFG_REG_B, config_b)
    chip.write(CFG_REG_A, config_a)
    chip.wait(2 * PERIOD_PS)
    noise = 1.5 * np.array(run(chip, 4000))

    assert noise.std(axis=0) == pytest.approx([rms] * 3, rel=0.07)
    found = np.mean([np.corrcoef(axis[1:], axis[:-1])[0, 1] for axis in noise.T])
    assert found == pytest.approx(correlation, abs=0.05)


def test_enabled_filter_starts_from_previous_measurement() -> None:
    """This includes its noise: the mean of two, scaled to 3.0 of Table 3 instead of 4.5 / sqrt(2)."""
    runs = []
    for config_b in (0x00, LPF):
        chip = Chip("LIS2MDL", LIS2MDLErrors(noise_mgauss=450.0), seed=4)
        chip.set("magnetic_field_mgauss", 0.0, 0.0, 0.0)
        chip.write(CFG_REG_A, 0x8C)
        chip.wait(TURN_ON_PS + 4 * PERIOD_PS)
        chip.write(CFG_REG_B, config_b)
        runs.append(np.array(run(chip, 2)))
    unfiltered, filtered = runs

    assert filtered[0] == pytest.approx(unfiltered[0])
    expected = unfiltered.mean(axis=0) * np.sqrt(2) * 3.0 / 4.5
    assert filtered[1] == pytest.approx(expected, abs=1.5)


def test_single_measurements_are_not_averaged() -> None:
    """Without averaging, the noise is Table 3's value without LPF and OFF_CANC. 800 measurements are used."""
    chip = Chip("LIS2MDL", LIS2MDLErrors(noise_mgauss=4.5), seed=4)
    chip.set("magnetic_field_mgauss", 0.0, 0.0, 0.0)
    chip.write(CFG_REG_B, LPF)
    noise = 1.5 * np.array([single(chip) for _ in range(800)])

    assert noise.std(axis=0) == pytest.approx([4.5] * 3, rel=0.1)


def test_self_test_is_not_reduced_by_cancellation() -> None:
    """The field of the coil does not change its sign with the pulses. Datasheet T3."""
    chip = started(OFF_CANC)
    chip.write(CFG_REG_C, 0x02)
    chip.wait(4 * PERIOD_PS)

    assert all(15 <= 1.5 * count <= 500 for count in chip.counts(MAGNETOMETER))
