"""Samples at an output data rate, and the registers that show the latest sample.

Times are integers computed from the index, so 6664 Hz is exact even after an hour. A value is a pure function of sample
number, configuration and world. Sample numbers continue after a restart, so that each one-shot measurement has
different noise.

A sample is written to the registers when firmware reads them. A read of any high byte clears data-ready. With BDU, a
word does not change between the reads of its two bytes (AN5040 4.3-4.5, AN5069 6.3-6.5).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from fractions import Fraction
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from fcu_emulator.sensors.register import Register
from fcu_emulator.sensors.register_file import NEVER_PS, BurstReader, RegisterFile
from fcu_emulator.sensors.shared_registers import AHEAD, bit, new_train

PS_PER_S = 10**12

Times: TypeAlias = NDArray[np.float64]
"""Sample times in seconds of virtual time, shape (n,)."""

Producer: TypeAlias = Callable[[int, Times], bytes]
"""``produce(number, t_s)``: returns register bytes of the samples at ``t_s``; the first sample is sample ``number``."""

Stamp: TypeAlias = Callable[[int, bytes], bytes]
"""``stamp(number, data)``: returns the samples' register bytes ``data``, changed if needed."""

_SMALLEST_BLOCK = 32
_LARGEST_BLOCK = 4096


class SampleStream:
    """The samples of one channel group.

    ``next_ps``: time of the next sample; ``data``: register bytes of the latest sample; ``index``: the latest
    sample's number, or -1; ``raster_ps``: a time in phase with all samples; ``settled_number``: first
    sample after settling.
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
        self._earlier = 0  # number of samples before the latest start
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
        """Start sampling, after ``first_delay_ps`` (default: one period)."""
        period = PS_PER_S / rate_hz
        delay = -(-period.numerator // period.denominator) if first_delay_ps is None else first_delay_ps
        self._begin(now_ps + delay, period.numerator, period.denominator)
        self._block_length = _SMALLEST_BLOCK

    def start_in_step(self, other: SampleStream, now_ps: int, rate_hz: Fraction) -> None:
        """Start in phase with ``other``, whose rate is a multiple or fraction of ``rate_hz``."""
        period = PS_PER_S / rate_hz
        num, den = period.numerator, period.denominator
        periods = 1 - (other.raster_ps - now_ps) * den // num
        self._begin(other.raster_ps - (-periods * num // den), num, den)
        self._origin_ps, self._origin_index = other.raster_ps, -periods
        self.raster_ps = other.raster_ps
        self._block_length = _SMALLEST_BLOCK

    def start_single(self, now_ps: int, delay_ps: int) -> None:
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
        """Stop; ``data`` keeps the latest sample, as in power-down."""
        self.next_ps = NEVER_PS

    @property
    def running(self) -> bool:
        return self.next_ps != NEVER_PS

    @property
    def rate_hz(self) -> Fraction:
        """Samples per second; 0 when stopped."""
        return Fraction(PS_PER_S * self._den, self._num) if self.running else Fraction(0)

    def stamp_with(self, stamp: Stamp) -> None:
        """Call ``stamp`` for every block of samples from now on."""
        produce = self._produce

        def produce_stamped(number: int, t_s: Times) -> bytes:
            return stamp(number, produce(number, t_s))

        self._produce = produce_stamped
        self.invalidate()

    def invalidate(self) -> None:
        """Discard samples computed ahead."""
        self._block_end = self._block_first
        self._block_length = min(self._block_length, _SMALLEST_BLOCK)

    def world_changed(self, now_ps: int | None) -> None:
        """Discard samples after ``now_ps``, by default all samples after the latest sample taken."""
        number = self.next_number(now_ps)
        for forget in self._forgetting:
            forget(number)
        self.invalidate()

    def when_world_changes(self, forget: Callable[[int], None]) -> None:
        """Call ``forget(number)`` when the samples from ``number`` on become invalid."""
        self._forgetting.append(forget)

    def time_ps(self, index: int) -> int:
        """Return when sample ``index`` becomes available."""
        return self._origin_ps - (-(index - self._origin_index) * self._num // self._den)

    def advance(self, now_ps: int) -> int:
        """Make the latest sample current and return the number of new samples."""
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

    def ahead(self, count: int) -> tuple[bytes, list[int]]:
        """Return at most ``count`` computed samples after the current one, and their times.

        The final time belongs to the first sample that is not returned.
        """
        if not self.running:
            return b"", [NEVER_PS]
        first = self.index + 1
        end = min(first + count, self._block_end) if self._block_first <= first < self._block_end else first
        offset, width = first - self._block_first, self._width
        samples = self._block[offset * width : (offset + end - first) * width]
        origin_ps, num, den = self._origin_ps, self._num, self._den
        spans = range(first - self._origin_index, end + 1 - self._origin_index)
        return samples, [origin_ps - (-span * num // den) for span in spans]

    def samples(self, first: int, end: int) -> NDArray[np.uint8]:
        """Return register bytes of due samples, shape (n, width)."""
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
        """Return the index of the latest sample at ``at_ps``, or -1."""
        return max(-1, self._origin_index + (at_ps - self._origin_ps) * self._den // self._num)

    def _fill(self, first: int) -> None:
        # The origin moves by whole multiples of ``_num``, which are exact. Small numbers keep Python's
        # integers fast.
        spans = (first - self._origin_index) // self._den
        self._origin_ps += spans * self._num
        self._origin_index += spans * self._den
        count = self._block_length
        if count > 1:
            self._block_length = min(2 * count, _LARGEST_BLOCK)
        self._block = self._produce(self._earlier + first, self._times_s(first, count))
        self._block_first, self._block_end = first, first + count

    def times_s(self, number: int, count: int) -> Times:
        return self._times_s(number - self._earlier, count)

    @property
    def settled_index(self) -> int:
        """Index of the first sample after settling."""
        return self.settled_number - self._earlier

    def number(self, index: int) -> int:
        return self._earlier + index

    def next_number(self, now_ps: int | None = None) -> int:
        """Return the number of the next sample after ``now_ps``, as passed to ``produce``."""
        if now_ps is None or not self.running:
            return self._earlier + self.index + 1
        return self._earlier + self.latest(now_ps) + 1

    def _times_s(self, first: int, count: int) -> Times:
        # Times are rounded from exact integers, so that they do not depend on the start of the block.
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
    """Round counts, and limit them to the range of 16 bits."""
    return _whole(counts).astype("<i2")


def words(counts: NDArray[np.float64], samples: int | None = None) -> bytes:
    """Return register bytes of counts (3, n), or of one column for all ``samples``."""
    in_turn = np.empty(counts.shape[::-1], dtype="<i2")
    np.copyto(in_turn, _whole(counts).T, casting="unsafe")
    data = in_turn.tobytes()
    return data if samples is None or samples == counts.shape[1] else data * samples


def _whole(counts: NDArray[np.float64]) -> NDArray[np.float64]:
    whole = np.rint(counts)
    np.minimum(whole, 32767, out=whole)
    return np.maximum(whole, -32768, out=whole)


# -- output registers -----------------------------------------------------------------------------------


@dataclass(frozen=True)
class DataReady:
    """Flags of an output block.

    ``words``: one flag per word; ``any``: flag that a read of any high byte clears; ``overrun_shift``: distance in bits
    to the overrun flag, or 0.
    """

    status: type[Register]
    words: tuple[int, ...]
    any: int
    overrun_shift: int = 0

    def all(self) -> int:
        """Return all flags except the overrun flags."""
        mask = self.any
        for flag in self.words:
            mask |= flag
        return mask

    def keep(self) -> bytes:
        """Return, for each output byte, the status bits that a read of this byte does not clear."""
        masks = bytearray()
        for flag in self.words:
            cleared = flag | self.any
            masks += bytes((0xFF, 0xFF & ~(cleared | cleared << self.overrun_shift)))
        return bytes(masks)


def swap_bytes(words: bytes) -> bytes:
    """Exchange the bytes of 16-bit words."""
    swapped = bytearray(words)
    swapped[0::2], swapped[1::2] = words[1::2], words[0::2]
    return bytes(swapped)


class OutputWords:
    """Block of 16-bit words fed by a stream; ``after_sample(count)`` is called after new samples.

    ``one_by_one``: Python must process each new sample, because ``after_sample`` has effects.
    """

    __slots__ = (
        "_after_sample",
        "_all",
        "_bdu",
        "_big_endian",
        "_end",
        "_first",
        "_held",
        "_keep",
        "_keep_all",
        "_lent",
        "_mem",
        "_overrun_shift",
        "_registers",
        "_shown",
        "_status",
        "_train_bytes",
        "_unread",
        "_version",
        "one_by_one",
        "stream",
        "train",
    )

    def __init__(
        self,
        registers: RegisterFile,
        register: type[Register],
        stream: SampleStream,
        flags: DataReady | None,
        after_sample: Callable[[int], None] | None = None,
    ) -> None:
        self._registers = registers
        self._mem = registers.mem
        self._first, self._end = register.addr, register.addr + register.size
        self._status = flags.status.addr if flags else 0
        self._all = flags.all() if flags else 0
        self._overrun_shift = flags.overrun_shift if flags else 0
        self._keep = flags.keep() if flags else b"\xff" * register.size
        self._unread = self._all | (self._all << self._overrun_shift)
        self._keep_all = 0xFF & ~self._unread
        self._after_sample = after_sample
        self.stream = stream
        self._bdu = self._big_endian = self._lent = self.one_by_one = False
        self._held = registers.held
        self._version = registers.version
        self._shown = b""
        self._train_bytes, self.train = new_train(self._first, self._keep)
        train = self.train
        train.status, train.flags, train.overrun_shift = self._status, self._all, self._overrun_shift
        registers.before_read(register, self.before_read)
        registers.add_output(self, (register, self.before_read, None))

    def set_format(self, *, bdu: bool, big_endian: bool) -> None:
        """Set BDU and BLE; if BDU is off, every held word is released."""
        if big_endian != self._big_endian:
            self._shown = b""
        if bdu != self._bdu:
            first, width = self._first, self._end - self._first
            holds = [bit(first + n) if bdu else 0 for n in range(width)]
            self.train.set_effects(holds, [holds[n ^ 1] for n in range(width)])
        self._bdu, self._big_endian = bdu, big_endian
        if not bdu:
            self._held[0] = 0

    def reset(self) -> None:
        """Make the words read 0 until the next sample."""
        self.stream.data = bytes(self._end - self._first)

    def refresh(self, now_ps: int) -> None:
        if now_ps < self.stream.next_ps:
            return
        if self._lent:
            self.take_back()
        fresh = self.stream.advance(now_ps)
        if not fresh:
            return
        mem = self._mem
        if self._overrun_shift:
            unread = self._all if fresh > 1 else mem[self._status] & self._all
            mem[self._status] |= unread << self._overrun_shift
        mem[self._status] |= self._all
        if self._held[0]:
            self._show()
        if self._after_sample is not None:
            self._after_sample(fresh)

    def before_read(self, first: int, end: int, now_ps: int) -> bytes | None:
        """Refresh the registers and apply the effects of the read. A read of the whole block returns the sample."""
        stream = self.stream
        if now_ps >= stream.next_ps:
            self.refresh(now_ps)
        if first == self._first and end == self._end and not (self._held[0] or self._big_endian):
            self._mem[self._status] &= self._keep_all
            return stream.data
        if self._shown is not stream.data:
            self._show()
        while first < end:  # usually one pass; a range would take twice as long
            self._account(first)
            first += 1
        return None

    def fill(self, now_ps: int) -> None:
        """Put the current and next samples into the shared train."""
        self.refresh(now_ps)
        stream = self.stream
        samples, times_ps = stream.ahead(0 if self.one_by_one else AHEAD)
        samples = stream.data + samples
        if self._big_endian:
            samples = swap_bytes(samples)
        self.train.fill(self._version[0], samples, times_ps, stale=self._shown is not stream.data)
        self._lent = True

    def take_back(self) -> None:
        """End the train, and continue after the samples that were taken from it."""
        if not self._lent:
            return
        self._lent = False
        taken = self.train.take_back()
        if taken:
            self.stream.advance(self.stream.time_ps(self.stream.index + taken))

    def burst_reader(self, first: int, end: int) -> BurstReader | None:
        return self._read_burst if (first, end) == (self._first, self._end) else None

    def _read_burst(self, now_ps: int) -> tuple[bytes, int]:
        """Do the same as ``before_read``, but skip flags that would be set and then cleared."""
        if self._held[0] or self._big_endian:
            return self._registers.read(self._first, self._end - self._first, now_ps), 0
        stream = self.stream
        if now_ps >= stream.next_ps:
            if self._lent:
                self.take_back()
            fresh = stream.advance(now_ps)
            if self._after_sample is not None and fresh:
                self._after_sample(fresh)
        self._mem[self._status] &= self._keep_all
        return stream.data, stream.next_ps

    def _show(self) -> None:
        data = self.stream.data
        if not self._held[0]:
            self._mem[self._first : self._end] = swap_bytes(data) if self._big_endian else data
            self._shown = data
            return
        self._shown = b""  # held words have not been updated, so the next read must refresh them again
        words = swap_bytes(data) if self._big_endian else data
        for offset in range(0, len(data), 2):
            word = self._first + offset
            if not self._held[0] & (bit(word) | bit(word + 1)):
                self._mem[word : word + 2] = words[offset : offset + 2]

    def _account(self, address: int) -> None:
        offset = address - self._first
        self._mem[self._status] &= self._keep[offset]
        if self._bdu:
            self._version[0] += 1
            partner = bit(self._first + (offset ^ 1))
            if self._held[0] & partner:
                self._held[0] &= ~partner
            else:
                self._held[0] |= bit(address)
