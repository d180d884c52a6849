"""Bus masters on one part: two that read it live, and two that keep what it has prefetched.

``ByteKeeper`` is what the chip's I2C and SPI blocks do in C, in the plainest form: prefetched bytes serve any
number of messages; reads that follow each other without a gap become one run, of which the part need not
hear when it is quiet as a whole.
"""

from __future__ import annotations

from typing import Protocol

from fcu_emulator.sensors.part import Sensor

BYTE_PS = 22_500_000  # nine bits at 400 kHz


class Master(Protocol):
    """Reads and writes one part; a message begins at ``now_ps``."""

    part: Sensor

    def read(self, address: int, count: int, now_ps: int) -> bytes:
        """A message that reads."""
        ...

    def write(self, address: int, data: bytes, now_ps: int) -> None:
        """A message that writes."""
        ...


class LiveBytes:
    """Each byte is of the time at which it has been transferred."""

    def __init__(self, part: Sensor) -> None:
        self.part = part

    def read(self, address: int, count: int, now_ps: int) -> bytes:
        data = b""
        for _ in range(count):
            now_ps += BYTE_PS
            data += self.part.read(address, 1, now_ps)
            address = self.part.advance(address, 1)
        return data

    def write(self, address: int, data: bytes, now_ps: int) -> None:
        self.part.write(address, data, now_ps)


class ByteKeeper:
    """The same from kept bytes where there are any; ``served`` counts them."""

    def __init__(self, part: Sensor) -> None:
        self.part = part
        self.served = 0
        self._base, self._data, self._until_ps, self._quiet, self._version = 0, b"", 0, 0, -1
        self._run_first, self._run_end = 0, 0

    def read(self, address: int, count: int, now_ps: int) -> bytes:
        data = b""
        for taken in range(count):
            now_ps += BYTE_PS
            data += self._byte(address, count - taken, now_ps)
            address = self.part.advance(address, 1)
        return data

    def write(self, address: int, data: bytes, now_ps: int) -> None:
        self.settle()
        self.part.write(address, data, now_ps)

    def settle(self) -> None:
        """Before anything else happens: the part hears of what was not quiet."""
        count = self._run_end - self._run_first
        if count and not self._quiet_run(count):
            self.part.commit(self._run_first, count)
            self._version = -1  # ask again
        self._run_first = self._run_end

    def _quiet_run(self, count: int) -> bool:
        # Bits count from the base on. A run from there on has its own bit; another one is quiet if what
        # lies before it is, and both together.
        before = self._run_first - self._base
        return bool(self._quiet >> before + count & 1 and (not before or self._quiet >> before & 1))

    def _byte(self, address: int, wanted: int, now_ps: int) -> bytes:
        if not self._keeps(address, now_ps):
            self.settle()
            self._data, self._until_ps, self._quiet = self.part.prefetch(address, wanted, now_ps)
            self._base, self._version = address, self.part.version[0]
            self._run_first = self._run_end = address
            if not self._keeps(address, now_ps):
                return self.part.read(address, 1, now_ps)
        if address != self._run_end:
            if self._run_end > self._run_first and not self._quiet_run(self._run_end - self._run_first):
                self.settle()
                return self._byte(address, wanted, now_ps)
            self._run_first = address
        self._run_end = address + 1
        self.served += 1
        offset = address - self._base
        return self._data[offset : offset + 1]

    def _keeps(self, address: int, now_ps: int) -> bool:
        if self._version != self.part.version[0] or now_ps >= self._until_ps:
            return False
        return self._base <= address < self._base + len(self._data)


class LiveBursts:
    """All bytes are of the time at which the message begins."""

    def __init__(self, part: Sensor) -> None:
        self.part = part

    def read(self, address: int, count: int, now_ps: int) -> bytes:
        return self.part.read(address, count, now_ps)

    def write(self, address: int, data: bytes, now_ps: int) -> None:
        self.part.write(address, data, now_ps)


class BurstKeeper:
    """Keeps each burst as long as it lasts."""

    def __init__(self, part: Sensor) -> None:
        self.part = part
        self.served = 0
        self._kept: dict[tuple[int, int], tuple[bytes, int, int]] = {}

    def read(self, address: int, count: int, now_ps: int) -> bytes:
        data, until_ps, version = self._kept.get((address, count), (b"", 0, 0))
        if now_ps < until_ps and version == self.part.version[0]:
            self.served += 1
            return data
        version = self.part.version[0]
        data, until_ps = self.part.burst_reader(address, count)(now_ps)
        self._kept[address, count] = data, until_ps, version
        return data

    def write(self, address: int, data: bytes, now_ps: int) -> None:
        self.part.write(address, data, now_ps)
