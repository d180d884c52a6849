"""The event functions agree with slow and simple oracles that evaluate whole runs (AN5040 section 5).

In addition, the levels of a pin do not depend on the times of reads.
"""

from __future__ import annotations

from typing import NamedTuple

from hypothesis import given
from hypothesis import strategies as st

from tests.support.motion_fakes import (
    CTRL8_XL,
    D6D_SRC,
    DRDY_PULSE_CFG,
    ENABLE,
    FREE_FALL,
    INT1_CTRL,
    INT2_CTRL,
    INT_DUR2,
    MD1_CFG,
    MD2_CFG,
    TAP_CFG,
    TAP_SRC,
    TAP_THS_6D,
    WAKE_UP_DUR,
    WAKE_UP_SRC,
    WAKE_UP_THS,
    Bench,
    Edge,
    Sample,
    sample_ps,
    source_bits,
)

FREE_FALL_MG = (156, 219, 250, 312, 344, 406, 469, 500)
LEVELS = st.sampled_from((-1000.0, -400.0, -180.0, -20.0, 0.0, 60.0, 230.0, 330.0, 800.0))
SAMPLES = st.lists(st.tuples(LEVELS, LEVELS, LEVELS), min_size=1, max_size=40)
STEADY = st.lists(
    st.tuples(st.sampled_from(((0.0, 0.0, 0.0), (0.0, 0.0, 1000.0), (700.0, 0.0, 0.0))), st.integers(1, 12))
)
BURSTS = st.lists(st.tuples(st.booleans(), st.integers(1, 7)), min_size=1, max_size=14)


def slopes(samples: list[Sample]) -> list[Sample]:
    """Return half of each difference; before the first sample the value is zero."""
    before = [(0.0, 0.0, 0.0), *samples]
    return [
        ((x - px) / 2, (y - py) / 2, (z - pz) / 2)
        for (x, y, z), (px, py, pz) in zip(samples, before, strict=False)
    ]


def lasting(conditions: list[bool], periods: int) -> list[bool]:
    """Return for each sample whether a condition has been true for this number of periods."""
    return [n >= periods and all(conditions[n - periods : n + 1]) for n in range(len(conditions))]


@given(samples=SAMPLES, runs=STEADY, code=st.integers(0, 7), duration=st.integers(0, 12))
def test_free_fall_agrees_with_oracle(
    samples: list[Sample], runs: list[tuple[Sample, int]], code: int, duration: int
) -> None:
    samples = samples + [sample for sample, count in runs for _ in range(count)]
    falling = [all(abs(value) < FREE_FALL_MG[code] for value in sample) for sample in samples]

    bits = source_bits(WAKE_UP_SRC, samples, (FREE_FALL, duration << 3 | code))

    assert [bool(value & 0x20) for value in bits] == lasting(falling, duration)


@given(samples=SAMPLES, threshold=st.integers(0, 20), duration=st.integers(0, 3))
def test_wake_up_agrees_with_oracle(samples: list[Sample], threshold: int, duration: int) -> None:
    limit = threshold * 2000 / 64 + 0.1  # levels are rounded to 0.061 mg, thresholds are not
    over = [[abs(value) > limit for value in slope] for slope in slopes(samples)]
    lasts = lasting([any(axes) for axes in over], duration)

    bits = source_bits(WAKE_UP_SRC, samples, (WAKE_UP_THS, threshold), (WAKE_UP_DUR, duration << 5))

    expected = [0x08 | x << 2 | y << 1 | z if on else 0 for (x, y, z), on in zip(over, lasts, strict=True)]
    assert [value & 0x0F for value in bits] == expected


@given(
    runs=st.lists(st.tuples(st.integers(0, 7), st.integers(1, 4)), min_size=1, max_size=12),
    flat=st.booleans(),
)
def test_orientation_agrees_with_oracle(runs: list[tuple[int, int]], flat: bool) -> None:
    axes = [(1000.0 * (code % 2 or -1) * (code // 2 == axis) for axis in range(3)) for code, _ in runs]
    samples: list[Sample] = []
    for (x, y, z), (_, count) in zip(map(tuple, axes), runs, strict=True):
        samples += [(x, y, z)] * count  # the last two codes are weightlessness
    seen = [_position(sample, flat) for sample in samples]
    expected, position = [], 0
    for before, now in zip([0, *seen], seen, strict=False):
        changed = now != 0 and now == before and now != position
        position = now if changed else position
        expected.append((0x40 if changed else 0) | position)

    assert source_bits(D6D_SRC, samples, (TAP_THS_6D, 0x40 | flat << 7)) == expected


def _position(sample: Sample, flat: bool) -> int:
    highs = [value > 500 for value in sample]
    lows = [value < -500 for value in sample]
    bits = {(0, 1): 0x02, (0, 0): 0x01, (1, 1): 0x08, (1, 0): 0x04, (2, 1): 0x20, (2, 0): 0x10}
    for axis in range(2 if flat else 3):
        if highs[axis] or lows[axis]:
            return bits[axis, int(highs[axis])]
    return 0


class Windows(NamedTuple):
    """The time windows of INT_DUR2 in samples."""

    shock: int
    quiet: int
    gap: int

    @classmethod
    def of(cls, register: int) -> Windows:
        shock, quiet, dur = register & 3, register >> 2 & 3, register >> 4
        return cls(8 * shock if shock else 4, 4 * quiet if quiet else 2, 32 * dur if dur else 16)


def taps(over: list[bool], windows: Windows, *, double: bool) -> list[str]:
    """Return TAP_SRC at each sample, from a search of the whole run for threshold crossings."""
    shown = [""] * len(over)
    crossings = [n for n in range(len(over)) if over[n] and (n == 0 or not over[n - 1])]

    def falls_back(start: int) -> int:
        return next((n for n in range(start, len(over)) if not over[n]), len(over))

    def show(first: int, what: str) -> None:
        for n in range(first, min(first + windows.quiet, len(over))):
            shown[n] = what

    free_from = 0
    for start in crossings:
        if start < free_from:
            continue
        end = falls_back(start)
        if end - start > windows.shock or end == len(over):
            free_from = end
            continue
        show(end, "single")
        free_from = end + windows.quiet
        second = next((n for n in crossings if n >= free_from), len(over))
        if not double or second >= free_from + windows.gap:
            continue
        second_end = falls_back(second)
        free_from = second_end
        if second_end - second <= windows.shock and second_end < len(over):
            show(second_end, "double")
            free_from = second_end + windows.quiet
    return shown


@given(bursts=BURSTS, quiet=st.lists(st.integers(1, 40)), register=st.integers(0, 0x3F), double=st.booleans())
def test_tap_agrees_with_oracle(
    bursts: list[tuple[bool, int]], quiet: list[int], register: int, double: bool
) -> None:
    over: list[bool] = [False]
    for number, (strong, count) in enumerate(bursts):
        over += [strong] * count
        over += [False] * (quiet[number] if number < len(quiet) else 0)
    samples: list[Sample] = []
    high = False
    for strong in over:
        high ^= strong  # there and back again, so that it fits the range
        samples.append((0.0, 800.0 * high, 0.0))

    bits = source_bits(
        TAP_SRC,
        samples,
        (TAP_CFG, 0x04),
        (TAP_THS_6D, 4),
        (INT_DUR2, register),
        (WAKE_UP_THS, double << 7),
    )

    names = {0x00: "", 0x20: "single", 0x10: "double"}
    assert [names[value & 0x30] for value in bits] == taps(over, Windows.of(register), double=double)


RUN = 120
LOOKS = st.lists(
    st.tuples(st.integers(1, sample_ps(RUN) - 1), st.sampled_from((0x1E, 0x22, 0x28, 0x2A, 0x12))),
    max_size=15,
)


@given(
    samples=SAMPLES,
    looks=LOOKS,
    inact=st.integers(0, 3),
    routes=st.tuples(st.integers(0, 0xFC), st.integers(0, 0xFC)),
    ctrl8=st.sampled_from((0x00, 0x08, 0xE1, 0x45)),
)
def test_pins_do_not_depend_on_reads(
    samples: list[Sample], looks: list[tuple[int, int]], inact: int, routes: tuple[int, int], ctrl8: int
) -> None:
    """Without latching, reads change neither the edges nor the samples."""

    def bench() -> Bench:
        return Bench(
            samples,
            (DRDY_PULSE_CFG, 0x80),
            (INT1_CTRL, 0x01),
            (INT2_CTRL, 0x04),
            (MD1_CFG, routes[0]),
            (MD2_CFG, routes[1]),
            (CTRL8_XL, ctrl8),
            (TAP_THS_6D, 0x41),
            (WAKE_UP_THS, 0x81),
            (TAP_CFG, ENABLE | inact << 5 | 0x0E),
        )

    watched, alone = bench(), bench()
    for t_ps, address in sorted(looks):
        watched.t_ps = t_ps
        watched.read(address, 3)
    watched.at(RUN)
    alone.at(RUN)

    assert watched.look() == alone.look()
    assert watched.read(0x28, 6) == alone.read(0x28, 6)
    assert watched.read(0x1B, 3) == alone.read(0x1B, 3)


@given(samples=SAMPLES, routes=st.tuples(st.integers(0, 0xFC), st.integers(0, 0xFC)))
def test_pin_edges_are_in_order_and_on_time(samples: list[Sample], routes: tuple[int, int]) -> None:
    """Called at each ``next_event_ps``, the sensor reports each edge at its time."""
    writes = (MD1_CFG, routes[0]), (MD2_CFG, routes[1]), (TAP_THS_6D, 0x41), (TAP_CFG, ENABLE | 0x0E)
    late, woken = Bench(samples, *writes, (INT1_CTRL, 0x01)), Bench(samples, *writes, (INT1_CTRL, 0x01))
    punctual: list[Edge] = []
    while woken.part.next_event_ps() <= sample_ps(RUN):
        woken.t_ps = woken.part.next_event_ps()
        known = len(woken.edges)
        punctual += [edge for edge in woken.look()[known:] if edge[1] == woken.t_ps]
    late.at(RUN)

    assert punctual == late.look()
    assert [at_ps for _, at_ps, _ in punctual] == sorted(at_ps for _, at_ps, _ in punctual)
