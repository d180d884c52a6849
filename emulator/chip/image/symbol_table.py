"""The ELF symbol table: which function holds an address, where is a variable.

Decision: the table is indexed on its first use, in one pass. A run that nobody asks about its symbols pays
nothing; ST's stock firmware with its 3000 symbols pays a few milliseconds, once.
"""

from __future__ import annotations

import struct
from bisect import bisect_right
from collections import defaultdict
from typing import NamedTuple

from emulator.chip.image.memory_map import FLASH, RAM
from emulator.chip.image.sections import DebugInfoError, Sections, printable, string_at

_SYMBOL = struct.Struct("<3I2BH")
_MOST_SYMBOLS = 1 << 18  # more than this chip's flash has room for
_LONGEST_NAME = 256
_NOTYPE, _OBJECT, _FUNC, _FILE = 0, 1, 2, 4
_LOCAL, _GLOBAL, _WEAK = 0, 1, 2
_UNDEFINED = 0


class FunctionAt(NamedTuple):
    """The function that holds an address, ``offset`` bytes behind its ``start`` (an even address).

    ``name`` is the one in the source: of ``main.constprop.0``, a clone that GCC has made, it is ``main``.
    """

    name: str
    start: int
    size: int
    offset: int


class Symbol(NamedTuple):
    """A function or variable; ``file`` is the source of a local (static) one, otherwise empty."""

    name: str
    address: int
    size: int
    is_function: bool
    is_local: bool
    file: str


class _Function(NamedTuple):
    start: int
    rank: int  # of several names of one address the lowest counts
    name: str
    size: int


class SymbolTable:
    """The functions and variables of ``.symtab``. Raises DebugInfoError if it cannot be read."""

    def __init__(self, sections: Sections) -> None:
        self._by_name: dict[str, list[Symbol]] = defaultdict(list)
        table, strings = sections.get(".symtab"), sections.linked(".symtab")
        if len(table) // _SYMBOL.size > _MOST_SYMBOLS:
            raise DebugInfoError(f"the symbol table has more than {_MOST_SYMBOLS} entries")
        functions = self._read(table[: len(table) - len(table) % _SYMBOL.size], strings)
        best: dict[int, _Function] = {}
        for function in sorted(functions):
            best.setdefault(function.start, function)
        self._functions = list(best.values())
        self._starts = list(best)

    def function_at(self, address: int) -> FunctionAt | None:
        """The function that ``address`` lies in; bit 0, the Thumb bit of a code address, is ignored."""
        address &= ~1
        index = bisect_right(self._starts, address) - 1
        if index < 0:
            return None
        function = self._functions[index]
        size = function.size or self._gap(index)
        offset = address - function.start
        name = _source_name(function.name)
        return FunctionAt(name, function.start, size, offset) if offset < size else None

    def named(self, name: str) -> list[Symbol]:
        """Symbols of this C name: the global one alone if there is one, otherwise every static one.

        Compilers number statics of functions: ``count.0`` is found as ``count``, too.
        """
        symbols = self._by_name.get(name, [])
        return [symbol for symbol in symbols if not symbol.is_local][:1] or symbols

    def object_at(self, address: int) -> Symbol | None:
        """The variable that ``address`` lies in."""
        for symbols in self._by_name.values():
            for symbol in symbols:
                if not symbol.is_function and symbol.address <= address < symbol.address + symbol.size:
                    return symbol
        return None

    def _read(self, table: bytes, strings: bytes) -> list[_Function]:
        functions = []
        file = ""
        for name_at, value, size, info, _, section in _SYMBOL.iter_unpack(table):
            kind, binding = info & 0xF, info >> 4
            if kind > _FILE or (section == _UNDEFINED and kind != _FILE):
                continue
            name = printable(string_at(strings, name_at, _LONGEST_NAME))
            if kind == _FILE:
                file = name
                continue
            if not name or name.startswith("$"):  # $t, $d: marks of code and data (IHI 0044, 4.5.5)
                continue
            function = _function(name, value, size, kind, binding)
            if function:
                functions.append(function)
            address = value & ~1 if kind == _FUNC else value
            local = binding == _LOCAL
            symbol = Symbol(name, address, size, kind == _FUNC, local, file if local else "")
            self._by_name[_source_name(name) if local else name].append(symbol)
        return functions

    def _gap(self, index: int) -> int:
        """Up to the next function: hand-written assembly often gives no size."""
        start = self._functions[index].start
        if index + 1 < len(self._functions):
            return self._starts[index + 1] - start
        return max((region.end - start for region in (FLASH, RAM) if region.holds(start, start)), default=0)


def _source_name(name: str) -> str:
    """GCC names clones, parts and statics of functions with what C does not allow in a name."""
    return name.partition(".")[0] or name


def _function(name: str, value: int, size: int, kind: int, binding: int) -> _Function | None:
    """A symbol that names code, and how well it names it.

    ST's start-up files make every handler a weak alias of ``Default_Handler``, which is itself a plain label
    with a size: that label is the name to show, not the first handler of the alphabet.
    """
    if kind == _FUNC:
        rank = {_GLOBAL: 0, _LOCAL: 1}.get(binding, 3)
    elif kind == _NOTYPE and size and FLASH.holds(value, value + size):
        rank = 2
    else:
        return None
    return _Function(value & ~1, rank, name, size)
