"""The LPS22HB's low-pass filter: signal, noise, and LPFP_RES (datasheet 9.5, 9.23, Table 18)."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise

import numpy as np
import pytest

from fcu_emulator.sensors.lps22hb import LPS22HBErrors
from tests.support.sensor_fakes import PS_PER_S, Array, Chip, constant, step

CTRL_REG1, CTRL_REG2, RES_CONF, PRESS_OUT_XL, TEMP_OUT_L, LPFP_RES = 0x10, 0x11, 0x1A, 0x28, 0x2B, 0x33
RATE_HZ = 50
OFF, ODR_9, ODR_20 = 0x40, 0x48, 0x4C  # CTRL_REG1 at 50 Hz
PERIOD_PS = PS_PER_S // RATE_HZ
UP = 20 - 0.5  # samples before the pressure steps up
NOISE = LPS22HBErrors(pressure_noise_hpa=0.0075)


def pressures(chip: Chip, count: int) -> list[float]:
    """Return the next ``count`` samples in hPa."""
    read = []
    for _ in range(count):
        chip.wait(PERIOD_PS)
        read.append(int.from_bytes(chip.read(PRESS_OUT_XL, 3), "little") / 4096)
    return read


def stepping(control1: int) -> Chip:
    """Return a sensor with a step of 10 hPa before sample 20; both signals step."""
    chip = Chip("LPS22HB")
    for channel, low, high in (("pressure_hpa", 1000.0, 1010.0), ("temperature_degc", 20.0, 30.0)):
        chip.world.signals[channel] = step(constant(low), constant(high), UP / RATE_HZ)
    chip.write(CTRL_REG1, control1)
    return chip


def test_step_without_filter_is_visible_immediately() -> None:
    assert pressures(stepping(OFF), 25) == [1000.0] * 19 + [1010.0] * 6


@pytest.mark.parametrize(("control1", "divisor"), [(ODR_9, 9), (ODR_20, 20)])
def test_filter_starts_settled_and_smooths_step(control1: int, divisor: int) -> None:
    """The filter reaches half of the step after a quarter of the cut-off's period, and settles within a few periods."""
    read = pressures(stepping(control1), 200)

    assert read[:19] == [1000.0] * 19
    half_way = next(number for number, hpa in enumerate(read) if hpa > 1005.0) - 19
    assert divisor / 5 < half_way < divisor / 3
    assert max(hpa - before for before, hpa in pairwise(read)) < 10.0 * 4 / divisor
    assert 1010.1 < max(read) < 1010.6, "a second-order Butterworth overshoots by 4 or 5 %"
    assert read[19 + 5 * divisor :] == pytest.approx([1010.0] * len(read[19 + 5 * divisor :]), abs=0.001)


def test_temperature_is_not_filtered() -> None:
    chip = stepping(ODR_20)
    chip.wait(20 * PERIOD_PS)
    assert chip.read(TEMP_OUT_L, 2) == (3000).to_bytes(2, "little")


@pytest.mark.parametrize(("control1", "divisor"), [(ODR_9, 9), (ODR_20, 20)])
def test_sine_at_cutoff_is_3_db_lower(control1: int, divisor: int) -> None:
    def sine(t_s: Array) -> Array:
        wave: Array = 1000.0 + 10.0 * np.sin(2 * np.pi * RATE_HZ / divisor * t_s)
        return wave

    chip = Chip("LPS22HB")
    chip.world.signals["pressure_hpa"] = sine
    chip.write(CTRL_REG1, control1)
    pressures(chip, 10 * divisor)

    read = pressures(chip, 10 * divisor)  # whole periods
    assert np.std(read) == pytest.approx(10.0 / 2, rel=0.01), "10 / sqrt(2) as RMS, again over sqrt(2)"


# -- restarts -----------------------------------------------------------------------------------------------


def test_reading_lpfp_res_restarts_filter() -> None:
    """Datasheet 9.23: this avoids the transitory phase."""
    settling, restarted = stepping(ODR_20), stepping(ODR_20)
    for chip in (settling, restarted):
        pressures(chip, 22)
    assert restarted.read(LPFP_RES) == b"\x00"

    assert max(pressures(settling, 3)) < 1010.0 - 0.5
    assert pressures(restarted, 3) == [1010.0] * 3


def test_reading_lpfp_res_changes_nothing_without_filter() -> None:
    chip = stepping(OFF)
    pressures(chip, 10)
    chip.read(LPFP_RES)
    assert pressures(chip, 11) == [1000.0] * 9 + [1010.0] * 2
    assert chip.notes == []


@pytest.mark.parametrize("other", [ODR_9, OFF])
def test_changed_filter_starts_settled(other: int) -> None:
    chip = stepping(ODR_20)
    pressures(chip, 22)
    chip.write(CTRL_REG1, other)
    assert pressures(chip, 3) == [1010.0] * 3


def test_changed_rate_restarts_filter() -> None:
    chip = stepping(ODR_20)
    pressures(chip, 22)
    chip.write(CTRL_REG1, 0x3C)
    chip.wait(PS_PER_S // 25)
    assert chip.read(PRESS_OUT_XL, 3) == (1010 * 4096).to_bytes(3, "little")


def test_one_shot_passes_no_filter() -> None:
    """Datasheet Table 18: the filter works only in continuous mode."""
    chip = stepping(0x0C)
    chip.t_ps = PS_PER_S
    chip.write(CTRL_REG2, 0x11)
    chip.wait(PS_PER_S)
    assert chip.read(PRESS_OUT_XL, 3) == (1010 * 4096).to_bytes(3, "little")


def test_bdu_and_other_settings_do_not_affect_filter() -> None:
    undisturbed, disturbed = stepping(ODR_20), stepping(ODR_20)
    pressures(undisturbed, 22)
    pressures(disturbed, 22)
    disturbed.write(CTRL_REG1, ODR_20 | 0x02)
    disturbed.write(0x0C, 0x10)
    assert pressures(disturbed, 50) == pressures(undisturbed, 50)


def test_world_change_keeps_filter_state() -> None:
    """The filter continues from the samples before, for any times of reads."""
    for looks in (lambda chip: pressures(chip, 22), lambda chip: chip.wait(22 * PERIOD_PS)):
        chip = stepping(ODR_20)
        chip.world.signals["pressure_hpa"] = constant(1000.0)
        looks(chip)
        chip.world.signals["pressure_hpa"] = step(constant(1000.0), constant(1010.0), 22.5 / RATE_HZ)
        chip.part.world_changed(chip.t_ps)
        assert pressures(chip, 6) == pressures(stepping(ODR_20), 25)[-6:]


# -- noise --------------------------------------------------------------------------------------------------


def noise(control1: int, res_conf: int = 0x00, period_ps: int = PERIOD_PS) -> Array:
    """Return 4000 samples of a world at rest in hPa."""
    chip = Chip("LPS22HB", NOISE, seed=3)
    chip.write(RES_CONF, res_conf)
    chip.write(CTRL_REG1, control1)
    counts = []
    for _ in range(4000):
        chip.wait(period_ps)
        counts.append(int.from_bytes(chip.read(PRESS_OUT_XL, 3), "little"))
    return np.array(counts) / 4096 - 1013.25


def correlation(samples: Array) -> float:
    """Return the correlation of a sample with the next sample."""
    return float(np.corrcoef(samples[1:], samples[:-1])[0, 1])


def test_filter_smooths_white_noise() -> None:
    white, nine, twenty = noise(OFF), noise(ODR_9), noise(ODR_20)

    assert twenty.std() == pytest.approx(0.0075, rel=0.1)
    assert twenty.std() < nine.std() < white.std()
    assert abs(correlation(white)) < 0.05
    assert 0.5 < correlation(nine) < correlation(twenty) < 0.97


def test_noise_of_sample_is_equal_at_every_rate() -> None:
    assert noise(0x50, period_ps=-(-PS_PER_S // 75)).std() == pytest.approx(
        noise(0x10, period_ps=PS_PER_S).std()
    )


@pytest.mark.parametrize("control1", [OFF, ODR_9, ODR_20])
def test_low_current_is_noisier_than_low_noise(control1: int) -> None:
    assert noise(control1, 0x01).std() > 1.1 * noise(control1).std()


def test_noise_in_lab_setting_is_10_cm() -> None:
    """No document has a figure. 10 cm were chosen, with 8.4 m for each hPa."""
    assert 8.4 * noise(0x30, 0x01, PS_PER_S // 25).std() == pytest.approx(0.10, rel=0.05)


def test_filtered_samples_do_not_depend_on_reads() -> None:
    """The noise, a moving world and the filter are tested over more samples than are computed at once."""
    looks: list[Callable[[Chip], None]] = [lambda chip: None, lambda chip: chip.part.world_changed(chip.t_ps)]
    for disturb in looks:
        often, rarely = Chip("LPS22HB", NOISE, seed=1), Chip("LPS22HB", NOISE, seed=1)
        for chip in (often, rarely):
            chip.world.signals["pressure_hpa"] = lambda t_s: 1000.0 + np.sin(t_s)
            chip.write(CTRL_REG1, ODR_20)
        for number in range(6000):
            often.wait(PERIOD_PS)
            if number % 97 == 0:
                disturb(often)
            read = often.read(PRESS_OUT_XL, 5)
            if number % 1999 == 0:
                rarely.t_ps = often.t_ps
                assert rarely.read(PRESS_OUT_XL, 5) == read
