"""A sample stream agrees with a slow and simple oracle: exact times, one value per sample, restarts and blocks."""

from __future__ import annotations

import math
import struct
from fractions import Fraction
from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from fcu_emulator.sensors.front_end import NoiseSource, noise_key
from fcu_emulator.sensors.register_file import NEVER_PS
from fcu_emulator.sensors.sampling import PS_PER_S, SampleStream, Times

RATES = st.sampled_from([Fraction(rate) for rate in ("1.6", "12.5", "26", "75", "833", "6664")])
STARTS = st.integers(0, 10 * PS_PER_S)
GAPS = st.lists(st.one_of(st.integers(1, PS_PER_S), st.integers(1, 10**4 * PS_PER_S)), max_size=15)


def tagged(number: int, t_s: Times) -> bytes:
    """Return samples that carry their number and their exact time."""
    return b"".join(struct.pack("<qd", number + index, t) for index, t in enumerate(t_s))


def sample(stream: SampleStream) -> tuple[int, float]:
    """Return number and time in seconds of the stream's current sample."""
    number, t_s = struct.unpack("<qd", stream.data)
    return number, t_s


def moments(start_ps: int, gaps: list[int]) -> list[int]:
    return [start_ps + sum(gaps[: index + 1]) for index in range(len(gaps))]


def due_ps(start_ps: int, rate_hz: Fraction, number: int) -> int:
    """Return the time of sample ``number``: the first after one period, each next sample a period later, rounded up."""
    return start_ps + math.ceil(PS_PER_S / rate_hz) + math.ceil(number * PS_PER_S / rate_hz)


@given(STARTS, RATES, GAPS)
def test_current_sample_is_latest_that_is_due(start_ps: int, rate_hz: Fraction, gaps: list[int]) -> None:
    stream = SampleStream(16, tagged)
    stream.start(start_ps, rate_hz)
    seen = -1

    for now_ps in moments(start_ps, gaps):
        if now_ps >= stream.next_ps:
            fresh = stream.advance(now_ps)
            assert fresh == stream.index - seen
            assert fresh >= 1
            seen = stream.index
            number, t_s = sample(stream)
            assert number == seen
            assert t_s == pytest.approx(due_ps(start_ps, rate_hz, seen) / PS_PER_S, rel=1e-12)
        assert stream.next_ps == due_ps(start_ps, rate_hz, seen + 1) == stream.time_ps(seen + 1)
        assert now_ps < stream.next_ps
        assert seen < 0 or due_ps(start_ps, rate_hz, seen) <= now_ps


@given(STARTS, RATES, st.lists(st.integers(1, 400), min_size=1, max_size=15), st.sets(st.integers(0, 14)))
def test_sample_time_does_not_depend_on_reads(
    start_ps: int, rate_hz: Fraction, gaps: list[int], invalidated: set[int]
) -> None:
    """Times are equal in every bit: a difference of 1e-16 s could give another count. There are gaps in the samples."""
    often = SampleStream(16, tagged)
    often.start(start_ps, rate_hz)

    for turn, number in enumerate(moments(-1, gaps)):
        now_ps = due_ps(start_ps, rate_hz, number)
        if turn in invalidated:
            often.invalidate()
        often.advance(now_ps)
        once = SampleStream(16, tagged)
        once.start(start_ps, rate_hz)
        once.advance(now_ps)
        assert often.data == once.data
        assert often.next_ps == once.next_ps


@given(RATES, st.lists(st.integers(1, 5 * PS_PER_S), min_size=2, max_size=5))
def test_sample_numbers_continue_over_restarts(rate_hz: Fraction, runs_ps: list[int]) -> None:
    """Otherwise two one-shot measurements would have the same noise."""
    stream, now_ps, numbers = SampleStream(16, tagged), 0, []
    for run_ps in runs_ps:
        stream.start(now_ps, rate_hz)
        now_ps += run_ps
        while stream.next_ps <= now_ps:
            stream.advance(stream.next_ps)
            numbers.append(sample(stream)[0])

    assert numbers == list(range(len(numbers)))


@given(STARTS, STARTS, RATES, st.sampled_from([1, 2, 64]), st.booleans(), GAPS)
def test_synchronised_streams_coincide_despite_reads(
    first_ps: int, second_ps: int, rate_hz: Fraction, ratio: int, faster: bool, gaps: list[int]
) -> None:
    """As soon as both run, every sample of the slower stream comes with a sample of the faster stream."""
    other_hz = rate_hz * ratio if faster else rate_hz / ratio
    first, second = SampleStream(16, tagged), SampleStream(16, tagged)
    first.start(first_ps, rate_hz)
    for now_ps in moments(first_ps, gaps):
        if first.next_ps <= now_ps <= second_ps:
            first.advance(now_ps)
    second.start_in_step(first, second_ps, other_hz)

    assert PS_PER_S / other_hz <= second.next_ps - second_ps <= 2 * PS_PER_S / other_hz + 1
    assert second.latest(second.next_ps - 1) == -1
    slow, fast = (first, second) if faster else (second, first)
    both_ps = max(first.time_ps(0), second.time_ps(0))
    for number in range(slow.latest(both_ps) + 1, slow.latest(both_ps) + 20):
        at_ps = slow.time_ps(number)
        assert fast.time_ps(fast.latest(at_ps)) == at_ps


@given(STARTS, st.integers(1, PS_PER_S), st.integers(0, 10**6 * PS_PER_S))
def test_single_measurement_gives_one_sample(start_ps: int, delay_ps: int, later_ps: int) -> None:
    stream = SampleStream(16, tagged)
    stream.start_single(start_ps, delay_ps)

    assert stream.next_ps == start_ps + delay_ps
    assert stream.advance(start_ps + delay_ps) == 1
    assert sample(stream) == (0, (start_ps + delay_ps) / PS_PER_S)
    assert start_ps + delay_ps + later_ps < stream.next_ps


@given(RATES, st.integers(0, 10**6))
def test_stopping_keeps_latest_sample_for_ever(rate_hz: Fraction, samples: int) -> None:
    stream = SampleStream(16, tagged)
    stream.start(0, rate_hz)
    stream.advance(due_ps(0, rate_hz, samples))
    kept = stream.data

    stream.stop()

    assert not stream.running
    assert stream.next_ps == NEVER_PS
    assert stream.data == kept
    assert sample(stream)[0] == samples


def test_data_is_0_before_first_sample() -> None:
    stream = SampleStream(6, tagged)

    assert (stream.data, stream.index, stream.running) == (bytes(6), -1, False)


@given(RATES, st.integers(1, 50), st.integers(1, 50))
def test_invalidating_recomputes_only_later_samples(rate_hz: Fraction, before: int, after: int) -> None:
    """The producer is called again for later samples, in order and without a gap."""
    factor = [1]
    stream = SampleStream(8, lambda number, t_s: struct.pack(f"<{len(t_s)}q", *(factor * len(t_s))))
    stream.start(0, rate_hz)
    seen = []
    for number in range(before + after):
        if number == before:
            factor[0] = 2
            stream.invalidate()
        stream.advance(due_ps(0, rate_hz, number))
        seen.append(struct.unpack("<q", stream.data)[0])

    assert seen == [1] * before + [2] * after


# -- noise ----------------------------------------------------------------------------------------


@given(
    st.integers(0, 2**32 - 1), st.lists(st.tuples(st.integers(0, 20000), st.integers(1, 5000)), max_size=6)
)
def test_noise_is_function_of_sample_number(seed: int, blocks: list[tuple[int, int]]) -> None:
    """Earlier draws have no effect, also across the borders of pages."""
    used = NoiseSource(noise_key(seed, "part"), 3)

    for first, count in blocks:
        block = used.block(first, count)
        assert block.shape == (3, count)
        for offset in {0, count // 2, count - 1}:
            alone = NoiseSource(noise_key(seed, "part"), 3).block(first + offset, 1)
            assert (block[:, offset] == alone[:, 0]).all()


def test_noise_is_white_and_of_unit_variance() -> None:
    """40000 samples: the standard errors are 0.005 for the mean and the correlation, 0.0035 for the RMS."""
    noise = NoiseSource(noise_key(1, "part"), 2).block(0, 40_000)

    assert noise.mean(axis=1) == pytest.approx([0, 0], abs=0.02)
    assert noise.std(axis=1) == pytest.approx([1, 1], abs=0.015)
    assert (noise[0] * noise[1]).mean() == pytest.approx(0, abs=0.02)
    assert (noise[0, 1:] * noise[0, :-1]).mean() == pytest.approx(0, abs=0.02)


def test_every_noise_source_has_separate_key() -> None:
    names = [(seed, part, channel) for seed in range(50) for part in ("A", "B") for channel in ("XL", "G")]
    keys = sorted(noise_key(*name) for name in names)

    assert all(first < second for first, second in pairwise(keys))
    assert all(0 <= key < 2**128 for key in keys)
