"""The type of the variable at an address, from its debugging entry (DWARF 5 section 4.1).

Entries are matched by address, not by name: a name may be declared anywhere, an address belongs to one.
"""

from __future__ import annotations

from emulator.chip.image.c_types import CType
from emulator.chip.image.debug_info import DebugInfo, Entry
from emulator.chip.image.sections import DebugInfoError
from emulator.chip.image.type_reader import AT_TYPE, TypeReader

_VARIABLE = 0x34
_AT_LOCATION, _AT_ABSTRACT_ORIGIN, _AT_SPECIFICATION = 0x02, 0x31, 0x47
_OP_ADDR = 0x03
_MOST_VARIABLES = 1 << 16  # one for each byte of RAM
_LONGEST_CHAIN = 8  # a definition refers to its declaration, an inlined static to its origin: two steps


class Variables:
    """Types of the variables that have a fixed address. Raises DebugInfoError where the file is damaged."""

    def __init__(self, info: DebugInfo) -> None:
        self._info = info
        self._types = TypeReader(info)
        self._entries: dict[int, Entry] = {}
        self._known: dict[int, CType] = {}
        for entry in info.find(_VARIABLE):
            location = entry.block(_AT_LOCATION)
            if location is not None and len(location) == 5 and location[0] == _OP_ADDR:
                self._entries.setdefault(int.from_bytes(location[1:], "little"), entry)
            if len(self._entries) > _MOST_VARIABLES:
                raise DebugInfoError(f"it describes more than {_MOST_VARIABLES} variables")

    def type_at(self, address: int) -> CType:
        """The type of the variable at ``address``."""
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
