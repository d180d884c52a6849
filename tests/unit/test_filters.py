"""Biquad sections in blocks, and filtered samples as a function of their number, compared with scipy."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.signal import butter, sosfilt

from fcu_emulator.sensors.filters import (
    PAGE,
    SLOPE,
    Chain,
    SampledFilter,
    Section,
    chain,
    high_pass,
    low_pass,
    response,
)

CUTOFFS = st.floats(1e-5, 0.49)
CASCADES = {
    "slope": (SLOPE,),
    "lpf2": (low_pass(1 / 400),),
    "analog and lpf2": (low_pass(1500 / 6664), low_pass(1 / 400)),
    "high-pass": (high_pass(1 / 9), low_pass(0.3)),
    "three": (high_pass(1 / 100), low_pass(1 / 4), low_pass(0.45)),
}
cascades = pytest.mark.parametrize("sections", CASCADES.values(), ids=CASCADES)


def reference(sections: tuple[Section, ...], signal: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the output of the same cascade, computed sample by sample from rest."""
    rows = [(b0, b1, b2, 1.0, a1, a2) for b0, b1, b2, a1, a2 in sections]
    filtered: NDArray[np.float64] = sosfilt(np.array(rows), signal)
    return filtered


def white(count: int, seed: int = 1) -> NDArray[np.float64]:
    return np.random.default_rng(seed).standard_normal((3, count))


# -- sections -------------------------------------------------------------------------------------------


@given(CUTOFFS)
def test_low_pass_is_second_order_butterworth(cutoff: float) -> None:
    b0, b1, b2, a1, a2 = low_pass(cutoff)
    assert butter(2, 2 * cutoff, output="sos")[0] == pytest.approx((b0, b1, b2, 1, a1, a2), rel=1e-6)


@given(CUTOFFS)
def test_high_pass_is_second_order_butterworth(cutoff: float) -> None:
    b0, b1, b2, a1, a2 = high_pass(cutoff)
    expected = butter(2, 2 * cutoff, "highpass", output="sos")[0]
    assert expected == pytest.approx((b0, b1, b2, 1, a1, a2), rel=1e-6)


@given(CUTOFFS)
def test_both_filters_lose_3_db_at_cutoff(cutoff: float) -> None:
    for section in (low_pass(cutoff), high_pass(cutoff)):
        gain = abs(response((section,), np.array([cutoff]))[0])
        assert gain == pytest.approx(np.sqrt(0.5), rel=1e-5)


def test_slope_filter_halves_power_at_quarter_rate() -> None:
    """AN5040 3.7: the slope filter has ODR/4. It is a high-pass, so lower frequencies have less than half the power."""
    gains = np.abs(response((SLOPE,), np.array([0.0, 0.25, 0.5])))
    assert gains == pytest.approx([0, np.sqrt(0.5), 1], abs=1e-12)


# -- chains ---------------------------------------------------------------------------------------------


@cascades
def test_filter_page_equals_single_samples(sections: tuple[Section, ...]) -> None:
    filters, signal = Chain(sections, "zero"), white(3 * PAGE)
    state, output = filters.at_rest(3), []
    for first in range(0, 3 * PAGE, PAGE):
        page, state = filters.run(signal[:, first : first + PAGE], state)
        output.append(page)

    assert np.hstack(output) == pytest.approx(reference(sections, signal), abs=1e-9)


@cascades
@pytest.mark.parametrize("count", [0, 1, 63, 64, 65, 1000, PAGE])
def test_filter_state_is_correct_after_any_sample_count(sections: tuple[Section, ...], count: int) -> None:
    filters, signal = chain(sections, "zero"), white(count + PAGE)

    state = filters.after(signal[:, :count], filters.at_rest(3))
    output, _ = filters.run(signal[:, count:], state)

    assert output == pytest.approx(reference(sections, signal)[:, count:], abs=1e-9)


@cascades
def test_filter_forgets_input_after_its_settling_time(sections: tuple[Section, ...]) -> None:
    filters = chain(sections, "zero")
    impulse = np.zeros(filters.settling + 2000)
    impulse[0] = 1

    left = np.abs(reference(sections, impulse)[filters.settling :])
    assert left.max() < 1e-8


@cascades
def test_noise_gain_is_rms_of_impulse_response(sections: tuple[Section, ...]) -> None:
    """The theorem is Parseval's."""
    impulse = np.zeros(20_000)
    impulse[0] = 1
    expected = np.sqrt(np.sum(reference(sections, impulse) ** 2))
    assert chain(sections, "zero").noise_gain == pytest.approx(expected, rel=1e-3)


# -- samples --------------------------------------------------------------------------------------------


class World:
    """A world with endless white noise on a level that can be changed, and a record of the requested times."""

    def __init__(self, samples: int = 80_000) -> None:
        self.signal = 5.0 + white(samples)
        self.asked: list[tuple[int, int]] = []

    def source(self, number: int, count: int) -> NDArray[np.float64]:
        self.asked.append((number, count))
        return self.signal[:, number : number + count].copy()


def filtered(world: World, filters: Chain, number: int = 0) -> SampledFilter:
    result = SampledFilter(world.source)
    result.restart(filters, number)
    return result


SETTLED = chain(CASCADES["analog and lpf2"], "settled")
READS = st.lists(st.tuples(st.integers(0, 70_000), st.integers(1, 4096)), min_size=1, max_size=6)


def test_settled_filter_starts_from_its_first_sample() -> None:
    world = World()
    first = world.signal[:, 100:101]
    expected = first + reference(SETTLED.sections, world.signal[:, 100:5100] - first)

    assert filtered(world, SETTLED, 100).block(100, 5000) == pytest.approx(expected, abs=1e-9)


def test_filter_from_zero_treats_earlier_input_as_zero() -> None:
    world, slope = World(), chain((SLOPE,), "zero")
    begun = filtered(world, slope).block(0, 2)

    assert begun[:, 0] == pytest.approx(world.signal[:, 0] / 2)
    assert begun[:, 1] == pytest.approx((world.signal[:, 1] - world.signal[:, 0]) / 2)


def test_reference_filter_subtracts_first_sample() -> None:
    world = World()
    unchanged = chain(((1.0, 0.0, 0.0, 0.0, 0.0),), "reference")
    expected = world.signal[:, 7:107] - world.signal[:, 7:8]

    assert filtered(world, unchanged, 7).block(7, 100) == pytest.approx(expected, abs=1e-12)


def test_constant_signal_passes_low_pass_unchanged() -> None:
    world = World(50_000)
    world.signal[:] = np.array([[0.1], [-1000 / 3], [0.0]])

    assert np.array_equal(filtered(world, SETTLED).block(0, 40_000), world.signal[:, :40_000])


@settings(max_examples=20)
@given(READS)
def test_filtered_samples_do_not_depend_on_read_order(reads: list[tuple[int, int]]) -> None:
    """This also applies over segments, which have 16 pages here and begin again."""
    world = World()
    read_all = filtered(world, SETTLED)
    everything = np.hstack([read_all.block(first, 4000) for first in range(0, 76_000, 4000)])
    some = filtered(world, SETTLED)

    for number, count in reads:
        assert np.array_equal(some.block(number, count), everything[:, number : number + count])


def test_restarted_filter_equals_continuous_one() -> None:
    world = World()
    first = world.signal[:, :1]
    expected = first + reference(SETTLED.sections, world.signal - first)

    assert filtered(world, SETTLED).block(60_000, 4096) == pytest.approx(expected[:, 60_000:64_096], abs=1e-8)


def test_long_skip_does_not_compute_every_sample() -> None:
    world = World()
    filtered(world, SETTLED).block(18 * PAGE, 10)

    assert sum(count for _, count in world.asked) <= 4 * PAGE + 1


@settings(max_examples=30)
@given(st.integers(1, 9000), st.integers(1, 3000))
def test_world_change_affects_later_filtered_samples_only(number: int, count: int) -> None:
    """The world is not evaluated for earlier times, which the world may have dropped."""
    world = World()
    changing = filtered(world, SETTLED)
    before = changing.block(0, number + 1)[:, :number].copy()
    world.signal[:, number:] += 3
    world.asked.clear()
    changing.forget(number)

    after = changing.block(number, count)
    known = changing.block(max(number - 100, 0), min(number, 100))

    assert np.array_equal(known, before[:, -100:])
    first = world.signal[:, :1]
    expected = first + reference(SETTLED.sections, world.signal[:, : number + count] - first)
    assert after == pytest.approx(expected[:, number:], abs=1e-9)
    assert min(asked for asked, _ in world.asked) >= number


def test_world_change_before_first_sample_replaces_signal() -> None:
    world = World()
    changing = filtered(world, SETTLED)
    changing.block(0, 10)
    world.signal += 3
    changing.forget(0)

    assert np.array_equal(changing.block(0, 10), filtered(world, SETTLED).block(0, 10))


@pytest.mark.parametrize("number", [1, 64, 1000, PAGE, 3 * PAGE + 77])
def test_change_of_source_keeps_filter_state(number: int) -> None:
    world = World()
    changing = filtered(world, SETTLED)
    changing.block(0, 10)
    changing.split(number)
    first = world.signal[:, :1].copy()
    world.signal[:, number:] *= 2

    expected = first + reference(SETTLED.sections, world.signal - first)
    assert changing.block(number, 3000) == pytest.approx(expected[:, number : number + 3000], abs=1e-9)
