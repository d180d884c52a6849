"""Output registers of several 16-bit words: data-ready, overrun, block data update and byte order.

The parts share the rules (LSM6DSL application note AN5040 4.3-4.5, LIS2MDL AN5069 6.3-6.5):

* a new sample sets the data-ready flags; reading any one high byte clears them;
* with BDU set, a word of which one byte has been read keeps its value until its other byte is read too; words
  are independent. Once released it shows the latest sample at once;
* BLE swaps the two bytes of every word.

Samples are not pushed into the registers when they are taken but fetched when somebody looks: the result is
the same, and a sensor nobody reads costs nothing.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from sensors.register import Register
from sensors.register_file import NOTHING_PREFETCHED, BurstReader, Prefetched, RegisterFile, every_length
from sensors.sampling import SampleStream


@dataclass(frozen=True)
class DataReady:
    """The flags of an output block in its status register.

    ``words``: the flag of each word (the same for all where the part has only one); ``any``: the one that
    every high byte clears. ``overrun_shift``: how far above a flag its overrun flag lies, 0 if there is none.
    """

    status: type[Register]
    words: tuple[int, ...]
    any: int
    overrun_shift: int = 0

    def all(self) -> int:
        """Every flag, without the overrun flags."""
        mask = self.any
        for flag in self.words:
            mask |= flag
        return mask

    def keep(self) -> bytes:
        """What the status register keeps when a byte is read, for each byte: a low one clears nothing."""
        masks = bytearray()
        for flag in self.words:
            cleared = flag | self.any
            masks += bytes((0xFF, 0xFF & ~(cleared | cleared << self.overrun_shift)))
        return bytes(masks)


def swap_bytes(words: bytes) -> bytes:
    """16-bit words with their two bytes exchanged."""
    swapped = bytearray(words)
    swapped[0::2], swapped[1::2] = words[1::2], words[0::2]
    return bytes(swapped)


_EVEN = 0x5555_5555_5555_5554  # the bits of even lengths


class OutputWords:
    """A block of 16-bit words fed by a stream; ``after_sample()`` follows each look at a new sample."""

    __slots__ = (
        "_after_sample",
        "_all",
        "_bdu",
        "_big_endian",
        "_end",
        "_first",
        "_half_read",
        "_keep",
        "_keep_all",
        "_mem",
        "_overrun_shift",
        "_registers",
        "_shown",
        "_status",
        "_unread",
        "_version",
        "stream",
    )

    def __init__(
        self,
        registers: RegisterFile,
        register: type[Register],
        stream: SampleStream,
        flags: DataReady | None,
        after_sample: Callable[[], None] | None = None,
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
        self._bdu = self._big_endian = False
        self._half_read = registers.half_read
        self._version = registers.version
        self._shown = b""
        registers.before_read(register, self.before_read)
        registers.set_prefetcher(register, self, self.before_read)

    def set_format(self, *, bdu: bool, big_endian: bool) -> None:
        """BDU and BLE as configured; switching BDU off releases every word, BLE turns those not held."""
        if big_endian != self._big_endian:
            self._shown = b""
        self._bdu, self._big_endian = bdu, big_endian
        if not bdu:
            self._half_read.clear()

    def reset(self) -> None:
        """Forget the latest sample: the words read 0 until the next one."""
        self.stream.data = bytes(self._end - self._first)

    def refresh(self, now_ps: int) -> None:
        """Bring the registers up to date with the latest sample at ``now_ps``."""
        stream = self.stream
        if now_ps < stream.next_ps:
            return
        fresh = stream.advance(now_ps)
        mem = self._mem
        if self._overrun_shift:
            unread = self._all if fresh > 1 else mem[self._status] & self._all
            mem[self._status] |= unread << self._overrun_shift
        mem[self._status] |= self._all
        if self._half_read:
            self._show()
        if self._after_sample is not None:
            self._after_sample()

    def before_read(self, first: int, end: int, now_ps: int) -> bytes | None:
        """The read hook: refresh, then account for what is about to be read.

        The usual read takes the whole block at once; it gets the sample itself, and the registers are filled
        in only when somebody reads a part of them.
        """
        stream = self.stream
        if now_ps >= stream.next_ps:
            self.refresh(now_ps)
        if first == self._first and end == self._end and not (self._half_read or self._big_endian):
            self._mem[self._status] &= self._keep_all
            return stream.data
        if self._shown is not stream.data:
            self._show()
        while first < end:  # mostly once, and then half the price of a range
            self._account(first)
            first += 1
        return None

    def prefetch(self, first: int, end: int, now_ps: int) -> Prefetched:
        """The bytes as they are until the next sample, words that are held back among them.

        Reading them is quiet once data-ready has been cleared, and with BDU as long as whole words are read.
        """
        stream = self.stream
        if now_ps >= stream.next_ps:
            self.refresh(now_ps)
        if self._shown is not stream.data:
            self._show()
            if any((held - self._first) & 1 and first < held < end for held in self._half_read):
                return NOTHING_PREFETCHED  # its first byte releases the word, its second is of the new sample
        quiet = 0
        if not (self._half_read or self._mem[self._status] & self._unread):
            quiet = every_length(end - first)
            if self._bdu:
                quiet &= 0 if (first - self._first) & 1 else _EVEN
        return bytes(self._mem[first:end]), stream.next_ps, quiet

    def valid_until_ps(self, first: int, end: int) -> int:
        """Until the next sample: what reading clears has been cleared, and holding words is a new version."""
        del first, end
        return self.stream.next_ps

    def burst_reader(self, first: int, end: int) -> BurstReader | None:
        """For the usual read, which takes the whole block at once."""
        return self._read_burst if (first, end) == (self._first, self._end) else None

    def _read_burst(self, now_ps: int) -> tuple[bytes, int]:
        """As ``before_read``, less the flags that a new sample would set and this read clear."""
        if self._half_read or self._big_endian:
            return self._registers.read(self._first, self._end - self._first, now_ps), 0
        stream = self.stream
        if now_ps >= stream.next_ps:
            stream.advance(now_ps)
            if self._after_sample is not None:
                self._after_sample()
        self._mem[self._status] &= self._keep_all
        return stream.data, stream.next_ps

    def consumed(self, first: int, count: int) -> None:
        """So many bytes from ``first`` on have been read one by one."""
        offset = first - self._first
        if self._half_read or (offset | count) & 1:
            for address in range(first, first + count):
                self._account(address)
            return
        kept = 0xFF  # whole words: none is held
        for keep in self._keep[offset : offset + count]:
            kept &= keep
        self._mem[self._status] &= kept

    def _show(self) -> None:
        data = self.stream.data
        if not self._half_read:
            self._mem[self._first : self._end] = swap_bytes(data) if self._big_endian else data
            self._shown = data
            return
        self._shown = b""  # some words stay behind: look again at the next read
        words = swap_bytes(data) if self._big_endian else data
        for offset in range(0, len(data), 2):
            word = self._first + offset
            if word not in self._half_read and word + 1 not in self._half_read:
                self._mem[word : word + 2] = words[offset : offset + 2]

    def _account(self, address: int) -> None:
        """A byte is about to be read: clear its flags; hold its word until the other byte is read, too."""
        offset = address - self._first
        self._mem[self._status] &= self._keep[offset]
        if self._bdu:
            partner = self._first + (offset ^ 1)
            self._version[0] += 1
            if partner in self._half_read:
                self._half_read.discard(partner)
            else:
                self._half_read.add(address)
