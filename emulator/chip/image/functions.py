"""Signatures of functions, found by address, because several functions may have the same name (DWARF 5 section 3.3)."""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property
from typing import NamedTuple

from fcu_emulator.emulator.chip.image.c_types import AT_TYPE, CType, TypeReader
from fcu_emulator.emulator.chip.image.dwarf import DebugEntry, DebugInfo
from fcu_emulator.emulator.chip.image.elf import DebugInfoError

_SUBPROGRAM, _PARAMETER, _UNSPECIFIED_PARAMETERS = 0x2E, 0x05, 0x18
_POINTER, _TRANSPARENT = 0x0F, frozenset({0x16, 0x26, 0x35, 0x37, 0x47})  # typedef, const, volatile ...
_AT_LOW_PC, _AT_ABSTRACT_ORIGIN, _AT_SPECIFICATION, _AT_INLINE = 0x11, 0x31, 0x47, 0x20
_AT_DECLARATION = 0x3C
_INLINED = (1, 3)  # DW_INL_inlined, DW_INL_declared_inlined
_LONGEST_CHAIN = 8
_MAX_FUNCTIONS = 1 << 16
_MAX_PARAMETERS = 64


class Parameter(NamedTuple):
    """A parameter. For a pointer, ``points_to`` returns the target's type, None if this type has no size."""

    name: str
    type: CType
    points_to: Callable[[], CType | None] | None


class Signature(NamedTuple):
    """``result`` is None for void; ``is_variadic``: more arguments are allowed."""

    parameters: tuple[Parameter, ...]
    result: CType | None
    is_variadic: bool


class _Entries(NamedTuple):
    """The entries of functions, keyed by address, and the names of inlined functions and of defined functions."""

    at: dict[int, DebugEntry]
    inlined: set[str]
    defined: set[str]


class Functions:
    """Signatures by address. Raises DebugInfoError."""

    def __init__(self, info: DebugInfo) -> None:
        self._info = info
        self._types = TypeReader(info)
        self._known: dict[int, Signature] = {}

    @cached_property
    def _entries(self) -> _Entries:
        found = _Entries({}, set(), set())
        for entry in self._info.find(_SUBPROGRAM):
            address = entry.number(_AT_LOW_PC)
            if address is not None:
                found.at.setdefault(address & ~1, entry)
            elif entry.number(_AT_INLINE) in _INLINED:
                found.inlined.add(self._info.name(entry))
            if entry.number(_AT_DECLARATION) is None:
                found.defined.add(self._info.name(entry))
            if len(found.at) + len(found.inlined) > _MAX_FUNCTIONS:
                raise DebugInfoError(f"it describes more than {_MAX_FUNCTIONS} functions")
        return found

    def is_inlined(self, name: str) -> bool:
        return name in self._entries.inlined

    def is_defined(self, name: str) -> bool:
        """Return whether the source defines a function, even if the linker has removed it."""
        return name in self._entries.defined

    def signature_at(self, address: int) -> Signature:
        if address not in self._known:
            entry = self._entries.at.get(address)
            if entry is None:
                raise DebugInfoError(
                    "it has no debug information; compile with GCC and -g (not -gsplit-dwarf)"
                )
            self._known[address] = self._signature(entry)
        return self._known[address]

    def _signature(self, entry: DebugEntry) -> Signature:
        parameters = []
        is_variadic = False
        for child in self._info.children(entry):
            if child.tag == _PARAMETER:
                parameters.append(self._parameter(child))
            is_variadic |= child.tag == _UNSPECIFIED_PARAMETERS
            if len(parameters) > _MAX_PARAMETERS:
                raise DebugInfoError(f"it has more than {_MAX_PARAMETERS} parameters")
        described = self._described(entry)
        result = self._types.type_of(described) if AT_TYPE in described.values else None
        return Signature(tuple(parameters), result, is_variadic)

    def _parameter(self, entry: DebugEntry) -> Parameter:
        described = self._described(entry)
        pointed = self._pointer(described)
        points_to = None if pointed is None else lambda: self._pointed(pointed)
        return Parameter(self._info.name(described), self._types.type_of(described), points_to)

    def _described(self, entry: DebugEntry) -> DebugEntry:
        """Follow references, and return the entry that has name and type."""
        for _ in range(_LONGEST_CHAIN):
            origin = next((at for at in (_AT_ABSTRACT_ORIGIN, _AT_SPECIFICATION) if at in entry.values), None)
            referred = self._info.referred(entry, origin) if origin else None
            if referred is None:
                return entry
            entry = referred
        raise DebugInfoError("its entry refers to itself")

    def _pointer(self, entry: DebugEntry) -> DebugEntry | None:
        for _ in range(_LONGEST_CHAIN):
            target = self._info.referred(entry, AT_TYPE)
            if target is None or target.tag == _POINTER:
                return target
            if target.tag not in _TRANSPARENT:
                return None
            entry = target
        return None

    def _pointed(self, pointer: DebugEntry) -> CType | None:
        try:
            return self._types.type_of(pointer) if AT_TYPE in pointer.values else None
        except DebugInfoError:  # the target is a function, or a structure that is only declared
            return None
