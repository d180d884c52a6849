"""C types as the compiler laid them out, and the values that bytes of memory have under them.

Every type has ``size`` in bytes, ``leaves``, the number of plain values in it, and
``value(raw, offset)``, the value of the bytes at ``offset``. Little-endian, as the chip.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass
from functools import cached_property
from types import SimpleNamespace
from typing import Literal, Protocol

CValue = int | float | tuple["CValue", ...] | SimpleNamespace
"""int for integers, enumerations and pointers, bool for _Bool, float, tuple for arrays, and for structures
and unions an object with the members' names."""

_FLOATS = {2: "<e", 4: "<f", 8: "<d"}


class CType(Protocol):
    """What a variable's type can do."""

    @property
    def size(self) -> int:
        """Bytes."""
        ...

    @property
    def leaves(self) -> int:
        """Plain values in it: what reading it costs."""
        ...

    def value(self, raw: bytes, offset: int) -> CValue:
        """The value of ``size`` bytes from ``offset`` on."""
        ...


@dataclass(frozen=True)
class Integer:
    """Integers, enumerations, pointers (unsigned)."""

    size: int
    signed: bool
    leaves: int = 1

    def value(self, raw: bytes, offset: int) -> int:
        """An int."""
        return int.from_bytes(raw[offset : offset + self.size], "little", signed=self.signed)


@dataclass(frozen=True)
class Boolean:
    """C's _Bool."""

    size: int
    leaves: int = 1

    def value(self, raw: bytes, offset: int) -> bool:
        """True for anything but zero."""
        return any(raw[offset : offset + self.size])


@dataclass(frozen=True)
class Float:
    """IEEE 754 numbers of 2, 4 or 8 bytes."""

    size: Literal[2, 4, 8]
    leaves: int = 1

    def value(self, raw: bytes, offset: int) -> float:
        """A float, exactly."""
        number: float = struct.unpack_from(_FLOATS[self.size], raw, offset)[0]
        return number


@dataclass(frozen=True)
class Array:
    """``count`` elements; an array of arrays has arrays as elements."""

    element: CType
    count: int

    @cached_property
    def size(self) -> int:
        """Bytes."""
        return self.element.size * self.count

    @cached_property
    def leaves(self) -> int:
        """At least one for each element: empty structures take work, too."""
        return max(self.element.leaves, 1) * self.count

    def value(self, raw: bytes, offset: int) -> tuple[CValue, ...]:
        """The elements' values."""
        step = self.element.size
        return tuple(self.element.value(raw, offset + index * step) for index in range(self.count))


@dataclass(frozen=True)
class BitField:
    """``bits`` bits from bit ``low`` on, counted from the least significant one of the structure's byte."""

    low: int
    bits: int
    signed: bool
    leaves: int = 1

    @property
    def size(self) -> int:
        """Bytes from the first bit's byte to the last one's."""
        return (self.low + self.bits + 7) // 8

    def value(self, raw: bytes, offset: int) -> int:
        """An int."""
        number = int.from_bytes(raw[offset : offset + self.size], "little") >> self.low & (
            (1 << self.bits) - 1
        )
        return number - (1 << self.bits) if self.signed and number >> (self.bits - 1) else number


@dataclass(frozen=True)
class Member:
    """A member at ``offset``; an anonymous structure's or union's members count as its parent's."""

    name: str
    offset: int
    type: CType


@dataclass(frozen=True)
class Structure:
    """Structures and unions: in the latter all members are at offset 0."""

    size: int
    members: tuple[Member, ...]
    leaves: int

    def value(self, raw: bytes, offset: int) -> SimpleNamespace:
        """An object with the members' values under their names."""
        values: dict[str, CValue] = {}
        for member in self.members:
            value = member.type.value(raw, offset + member.offset)
            if member.name:
                values[member.name] = value
            elif isinstance(value, SimpleNamespace):
                values |= vars(value)
        return SimpleNamespace(**values)
