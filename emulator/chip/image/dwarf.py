"""Debugging entries in ``.debug_info`` (DWARF 2 to 5; DWARF 5 sections 2, 7.5).

Decision: debugging entries are read in the order of the file, never by their sibling references.
Forged references can form a circle. Split debug information (``-gsplit-dwarf``) is skipped.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

from fcu_emulator.emulator.chip.image.elf import DebugInfoError, Sections, printable

# -- numbers and strings, within a budget -------------------------------------------------------------------

_LONGEST_LEB128 = 10  # bytes of a 64-bit number
_LONGEST_STRING = 4096
_DWARF64 = 0xFFFF_FFF0  # lengths from this value on announce the 64-bit format


class Budget:
    """Limits the work to read one file, because files may be forged.

    Each stored object costs ``OBJECT``, so that the budget also limits memory.
    """

    LIMIT = 10_000_000  # this much work takes some seconds; the lab's solution needs 160,000
    OBJECT = 32

    def __init__(self) -> None:
        self.spent = 0

    def spend(self, amount: int) -> None:
        self.spent += amount
        if self.spent > self.LIMIT:
            raise DebugInfoError(f"the debug information takes more than {self.LIMIT} steps to read")


class Cursor:
    """A position in little-endian ``data``. Reads beyond ``end`` raise DebugInfoError."""

    __slots__ = ("data", "end", "offset")

    def __init__(self, data: bytes, offset: int = 0, end: int | None = None) -> None:
        self.data = data
        self.offset = offset
        self.end = len(data) if end is None else min(end, len(data))

    def skip(self, size: int) -> int:
        start = self.offset
        if start + size > self.end:
            raise DebugInfoError("debug information is cut short")
        self.offset = start + size
        return start

    def take(self, size: int) -> bytes:
        start = self.skip(size)
        return self.data[start : start + size]

    def byte(self) -> int:
        return self.data[self.skip(1)]

    def unsigned(self, size: int) -> int:
        start = self.skip(size)
        return int.from_bytes(self.data[start : start + size], "little")

    def uleb128(self) -> int:
        """Return an unsigned LEB128 number (DWARF 5 section 7.6)."""
        if self.offset < self.end and self.data[self.offset] < 0x80:  # nearly all numbers have one byte
            return self.byte()
        return self._leb128()[0]

    def sleb128(self) -> int:
        """Return a signed LEB128 number (section 7.6)."""
        value, bits = self._leb128()
        return value - (1 << bits) if value >> (bits - 1) else value

    def string(self) -> bytes:
        end = self.data.find(b"\0", self.offset, min(self.end, self.offset + _LONGEST_STRING))
        if end < 0:
            raise DebugInfoError("a string in the debug information is not terminated")
        text = self.data[self.offset : end]
        self.offset = end + 1
        return text

    def unit(self) -> Cursor:
        """Return a cursor over the next unit, and skip that unit."""
        size = self.unsigned(4)
        if size >= _DWARF64:
            raise DebugInfoError(
                "debug information is in the 64-bit format, but must be in the 32-bit format"
            )
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
        raise DebugInfoError("a number in the debug information is not terminated")


# -- attribute values (section 7.5.6, 32-bit DWARF) ---------------------------------------------------------

STRING, STRP, LINE_STRP = 0x08, 0x0E, 0x1F
REF_ADDR, REF_SIGNATURE = 0x10, 0x20
REF_UNIT = frozenset({0x11, 0x12, 0x13, 0x14, 0x15})  # ref1, ref2, ref4, ref8, ref_udata
IMPLICIT_CONST = 0x21
_FLAG_PRESENT = 0x19
_BLOCK1, _BLOCK2, _BLOCK4, _BLOCK, _EXPRLOC = 0x0A, 0x03, 0x04, 0x09, 0x18
_BLOCK_LENGTHS = {_BLOCK1: 1, _BLOCK2: 2, _BLOCK4: 4}
_SDATA, _UDATA = 0x0D, 0x0F
_UNSIGNED_LEB128 = frozenset({_UDATA, 0x15, 0x1A, 0x1B, 0x22, 0x23})  # ref_udata, strx, addrx, lists' indices

FIXED_SIZES = {
    0x01: 4,  # addr
    0x05: 2,  # data2
    0x06: 4,  # data4
    0x07: 8,  # data8
    0x0B: 1,  # data1
    0x0C: 1,  # flag
    STRP: 4,
    REF_ADDR: 4,
    0x11: 1,  # ref1
    0x12: 2,  # ref2
    0x13: 4,  # ref4
    0x14: 8,  # ref8
    0x17: 4,  # sec_offset
    _FLAG_PRESENT: 0,
    0x1C: 4,  # ref_sup4
    0x1D: 4,  # strp_sup
    0x1E: 16,  # data16
    LINE_STRP: 4,
    REF_SIGNATURE: 8,
    IMPLICIT_CONST: 0,
    0x24: 8,  # ref_sup8
    0x25: 1,  # strx1
    0x26: 2,  # strx2
    0x27: 3,  # strx3
    0x28: 4,  # strx4
    0x29: 1,  # addrx1
    0x2A: 2,  # addrx2
    0x2B: 3,  # addrx3
    0x2C: 4,  # addrx4
}

Value = int | bytes
"""An attribute's value: bytes for blocks, expressions and inline strings, a number for other forms."""


def read_value(cursor: Cursor, form: int) -> Value:
    """Return a value, or 0 if the abbreviation contains the value. Raises DebugInfoError."""
    size = FIXED_SIZES.get(form)
    if size is not None:
        return cursor.unsigned(size)
    if form in _UNSIGNED_LEB128:
        return cursor.uleb128()
    if form == _SDATA:
        return cursor.sleb128()
    if form == STRING:
        return cursor.string()
    if form in _BLOCK_LENGTHS:
        return cursor.take(cursor.unsigned(_BLOCK_LENGTHS[form]))
    if form in {_BLOCK, _EXPRLOC}:
        return cursor.take(cursor.uleb128())
    raise DebugInfoError(f"debug information has a value of unknown form 0x{form:X}")


# -- entries ------------------------------------------------------------------------------------------------

AT_NAME = 0x03
_UNIT_SKELETON, _UNIT_SPLIT = 4, 5
_UNIT_TYPE, _UNIT_SPLIT_TYPE = 2, 6


@dataclass(frozen=True)
class Abbreviation:
    """Tag and (attribute, form, implicit value) triples of one code."""

    tag: int
    has_children: bool
    attributes: tuple[tuple[int, int, int], ...]
    fixed_size: int | None
    """Total size of the values in bytes; None if this size varies."""


@dataclass(frozen=True)
class Unit:
    """A compilation unit. References are offsets from ``start``."""

    start: int
    first: int
    end: int
    abbreviations: dict[int, Abbreviation]


@dataclass(frozen=True)
class DebugEntry:
    """A debugging entry; ``values`` has (form, value) by attribute."""

    unit: Unit
    offset: int
    after: int
    tag: int
    has_children: bool
    values: dict[int, tuple[int, Value]]

    def number(self, attribute: int) -> int | None:
        value = self.values.get(attribute, (0, None))[1]
        return value if isinstance(value, int) else None

    def block(self, attribute: int) -> bytes | None:
        value = self.values.get(attribute, (0, None))[1]
        return value if isinstance(value, bytes) else None


class DebugInfo:
    """All debugging entries of a file. The methods raise DebugInfoError."""

    def __init__(self, sections: Sections, budget: Budget) -> None:
        self._info = sections.get(".debug_info")
        self._abbreviations = sections.get(".debug_abbrev")
        self._strings = {STRP: sections.get(".debug_str"), LINE_STRP: sections.get(".debug_line_str")}
        self._budget = budget
        self._tables: dict[int, dict[int, Abbreviation]] = {}

    @cached_property
    def _units(self) -> list[Unit]:
        units = []
        cursor = Cursor(self._info)
        while cursor.offset < cursor.end:
            start = cursor.offset
            units.append(self._unit(start, cursor.unit()))
        return units

    def find(self, tag: int) -> Iterator[DebugEntry]:
        for unit in self._units:
            offset = unit.first
            while offset < unit.end:
                cursor = Cursor(self._info, offset, unit.end)
                abbreviation = self._abbreviation(unit, cursor)
                if abbreviation is None:
                    offset = cursor.offset
                elif abbreviation.tag != tag and abbreviation.fixed_size is not None:
                    offset = cursor.offset + abbreviation.fixed_size
                else:
                    entry = self._values(unit, offset, abbreviation, cursor)
                    offset = entry.after
                    if entry.tag == tag:
                        yield entry

    def children(self, parent: DebugEntry) -> Iterator[DebugEntry]:
        offset, depth = parent.after, 1 if parent.has_children else 0
        while depth and offset < parent.unit.end:
            cursor = Cursor(self._info, offset, parent.unit.end)
            abbreviation = self._abbreviation(parent.unit, cursor)
            if abbreviation is None:
                offset = cursor.offset
                depth -= 1
                continue
            entry = self._values(parent.unit, offset, abbreviation, cursor)
            offset = entry.after
            if depth == 1:
                yield entry
            depth += entry.has_children

    def referred(self, entry: DebugEntry, attribute: int) -> DebugEntry | None:
        form, value = entry.values.get(attribute, (0, 0))
        if form in REF_UNIT and isinstance(value, int):
            return self._at(entry.unit, entry.unit.start + value)
        if form == REF_ADDR and isinstance(value, int):
            return self._at(self._unit_with(value), value)
        if form == REF_SIGNATURE:
            raise DebugInfoError(
                "its debug information is in a separate unit; compile without -fdebug-types-section"
            )
        if form:
            raise DebugInfoError(f"a reference is of form 0x{form:X}, which is not supported")
        return None

    def at_start(self, unit: Unit) -> DebugEntry:
        """Return a unit's first entry. The entry's name is the name of the source file."""
        return self._at(unit, unit.first)

    def name(self, entry: DebugEntry) -> str:
        form, value = entry.values.get(AT_NAME, (0, b""))
        if isinstance(value, int):
            if form not in self._strings:
                raise DebugInfoError(f"a name is of form 0x{form:X}, which is not supported")
            value = Cursor(self._strings[form], value).string()
        return printable(value)

    def _unit_with(self, offset: int) -> Unit:
        index = bisect_right(self._units, offset, key=lambda unit: unit.start) - 1
        if index < 0:
            raise DebugInfoError("a reference is invalid")
        return self._units[index]

    def _at(self, unit: Unit, offset: int) -> DebugEntry:
        if not unit.first <= offset < unit.end:
            raise DebugInfoError("a reference leads out of its unit")
        cursor = Cursor(self._info, offset, unit.end)
        abbreviation = self._abbreviation(unit, cursor)
        if abbreviation is None:
            raise DebugInfoError("a reference does not point to an entry")
        return self._values(unit, offset, abbreviation, cursor)

    def _unit(self, start: int, cursor: Cursor) -> Unit:
        self._budget.spend(Budget.OBJECT)
        version = cursor.unsigned(2)
        if not 2 <= version <= 5:
            raise DebugInfoError(
                f"debug information has DWARF version {version}; versions 2 to 5 are supported"
            )
        kind = cursor.byte() if version == 5 else 0
        if version == 5:
            address_size, abbreviations = cursor.byte(), cursor.unsigned(4)
        else:
            abbreviations, address_size = cursor.unsigned(4), cursor.byte()
        if address_size != 4:
            raise DebugInfoError(f"debug information has addresses of {address_size} bytes, not 4")
        if kind in {_UNIT_SKELETON, _UNIT_SPLIT}:
            cursor.skip(8)  # the identifier of split debug information
        elif kind in {_UNIT_TYPE, _UNIT_SPLIT_TYPE}:
            cursor.skip(12)  # a type's signature and offset
        return Unit(start, cursor.offset, cursor.end, self._table(abbreviations))

    def _table(self, offset: int) -> dict[int, Abbreviation]:
        """Return the abbreviations (section 7.5.3)."""
        if offset not in self._tables:
            table = self._tables[offset] = {}
            cursor = Cursor(self._abbreviations, offset)
            while code := cursor.uleb128():
                table[code] = self._declaration(cursor)
        return self._tables[offset]

    def _declaration(self, cursor: Cursor) -> Abbreviation:
        self._budget.spend(Budget.OBJECT)
        tag, has_children = cursor.uleb128(), bool(cursor.byte())
        attributes = []
        while True:
            self._budget.spend(1)
            attribute, form = cursor.uleb128(), cursor.uleb128()
            implicit = cursor.sleb128() if form == IMPLICIT_CONST else 0
            if attribute == form == 0:
                break
            attributes.append((attribute, form, implicit))
        fixed = all(form in FIXED_SIZES for _, form, _ in attributes)
        size = sum(FIXED_SIZES[form] for _, form, _ in attributes) if fixed else None
        return Abbreviation(tag, has_children, tuple(attributes), size)

    def _abbreviation(self, unit: Unit, cursor: Cursor) -> Abbreviation | None:
        self._budget.spend(1)
        code = cursor.uleb128()
        if code == 0:
            return None
        if code not in unit.abbreviations:
            raise DebugInfoError(f"an entry has the unknown code {code}")
        return unit.abbreviations[code]

    def _values(self, unit: Unit, offset: int, abbreviation: Abbreviation, cursor: Cursor) -> DebugEntry:
        self._budget.spend(len(abbreviation.attributes))
        values = {
            attribute: (form, implicit if form == IMPLICIT_CONST else read_value(cursor, form))
            for attribute, form, implicit in abbreviation.attributes
        }
        return DebugEntry(unit, offset, cursor.offset, abbreviation.tag, abbreviation.has_children, values)
