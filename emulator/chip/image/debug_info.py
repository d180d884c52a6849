"""The tree of debugging entries in ``.debug_info`` (DWARF 5 sections 2, 7.5; versions 2 to 5 of it).

Decision: entries are read flat, in the order of the file, never by their sibling references. Following those
would skip what lies between, but a forged one can point backwards and make a circle.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

from emulator.chip.image.cursor import Budget, Cursor
from emulator.chip.image.forms import (
    FIXED_SIZES,
    IMPLICIT_CONST,
    LINE_STRP,
    REF_ADDR,
    REF_SIGNATURE,
    REF_UNIT,
    STRP,
    Value,
    read_value,
)
from emulator.chip.image.sections import DebugInfoError, Sections, printable

AT_NAME = 0x03
_UNIT_SKELETON, _UNIT_SPLIT = 4, 5
_UNIT_TYPE, _UNIT_SPLIT_TYPE = 2, 6


@dataclass(frozen=True)
class Abbreviation:
    """What entries of one code have in common: tag, and (attribute, form, implicit value) of each value."""

    tag: int
    has_children: bool
    attributes: tuple[tuple[int, int, int], ...]
    fixed_size: int | None
    """Bytes of the values, if they are the same for every entry."""


@dataclass(frozen=True)
class Unit:
    """One compilation: entries from ``first`` up to ``end``; references count from ``start``."""

    start: int
    first: int
    end: int
    abbreviations: dict[int, Abbreviation]


@dataclass(frozen=True)
class Entry:
    """A debugging entry: ``values`` maps an attribute to its form and value, ``after`` is behind them."""

    unit: Unit
    offset: int
    after: int
    tag: int
    has_children: bool
    values: dict[int, tuple[int, Value]]

    def number(self, attribute: int) -> int | None:
        """The value of an attribute that is a number; None if it is absent or something else."""
        value = self.values.get(attribute, (0, None))[1]
        return value if isinstance(value, int) else None

    def block(self, attribute: int) -> bytes | None:
        """The value of an attribute that is a block or an expression; None if it is absent or another."""
        value = self.values.get(attribute, (0, None))[1]
        return value if isinstance(value, bytes) else None


class DebugInfo:
    """The entries of a file. Everything raises DebugInfoError where the file is damaged."""

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

    def find(self, tag: int) -> Iterator[Entry]:
        """Every entry of this tag, at any depth, in the file's order."""
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

    def children(self, parent: Entry) -> Iterator[Entry]:
        """The entries one level below."""
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

    def referred(self, entry: Entry, attribute: int) -> Entry | None:
        """The entry that an attribute refers to; None if it has no such attribute."""
        form, value = entry.values.get(attribute, (0, 0))
        if form in REF_UNIT and isinstance(value, int):
            return self._at(entry.unit, entry.unit.start + value)
        if form == REF_ADDR and isinstance(value, int):
            return self._at(self._unit_with(value), value)
        if form == REF_SIGNATURE:
            raise DebugInfoError("it is in a unit of its own; compile without -fdebug-types-section")
        if form:
            raise DebugInfoError(f"a reference is of form 0x{form:X}, which is not read")
        return None

    def name(self, entry: Entry) -> str:
        """The entry's name; empty for an anonymous one."""
        form, value = entry.values.get(AT_NAME, (0, b""))
        if isinstance(value, int):
            if form not in self._strings:
                raise DebugInfoError(f"a name is of form 0x{form:X}, which is not read")
            value = Cursor(self._strings[form], value).string()
        return printable(value)

    def _unit_with(self, offset: int) -> Unit:
        index = bisect_right(self._units, offset, key=lambda unit: unit.start) - 1
        if index < 0:
            raise DebugInfoError("a reference leads nowhere")
        return self._units[index]

    def _at(self, unit: Unit, offset: int) -> Entry:
        if not unit.first <= offset < unit.end:
            raise DebugInfoError("a reference leads out of its unit")
        cursor = Cursor(self._info, offset, unit.end)
        abbreviation = self._abbreviation(unit, cursor)
        if abbreviation is None:
            raise DebugInfoError("a reference leads to no entry")
        return self._values(unit, offset, abbreviation, cursor)

    def _unit(self, start: int, cursor: Cursor) -> Unit:
        """A unit's header (section 7.5.1)."""
        self._budget.spend(Budget.OBJECT)
        version = cursor.unsigned(2)
        if not 2 <= version <= 5:
            raise DebugInfoError(f"debug information is of version {version}; 2 to 5 are known")
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
        """The abbreviations from ``offset`` on (section 7.5.3); units may share them."""
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
        """What the entry at the cursor looks like; None at the end of a list of children."""
        self._budget.spend(1)
        code = cursor.uleb128()
        if code == 0:
            return None
        if code not in unit.abbreviations:
            raise DebugInfoError(f"an entry has the unknown code {code}")
        return unit.abbreviations[code]

    def _values(self, unit: Unit, offset: int, abbreviation: Abbreviation, cursor: Cursor) -> Entry:
        self._budget.spend(len(abbreviation.attributes))
        values = {
            attribute: (form, implicit if form == IMPLICIT_CONST else read_value(cursor, form))
            for attribute, form, implicit in abbreviation.attributes
        }
        return Entry(unit, offset, cursor.offset, abbreviation.tag, abbreviation.has_children, values)
