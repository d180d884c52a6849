"""A run depends only on the seed, the registers and the world, and not on the times of reads."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.support.sensor_fakes import CHANNELS, PS_PER_MS, SENSORS, Channel, Chip, ramp

RUN_PS = 2000 * PS_PER_MS
MOMENTS = st.integers(1, RUN_PS - 1)
parts = pytest.mark.parametrize("name", SENSORS)
channels = pytest.mark.parametrize("channel", CHANNELS, ids=str)


def noisy(name: str, seed: int = 1) -> Chip:
    """Return a typical sensor with all channels on, in a moving world."""
    chip = Chip(name, SENSORS[name].ERRORS.of_quality("typical", seed), seed)
    for channel in CHANNELS:
        if channel.part == name:
            slope = 500 * channel.scales[0][1]
            chip.world.signals[channel.name] = ramp(channel.value(channel.zero), channel.value(slope))
            chip.configure(channel.scales[0][0])
    return chip


def outputs(chip: Chip) -> dict[str, tuple[int, ...]]:
    return {channel.name: chip.counts(channel) for channel in CHANNELS if channel.part == chip.part.NAME}


@parts
@given(moments=st.lists(st.tuples(MOMENTS, st.integers(0, 0x7F), st.integers(1, 16)), max_size=20))
def test_reading_often_or_rarely_gives_same_value(name: str, moments: list[tuple[int, int, int]]) -> None:
    often, once = noisy(name), noisy(name)

    for t_ps, address, count in sorted(moments):
        often.t_ps = t_ps
        often.read(address, count)
    often.t_ps = once.t_ps = RUN_PS

    assert outputs(often) == outputs(once)


@channels
@given(moments=st.lists(MOMENTS, min_size=1, max_size=20))
def test_sample_does_not_depend_on_other_reads(channel: Channel, moments: list[int]) -> None:
    everywhere = noisy(channel.part)
    for t_ps in sorted(moments):
        everywhere.t_ps = t_ps
        alone = noisy(channel.part)
        alone.t_ps = t_ps
        assert everywhere.counts(channel) == alone.counts(channel)


@parts
@given(moments=st.lists(MOMENTS, max_size=20))
def test_recomputing_at_any_moment_changes_nothing(name: str, moments: list[int]) -> None:
    disturbed, left_alone = noisy(name), noisy(name)

    for t_ps in sorted(moments):
        disturbed.t_ps = left_alone.t_ps = t_ps
        disturbed.part.world_changed()
        assert outputs(disturbed) == outputs(left_alone)


@parts
def test_same_seed_gives_same_run(name: str) -> None:
    first, second = noisy(name, seed=5), noisy(name, seed=5)

    for _ in range(200):
        first.wait(10 * PS_PER_MS)
        second.wait(10 * PS_PER_MS)
        assert outputs(first) == outputs(second)


@parts
def test_another_seed_gives_other_errors(name: str) -> None:
    assert SENSORS[name].ERRORS.of_quality("typical", 1) != SENSORS[name].ERRORS.of_quality("typical", 2)
    assert SENSORS[name].ERRORS.of_quality("typical", 1) == SENSORS[name].ERRORS.of_quality("typical", 1)


@pytest.mark.parametrize(
    "channel", [channel for channel in CHANNELS if channel.name != "temperature_degc"], ids=str
)
def test_another_seed_gives_other_noise(channel: Channel) -> None:
    """The same deviations with two seeds for the noise: only the noise differs."""
    errors = SENSORS[channel.part].ERRORS.of_quality("typical", 1)
    runs = []
    for seed in (1, 2):
        chip = Chip(channel.part, errors, seed)
        chip.configure(channel.scales[0][0])
        run = []
        for sample in range(50):
            chip.t_ps = channel.sample_ps(sample)
            run.append(chip.counts(channel))
        runs.append(run)

    assert runs[0] != runs[1]
