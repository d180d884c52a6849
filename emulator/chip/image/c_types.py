"""C types in little-endian layout (DWARF 5 chapter 5)."""

from __future__ import annotations

import struct
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from types import SimpleNamespace
from typing import Literal, Protocol

from fcu_emulator.emulator.chip.image.dwarf import Cursor, DebugEntry, DebugInfo
from fcu_emulator.emulator.chip.image.elf import DebugInfoError
from fcu_emulator.emulator.chip.image.lines import SourceLine
from fcu_emulator.emulator.chip.memory_map import CAPACITY

CValue = int | float | tuple["CValue", ...] | SimpleNamespace
"""A C value in Python: bool for _Bool, tuple for arrays, an object for structures and unions, int for
pointers and enumerations.
"""

_FLOATS = {2: "<e", 4: "<f", 8: "<d"}


class CType(Protocol):
    """A type with its ``size`` in bytes."""

    @property
    def size(self) -> int: ...

    @property
    def leaves(self) -> int:
        """Number of plain values, a measure of the cost of a read."""
        ...

    def value(self, raw: bytes, offset: int) -> CValue: ...


@dataclass(frozen=True)
class Integer:
    """Integers and enumerations, and pointers as unsigned integers."""

    size: int
    signed: bool
    leaves: int = 1

    def value(self, raw: bytes, offset: int) -> int:
        return int.from_bytes(raw[offset : offset + self.size], "little", signed=self.signed)


@dataclass(frozen=True)
class Boolean:
    """C's _Bool."""

    size: int
    leaves: int = 1

    def value(self, raw: bytes, offset: int) -> bool:
        return any(raw[offset : offset + self.size])


@dataclass(frozen=True)
class Float:
    """IEEE 754 numbers of 2, 4 or 8 bytes."""

    size: Literal[2, 4, 8]
    leaves: int = 1

    def value(self, raw: bytes, offset: int) -> float:
        number: float = struct.unpack_from(_FLOATS[self.size], raw, offset)[0]
        return number


@dataclass(frozen=True)
class Array:
    """Elements of one type, which may itself be an array."""

    element: CType
    count: int

    @cached_property
    def size(self) -> int:
        return self.element.size * self.count

    @cached_property
    def leaves(self) -> int:
        """Number of plain values, at least one per element."""
        return max(self.element.leaves, 1) * self.count

    def value(self, raw: bytes, offset: int) -> tuple[CValue, ...]:
        step = self.element.size
        return tuple(self.element.value(raw, offset + index * step) for index in range(self.count))


@dataclass(frozen=True)
class BitField:
    """A bit field that begins at bit ``low`` of a byte of the structure."""

    low: int
    bits: int
    signed: bool
    leaves: int = 1

    @property
    def size(self) -> int:
        return (self.low + self.bits + 7) // 8

    def value(self, raw: bytes, offset: int) -> int:
        number = int.from_bytes(raw[offset : offset + self.size], "little") >> self.low & (
            (1 << self.bits) - 1
        )
        return number - (1 << self.bits) if self.signed and number >> (self.bits - 1) else number


@dataclass(frozen=True)
class Member:
    """A member of a structure. Members of an anonymous structure count as members of its parent."""

    name: str
    offset: int
    type: CType


@dataclass(frozen=True)
class Structure:
    """Structures and unions."""

    size: int
    members: tuple[Member, ...]
    leaves: int

    def value(self, raw: bytes, offset: int) -> SimpleNamespace:
        values: dict[str, CValue] = {}
        for member in self.members:
            value = member.type.value(raw, offset + member.offset)
            if member.name:
                values[member.name] = value
            elif isinstance(value, SimpleNamespace):
                values |= vars(value)
        return SimpleNamespace(**values)


# -- types from debugging entries ---------------------------------------------------------------------------

AT_TYPE = 0x49
_AT_BYTE_SIZE, _AT_BIT_OFFSET, _AT_BIT_SIZE = 0x0B, 0x0C, 0x0D
_AT_CONST_VALUE = 0x1C
_AT_UPPER_BOUND, _AT_COUNT = 0x2F, 0x37
_AT_MEMBER_LOCATION, _AT_DATA_BIT_OFFSET = 0x38, 0x6B
_AT_ENCODING = 0x3E
_AT_DECL_LINE = 0x3B
_OP_PLUS_UCONST = 0x23

_ARRAY, _ENUMERATION, _POINTER, _STRUCTURE, _UNION = 0x01, 0x04, 0x0F, 0x13, 0x17
_SUBRANGE, _BASE, _MEMBER, _REFERENCE, _RVALUE_REFERENCE, _CLASS = 0x21, 0x24, 0x0D, 0x10, 0x42, 0x02
_TRANSPARENT = frozenset({0x16, 0x26, 0x35, 0x37, 0x47})  # typedef, const, volatile, restrict, _Atomic
_POINTERS = frozenset({_POINTER, _REFERENCE, _RVALUE_REFERENCE})

_DEEPEST = 32  # maximum nesting of types
_MAX_DIMENSIONS = 8  # limits the recursion

_FLOAT, _BOOLEAN = 0x04, 0x02
_SIGNED, _UNSIGNED = frozenset({0x05, 0x06, 0x0D}), frozenset({0x01, 0x07, 0x08, 0x10, 0x12})


def member_at(kind: CType, offset: int) -> str:
    """Return the member or element at an offset of a type, such as ``.AXIS_Z`` or ``[2]``; "" for other types."""
    match kind:
        case Structure(members=members):
            for member in members:
                if member.offset <= offset < member.offset + member.type.size:
                    dot = f".{member.name}" if member.name else ""
                    return dot + member_at(member.type, offset - member.offset)
        case Array(element=element) if element.size:
            return f"[{offset // element.size}]" + member_at(element, offset % element.size)
    return ""


class TypeReader:
    """Creates each C type only once. Raises DebugInfoError."""

    def __init__(self, info: DebugInfo) -> None:
        self._info = info
        self._known: dict[int, CType] = {}
        self._making: set[int] = set()

    def type_of(self, entry: DebugEntry) -> CType:
        target = self._info.referred(entry, AT_TYPE)
        if target is None:
            raise DebugInfoError("a type is missing (void has no value)")
        return self._made(target)

    def _made(self, entry: DebugEntry) -> CType:
        if entry.offset not in self._known:
            if entry.offset in self._making or len(self._making) == _DEEPEST:
                raise DebugInfoError("a type contains itself, or is nested too deep")
            self._making.add(entry.offset)
            try:
                self._known[entry.offset] = _bounded(self._make(entry))
            finally:
                self._making.remove(entry.offset)
        return self._known[entry.offset]

    def _make(self, entry: DebugEntry) -> CType:
        if entry.tag in _TRANSPARENT:
            return self.type_of(entry)
        if entry.tag == _BASE:
            return _base(entry)
        if entry.tag in _POINTERS:
            return Integer(entry.number(_AT_BYTE_SIZE) or 4, signed=False)
        if entry.tag == _ENUMERATION:
            return self._enumeration(entry)
        if entry.tag == _ARRAY:
            return self._array(entry)
        if entry.tag in {_STRUCTURE, _UNION, _CLASS}:
            return self._structure(entry)
        raise DebugInfoError(f"a type is of kind 0x{entry.tag:02X}, which has no value here")

    def _enumeration(self, entry: DebugEntry) -> CType:
        """Return the underlying type. If the entry has no underlying type, a negative constant makes the type signed."""
        if AT_TYPE in entry.values:
            return self.type_of(entry)
        constants = [child.number(_AT_CONST_VALUE) or 0 for child in self._info.children(entry)]
        return Integer(entry.number(_AT_BYTE_SIZE) or 4, signed=min(constants, default=0) < 0)

    def _array(self, entry: DebugEntry) -> CType:
        made = self.type_of(entry)
        ranges = [child for child in self._info.children(entry) if child.tag == _SUBRANGE]
        if len(ranges) > _MAX_DIMENSIONS:
            raise DebugInfoError(f"an array has {len(ranges)} dimensions")
        for subrange in reversed(ranges):
            made = _bounded(Array(made, _count(subrange)))
        return made

    def _structure(self, entry: DebugEntry) -> CType:
        size = entry.number(_AT_BYTE_SIZE)
        if size is None:
            raise DebugInfoError("a structure is declared only, not defined")
        members = tuple(self._members(entry, size))
        return Structure(size, members, sum(member.type.leaves for member in members))

    def _members(self, entry: DebugEntry, size: int) -> Iterator[Member]:
        for child in self._info.children(entry):
            if child.tag != _MEMBER:
                continue
            member = self._member(child)
            if not 0 <= member.offset <= size - member.type.size:
                raise DebugInfoError(f"the member {member.name!r} does not fit into its structure")
            yield member

    def _member(self, entry: DebugEntry) -> Member:
        name, kind = self._info.name(entry), self.type_of(entry)
        bits = entry.number(_AT_BIT_SIZE)
        if bits is None:
            return Member(name, _location(entry), kind)
        if not 1 <= bits <= 8 * kind.size:
            raise DebugInfoError(f"the bit field {name!r} has {bits} bits")
        first = _first_bit(entry, bits, kind.size)
        signed = isinstance(kind, Integer) and kind.signed
        return Member(name, first // 8, BitField(first % 8, bits, signed))


def _base(entry: DebugEntry) -> CType:
    size, encoding = entry.number(_AT_BYTE_SIZE), entry.number(_AT_ENCODING)
    if encoding == _FLOAT and size in {2, 4, 8}:
        return Float(2 if size == 2 else 4 if size == 4 else 8)
    if size is not None and 1 <= size <= 16:
        if encoding == _BOOLEAN:
            return Boolean(size)
        if encoding in _SIGNED or encoding in _UNSIGNED:
            return Integer(size, signed=encoding in _SIGNED)
    raise DebugInfoError(f"its basic type, of {size} bytes and encoding {encoding}, is not supported")


def _count(subrange: DebugEntry) -> int:
    """Return the number of elements. GCC gives the highest index instead, which is -1 for an array without elements."""
    count = subrange.number(_AT_COUNT)
    if count is None:
        highest = subrange.number(_AT_UPPER_BOUND)
        count = 0 if highest in {None, 0xFFFF_FFFF} else (highest or 0) + 1
    if not 0 <= count <= CAPACITY:
        raise DebugInfoError(f"an array has {count} elements")
    return count


def _location(member: DebugEntry) -> int:
    """Return a member's offset, which DWARF 2 gives as an expression."""
    expression = member.block(_AT_MEMBER_LOCATION)
    if expression is None:
        return member.number(_AT_MEMBER_LOCATION) or 0
    if expression[:1] != bytes([_OP_PLUS_UCONST]):
        raise DebugInfoError("a member's place is computed, which is not supported")
    return Cursor(expression, 1).uleb128()


def _first_bit(member: DebugEntry, bits: int, unit_size: int) -> int:
    """Return a bit field's lowest bit, counted from the structure's start (DWARF 5 section 5.7.6).

    Before DWARF 4, entries count from the highest bit of the storage unit.
    """
    first = member.number(_AT_DATA_BIT_OFFSET)
    if first is None:
        size = member.number(_AT_BYTE_SIZE) or unit_size
        first = 8 * (_location(member) + size) - bits - (member.number(_AT_BIT_OFFSET) or 0)
    if first < 0:
        raise DebugInfoError("a bit field begins before its structure")
    return first


def _bounded(made: CType) -> CType:
    """Return the type if it fits into the chip's memories; nested arrays can describe any size."""
    if made.size > CAPACITY or made.leaves > CAPACITY:
        raise DebugInfoError(f"a type has {made.size} bytes, more than the chip's memories")
    return made


# -- types of variables (section 4.1) -----------------------------------------------------------------------

_VARIABLE = 0x34
_AT_LOCATION, _AT_ABSTRACT_ORIGIN, _AT_SPECIFICATION = 0x02, 0x31, 0x47
_OP_ADDR = 0x03
_MAX_VARIABLES = 1 << 16  # one variable for each byte of RAM
_LONGEST_CHAIN = 8  # limit for damaged files; correct files need two steps, to a declaration and to an origin


class Variables:
    """Types of variables, found by address, because several variables may have the same name. Raises DebugInfoError."""

    def __init__(self, info: DebugInfo) -> None:
        self._info = info
        self._types = TypeReader(info)
        self._entries: dict[int, DebugEntry] = {}
        self._known: dict[int, CType] = {}
        for entry in info.find(_VARIABLE):
            location = entry.block(_AT_LOCATION)
            if location is not None and len(location) == 5 and location[0] == _OP_ADDR:
                self._entries.setdefault(int.from_bytes(location[1:], "little"), entry)
            if len(self._entries) > _MAX_VARIABLES:
                raise DebugInfoError(f"it describes more than {_MAX_VARIABLES} variables")

    def line_at(self, address: int) -> SourceLine | None:
        """Return the line that defines the variable at an address; None if it is unknown."""
        entry = self._entries.get(address)
        line = entry and entry.number(_AT_DECL_LINE)
        if entry is None or not line:
            return None
        return SourceLine(self._info.name(self._info.at_start(entry.unit)), line)

    def type_at(self, address: int) -> CType:
        if address not in self._known:
            self._known[address] = self._type_at(address)
        return self._known[address]

    def _type_at(self, address: int) -> CType:
        entry = self._entries.get(address)
        if entry is None:
            raise DebugInfoError("it has no debug information; compile with GCC and -g (not -gsplit-dwarf)")
        for _ in range(_LONGEST_CHAIN):
            if AT_TYPE in entry.values:
                return self._types.type_of(entry)
            origin = _AT_SPECIFICATION if _AT_SPECIFICATION in entry.values else _AT_ABSTRACT_ORIGIN
            declaration = self._info.referred(entry, origin)
            if declaration is None:
                break
            entry = declaration
        raise DebugInfoError("its entry has no type")
