"""Samples at an output data rate: which one is the latest at a given time, and what it holds.

Sample ``k`` (0, 1, 2 ...) of a stream becomes available ``first_delay_ps`` plus ``k`` periods after the
stream was started. Times are integers computed from ``k``, never added up, so a rate of 6664 Hz is still
exact after an hour. Sample values are a pure function of the sample's number, the configuration and the
world; they are computed in blocks ahead of time and only cached here, so it does not matter who reads when.
The number a producer sees goes on counting over restarts, so that two one-shot measurements do not get the
same noise.
"""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

PS_PER_S = 10**12
NEVER_PS = 1 << 62  # later than any run; an int, so that the hot comparison stays one of integers

Times: TypeAlias = NDArray[np.float64]
"""Sample times in seconds of virtual time, shape (n,)."""

Producer: TypeAlias = Callable[[int, Times], bytes]
"""``produce(number, t_s)``: the register bytes of the samples ``number`` and following, taken at ``t_s``."""

Stamp: TypeAlias = Callable[[int, bytes], bytes]
"""``stamp(number, data)``: the bytes of the samples ``number`` and following, changed as needed."""

_SMALLEST_BLOCK = 32
_LARGEST_BLOCK = 4096


class SampleStream:
    """The samples of one channel group. Attributes are plain because every register read looks at them.

    ``next_ps``: when the next sample becomes available (``NEVER_PS`` when stopped);
    ``data``: the register bytes of the latest sample; ``index``: its number, -1 before the first;
    ``raster_ps``: one time that is a whole number of periods from every sample;
    ``settled_number``: the producer's number of the first sample that need not be discarded.
    """

    __slots__ = (
        "_block",
        "_block_end",
        "_block_first",
        "_block_length",
        "_den",
        "_earlier",
        "_forgetting",
        "_num",
        "_origin_index",
        "_origin_ps",
        "_produce",
        "_width",
        "data",
        "index",
        "next_ps",
        "raster_ps",
        "settled_number",
    )

    def __init__(self, width: int, produce: Producer) -> None:
        self._width = width
        self._produce: Producer = produce
        self._num, self._den = 1, 1
        self._earlier = 0  # samples of the runs before this one
        self._forgetting: list[Callable[[int], None]] = []
        self._origin_ps = 0  # the time of sample ``_origin_index``
        self._origin_index = 0
        self._block = b""
        self._block_first = self._block_end = 0
        self._block_length = _SMALLEST_BLOCK
        self.data = bytes(width)
        self.index = -1
        self.next_ps = NEVER_PS
        self.raster_ps = 0
        self.settled_number = 0

    def start(self, now_ps: int, rate_hz: Fraction, first_delay_ps: int | None = None) -> None:
        """Begin sampling at ``rate_hz``; the first sample comes after ``first_delay_ps`` (one period)."""
        period = PS_PER_S / rate_hz
        delay = -(-period.numerator // period.denominator) if first_delay_ps is None else first_delay_ps
        self._begin(now_ps + delay, period.numerator, period.denominator)
        self._block_length = _SMALLEST_BLOCK

    def start_in_step(self, other: SampleStream, now_ps: int, rate_hz: Fraction) -> None:
        """Begin sampling in step with a stream whose rate is a multiple of ``rate_hz``, or a whole part.

        The first sample comes one to two periods after ``now_ps``.
        """
        period = PS_PER_S / rate_hz
        num, den = period.numerator, period.denominator
        periods = 1 - (other.raster_ps - now_ps) * den // num
        self._begin(other.raster_ps - (-periods * num // den), num, den)
        self._origin_ps, self._origin_index = other.raster_ps, -periods
        self.raster_ps = other.raster_ps
        self._block_length = _SMALLEST_BLOCK

    def start_single(self, now_ps: int, delay_ps: int) -> None:
        """Take one sample, available after ``delay_ps``, and no other."""
        self._begin(now_ps + delay_ps, NEVER_PS, 1)
        self._block_length = 1

    def _begin(self, first_ps: int, period_num: int, period_den: int) -> None:
        self._num, self._den = period_num, period_den
        self._origin_ps = self.next_ps = self.raster_ps = first_ps
        self._origin_index = 0
        self._earlier += self.index + 1
        self.index = -1
        self._block_end = self._block_first

    def stop(self) -> None:
        """Stop sampling; ``data`` keeps the last sample, as the output registers do in power-down."""
        self.next_ps = NEVER_PS

    @property
    def running(self) -> bool:
        """Whether samples are still to come."""
        return self.next_ps != NEVER_PS

    @property
    def rate_hz(self) -> Fraction:
        """Samples per second; 0 when stopped."""
        return Fraction(PS_PER_S * self._den, self._num) if self.running else Fraction(0)

    def stamp_with(self, stamp: Stamp) -> None:
        """From now on every block goes through ``stamp(number, data)`` once it has been produced."""
        produce = self._produce

        def produce_stamped(number: int, t_s: Times) -> bytes:
            return stamp(number, produce(number, t_s))

        self._produce = produce_stamped
        self.invalidate()

    def invalidate(self) -> None:
        """The world or the configuration has changed: samples still to come are computed anew."""
        self._block_end = self._block_first
        self._block_length = min(self._block_length, _SMALLEST_BLOCK)

    def world_changed(self, now_ps: int | None) -> None:
        """The signals are others from ``now_ps`` on, or from the next sample on that nobody has looked at."""
        number = self.next_number(now_ps)
        for forget in self._forgetting:
            forget(number)
        self.invalidate()

    def when_world_changes(self, forget: Callable[[int], None]) -> None:
        """Call ``forget(number)``: what was computed ahead of the samples from ``number`` on is wrong."""
        self._forgetting.append(forget)

    def time_ps(self, index: int) -> int:
        """When sample ``index`` becomes available."""
        return self._origin_ps - (-(index - self._origin_index) * self._num // self._den)

    def advance(self, now_ps: int) -> int:
        """Make the latest sample at ``now_ps`` current; the number of samples since the one before.

        Only to be called when ``now_ps >= next_ps``.
        """
        num = self._num
        index, passed = divmod((now_ps - self._origin_ps) * self._den, num)
        self.next_ps = now_ps - (passed - num) // self._den  # origin + (index + 1) periods, rounded up
        index += self._origin_index
        fresh = index - self.index
        self.index = index
        if not self._block_first <= index < self._block_end:
            self._fill(index)
        offset = (index - self._block_first) * self._width
        self.data = self._block[offset : offset + self._width]
        return fresh

    def samples(self, first: int, end: int) -> NDArray[np.uint8]:
        """Register bytes of samples ``first`` to ``end - 1``, shape (n, width); all must be due already.

        For functions that look at every sample (FIFO, event detection). Reading on from where the last call
        ended costs no sample twice.
        """
        pieces = []
        while first < end:
            if not self._block_first <= first < self._block_end:
                self._fill(first)
            stop = min(end, self._block_end)
            offset = (first - self._block_first) * self._width
            count = stop - first
            block = np.frombuffer(self._block, dtype=np.uint8, count=count * self._width, offset=offset)
            pieces.append(block.reshape(count, self._width))
            first = stop
        return np.concatenate(pieces) if pieces else np.empty((0, self._width), dtype=np.uint8)

    def latest(self, at_ps: int) -> int:
        """Number of the latest sample at ``at_ps``, -1 if there is none yet; nothing changes."""
        return max(-1, self._origin_index + (at_ps - self._origin_ps) * self._den // self._num)

    def _fill(self, first: int) -> None:
        """Compute a block from sample ``first`` on; blocks grow while nothing invalidates them."""
        # Move the origin on by whole multiples of ``_num`` (``_den`` samples each): exact, and the numbers in
        # ``advance`` stay small, where Python's integers are fast.
        spans = (first - self._origin_index) // self._den
        self._origin_ps += spans * self._num
        self._origin_index += spans * self._den
        count = self._block_length
        if count > 1:
            self._block_length = min(2 * count, _LARGEST_BLOCK)
        self._block = self._produce(self._earlier + first, self._times_s(first, count))
        self._block_first, self._block_end = first, first + count

    def times_s(self, number: int, count: int) -> Times:
        """When the samples ``number`` and following come, as the producer counts; of the present run only."""
        return self._times_s(number - self._earlier, count)

    @property
    def settled_index(self) -> int:
        """The first sample of the present run that need not be discarded."""
        return self.settled_number - self._earlier

    def number(self, index: int) -> int:
        """The producer's number of sample ``index`` of the present run."""
        return self._earlier + index

    def next_number(self, now_ps: int | None = None) -> int:
        """The producer's number of the first sample after ``now_ps``, or after the latest one looked at."""
        if now_ps is None or not self.running:
            return self._earlier + self.index + 1
        return self._earlier + self.latest(now_ps) + 1

    def _times_s(self, first: int, count: int) -> Times:
        # Each time is rounded from its own exact parts, so that it does not depend on where the block begins.
        period_s = self._num / (self._den * PS_PER_S)
        offset = first - self._origin_index
        rest = np.arange(offset, offset + count, dtype=np.int64)
        spans_on = rest // self._den
        rest -= spans_on * self._den
        times: Times = np.multiply(rest, period_s, dtype=np.float64)
        spans_on *= self._num
        spans_on += self._origin_ps
        times += spans_on / PS_PER_S
        return times


# -- counts in register bytes -------------------------------------------------------------------------------


def to_int16(counts: NDArray[np.float64]) -> NDArray[np.int16]:
    """Rounded to the nearest count and saturated at the ends of 16 bits, the shape unchanged."""
    return _whole(counts).astype("<i2")


def words(counts: NDArray[np.float64], samples: int | None = None) -> bytes:
    """Register bytes of axis-major counts, shape (3, n): little-endian X, Y, Z of each sample in turn.

    ``samples``: how many, where one column may stand for all of them.
    """
    in_turn = np.empty(counts.shape[::-1], dtype="<i2")
    np.copyto(in_turn, _whole(counts).T, casting="unsafe")
    data = in_turn.tobytes()
    return data if samples is None or samples == counts.shape[1] else data * samples


def _whole(counts: NDArray[np.float64]) -> NDArray[np.float64]:
    whole = np.rint(counts)
    np.minimum(whole, 32767, out=whole)
    return np.maximum(whole, -32768, out=whole)
