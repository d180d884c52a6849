"""Reading numbers and strings one after the other, never beyond the end, never more than a budget allows."""

from __future__ import annotations

from emulator.chip.image.sections import DebugInfoError

_LONGEST_LEB128 = 10  # bytes of a 64-bit number; more would only be padding
_LONGEST_STRING = 4096
_DWARF64 = 0xFFFF_FFF0  # lengths from here on announce the 64-bit format


class Budget:
    """Work that reading debug information may take; ``spent`` counts table entries and instructions.

    A file can make a short table stand for endless work (sharing, zero-sized entries); counted, it cannot.
    Memory is bounded by it, too: what is kept as an object costs ``OBJECT``.
    """

    LIMIT = 10_000_000  # some seconds; the lab's solution takes 160,000
    OBJECT = 32

    def __init__(self) -> None:
        self.spent = 0

    def spend(self, amount: int) -> None:
        """Raise DebugInfoError when the limit is passed."""
        self.spent += amount
        if self.spent > self.LIMIT:
            raise DebugInfoError(f"the debug information takes more than {self.LIMIT} steps to read")


class Cursor:
    """A place in ``data``; little-endian reads move it on. Each raises DebugInfoError at ``end``."""

    __slots__ = ("data", "end", "offset")

    def __init__(self, data: bytes, offset: int = 0, end: int | None = None) -> None:
        self.data = data
        self.offset = offset
        self.end = len(data) if end is None else min(end, len(data))

    def skip(self, size: int) -> int:
        """Move on by ``size`` bytes; returns the offset before."""
        start = self.offset
        if start + size > self.end:
            raise DebugInfoError("debug information is cut short")
        self.offset = start + size
        return start

    def take(self, size: int) -> bytes:
        """The next ``size`` bytes."""
        start = self.skip(size)
        return self.data[start : start + size]

    def byte(self) -> int:
        """The next byte."""
        return self.data[self.skip(1)]

    def unsigned(self, size: int) -> int:
        """An unsigned number of ``size`` bytes."""
        start = self.skip(size)
        return int.from_bytes(self.data[start : start + size], "little")

    def uleb128(self) -> int:
        """An unsigned number of variable length (DWARF 5 section 7.6)."""
        if self.offset < self.end and self.data[self.offset] < 0x80:  # one byte: nearly every one
            return self.byte()
        return self._leb128()[0]

    def sleb128(self) -> int:
        """A signed number of variable length (DWARF 5 section 7.6)."""
        value, bits = self._leb128()
        return value - (1 << bits) if value >> (bits - 1) else value

    def string(self) -> bytes:
        """A zero-terminated string."""
        end = self.data.find(b"\0", self.offset, min(self.end, self.offset + _LONGEST_STRING))
        if end < 0:
            raise DebugInfoError("a string in the debug information has no end")
        text = self.data[self.offset : end]
        self.offset = end + 1
        return text

    def unit(self) -> Cursor:
        """A cursor over the unit that begins here, behind its length; this one moves behind the unit."""
        size = self.unsigned(4)
        if size >= _DWARF64:
            raise DebugInfoError("debug information is in the 64-bit format, which no 32-bit chip needs")
        start = self.skip(size)
        return Cursor(self.data, start, start + size)

    def _leb128(self) -> tuple[int, int]:
        value = bits = 0
        for _ in range(_LONGEST_LEB128):
            byte = self.byte()
            value |= (byte & 0x7F) << bits
            bits += 7
            if byte < 0x80:
                return value, bits
        raise DebugInfoError("a number in the debug information has no end")
