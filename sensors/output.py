"""Output registers of several 16-bit words: data-ready, block data update and byte order.

All three parts share the rules (LSM6DSL application note AN5040 4.3-4.5, LIS2MDL AN5069 6.3-6.5):

* a new sample sets the data-ready flag; reading any one high byte clears it;
* with BDU set, a word of which one byte has been read keeps its value until its other byte is read too; words
  are independent. Once released it shows the latest sample at once;
* BLE swaps the two bytes of every word.

Samples are not pushed into the registers when they are taken but fetched when somebody looks: the result is the
same, and a sensor nobody reads costs nothing.
"""

from __future__ import annotations

from collections.abc import Callable

from sensors.register import Register
from sensors.register_file import RegisterFile
from sensors.sampling import SampleStream


def swap_bytes(words: bytes) -> bytes:
    """16-bit words with their two bytes exchanged."""
    swapped = bytearray(words)
    swapped[0::2], swapped[1::2] = words[1::2], words[0::2]
    return bytes(swapped)


class OutputWords:
    """A block of 16-bit output words fed by a stream.

    ``on_sample(count)`` is called when ``count`` new samples have come since the last look (sets the data-ready
    flag); ``on_high_read(first, end)`` when a high byte has been read (clears it).
    """

    __slots__ = (
        "_end",
        "_first",
        "_half_read",
        "_mem",
        "_on_high_read",
        "_on_sample",
        "_shown",
        "bdu",
        "big_endian",
        "stream",
    )

    def __init__(
        self,
        registers: RegisterFile,
        register: type[Register],
        stream: SampleStream,
        on_sample: Callable[[int], None],
        on_high_read: Callable[[int, int], None],
    ) -> None:
        self._mem = registers.mem
        self._first, self._end = register.addr, register.addr + register.size
        self._on_sample, self._on_high_read = on_sample, on_high_read
        self.stream = stream
        self.bdu = False
        self.big_endian = False
        self._half_read: set[int] = set()  # addresses read whose partner has not been read yet
        self._shown = b""
        registers.before_read(register, self.before_read)

    def refresh(self, now_ps: int) -> None:
        """Bring the registers up to date with the latest sample at ``now_ps``."""
        stream = self.stream
        if now_ps >= stream.next_ps:
            fresh = stream.advance(now_ps)
            self._show(stream.data)
            self._on_sample(fresh)

    def before_read(self, first: int, end: int, now_ps: int) -> None:
        """The read hook: refresh, then account for what is about to be read."""
        stream = self.stream
        if now_ps >= stream.next_ps:
            fresh = stream.advance(now_ps)
            self._show(stream.data)
            self._on_sample(fresh)
        elif self._shown is not stream.data and not self._half_read:
            self._show(stream.data)
        if end - first > 1 or (first - self._first) & 1:
            self._on_high_read(first, end)
        if self.bdu and (self._half_read or (end - first) & 1 or (first - self._first) & 1):
            self._hold(first, end)

    def set_format(self, *, bdu: bool, big_endian: bool) -> None:
        """BDU and BLE as configured; switching BDU off releases every word."""
        self.bdu, self.big_endian = bdu, big_endian
        if not bdu:
            self._half_read.clear()

    def _show(self, data: bytes) -> None:
        if self.big_endian:
            data = swap_bytes(data)
        if not self._half_read:
            self._mem[self._first : self._end] = data
            self._shown = self.stream.data
            return
        for offset in range(0, len(data), 2):
            word = self._first + offset
            if word not in self._half_read and word + 1 not in self._half_read:
                self._mem[word : word + 2] = data[offset : offset + 2]

    def _hold(self, first: int, end: int) -> None:
        for address in range(first, end):
            partner = self._first + ((address - self._first) ^ 1)
            if partner in self._half_read:
                self._half_read.discard(partner)
            else:
                self._half_read.add(address)
