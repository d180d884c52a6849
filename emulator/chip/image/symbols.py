"""Names and lines of a program. Damaged parts cause only a note.

Decision: the symbol table is indexed on its first use, in one pass. If a run never uses the symbol
table, it costs nothing.
"""

from __future__ import annotations

import struct
from bisect import bisect_right
from collections import defaultdict
from collections.abc import Callable
from difflib import get_close_matches
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple

from fcu_emulator.emulator.chip.image.elf import DebugInfoError, Sections, printable, string_at
from fcu_emulator.emulator.chip.memory_map import FLASH_MEMORY, RAM_MEMORY, fits
from fcu_emulator.emulator.errors import SymbolError

if TYPE_CHECKING:
    from fcu_emulator.emulator.chip.image.c_types import CType, CValue, Variables
    from fcu_emulator.emulator.chip.image.dwarf import Budget
    from fcu_emulator.emulator.chip.image.functions import Functions, Signature
    from fcu_emulator.emulator.chip.image.lines import LineTable, SourceLine


# -- the symbol table ---------------------------------------------------------------------------------------

_SYMBOL = struct.Struct("<3I2BH")
_MAX_SYMBOLS = 1 << 18  # more than fit into this chip's flash
_LONGEST_NAME = 256
_NOTYPE, _OBJECT, _FUNC, _FILE = 0, 1, 2, 4
_LOCAL, _GLOBAL, _WEAK = 0, 1, 2
_UNDEFINED = 0


class Definition(NamedTuple):
    """A function's definition; ``address`` is None if the image does not have the function."""

    is_inlined: bool
    address: int | None
    size: int


class FunctionAt(NamedTuple):
    """The function that contains an address. The address is ``offset`` bytes after the even ``start``.

    ``name`` is the source name: ``main`` for ``main.constprop.0``.
    """

    name: str
    start: int
    size: int
    offset: int


class Symbol(NamedTuple):
    """A function or variable. If it is static, ``file`` is its source file."""

    name: str
    address: int
    size: int
    is_function: bool
    is_local: bool
    file: str


class _Function(NamedTuple):
    start: int
    rank: int  # if functions have the same start, the function with the lowest rank is used
    name: str
    size: int


class SymbolTable:
    """The functions and variables of ``.symtab``. Raises DebugInfoError."""

    def __init__(self, sections: Sections) -> None:
        self._by_name: dict[str, list[Symbol]] = defaultdict(list)
        table, strings = sections.get(".symtab"), sections.linked(".symtab")
        if len(table) // _SYMBOL.size > _MAX_SYMBOLS:
            raise DebugInfoError(f"the symbol table has more than {_MAX_SYMBOLS} entries")
        functions = self._read(table[: len(table) - len(table) % _SYMBOL.size], strings)
        best: dict[int, _Function] = {}
        for function in sorted(functions):
            best.setdefault(function.start, function)
        self._functions = list(best.values())
        self._starts = list(best)

    def function_at(self, address: int) -> FunctionAt | None:
        """Return the function at ``address``; bit 0 (Thumb) is ignored."""
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
        """Return the global symbol or, if there is none, all static symbols, such as ``count.0`` for ``count``."""
        symbols = self._by_name.get(name, [])
        return [symbol for symbol in symbols if not symbol.is_local][:1] or symbols

    def names(self) -> list[str]:
        return list(self._by_name)

    def object_at(self, address: int) -> Symbol | None:
        for symbols in self._by_name.values():
            for symbol in symbols:
                if not symbol.is_function and symbol.address <= address < symbol.address + symbol.size:
                    return symbol
        return None

    def variables(self) -> list[Symbol]:
        every = (symbol for symbols in self._by_name.values() for symbol in symbols)
        return [
            one
            for one in every
            if not one.is_function and RAM_MEMORY.holds(one.address, one.address + one.size)
        ]

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
        """Return the distance to the next function. It replaces the size of a function in assembly, which may
        be missing."""
        start = self._functions[index].start
        if index + 1 < len(self._functions):
            return self._starts[index + 1] - start
        return max(
            (region.end - start for region in (FLASH_MEMORY, RAM_MEMORY) if region.holds(start, start)),
            default=0,
        )


def _source_name(name: str) -> str:
    """Return the name without GCC's suffixes."""
    return name.partition(".")[0] or name


def _function(name: str, value: int, size: int, kind: int, binding: int) -> _Function | None:
    """Return a function with the rank of its name: ``Default_Handler`` precedes its weak aliases."""
    if kind == _FUNC:
        rank = {_GLOBAL: 0, _LOCAL: 1}.get(binding, 3)
    elif kind == _NOTYPE and size and FLASH_MEMORY.holds(value, value + size):
        rank = 2
    else:
        return None
    return _Function(value & ~1, rank, name, size)


# -- names, lines and variables -----------------------------------------------------------------------------

ReadMemory = Callable[[int, int], bytes]
"""``read_memory(address, size)`` returns bytes of flash or RAM."""


class Symbols:
    """Functions, lines and variables of one ELF file."""

    def __init__(self, sections: Sections) -> None:
        self._sections = sections
        self.notes: list[str] = []
        """The parts that could not be read, one line each."""

    @property
    def work(self) -> int:
        return self._budget.spent

    def function_at(self, address: int) -> FunctionAt | None:
        return self._table.function_at(address) if self._table else None

    def line_at(self, address: int) -> SourceLine | None:
        return self._lines.line_at(address)

    def __contains__(self, name: str) -> bool:
        try:
            self.address_of(name)
        except SymbolError:
            return False
        return True

    def address_of(self, name: str) -> int:
        return self._symbol(name).address

    def object_at(self, address: int) -> Symbol | None:
        return self._table.object_at(address) if self._table else None

    def member_at(self, address: int) -> str:
        """Return the variable and member at an address, such as ``mag_max.AXIS_Z``; "" if there is none."""
        from fcu_emulator.emulator.chip.image.c_types import member_at

        symbol = self.object_at(address)
        if symbol is None:
            return ""
        try:
            return symbol.name + member_at(self._type(symbol.address), address - symbol.address)
        except DebugInfoError:
            return symbol.name

    def definition_of_variable(self, address: int) -> SourceLine | None:
        """Return the line that defines the variable at an address; None if it is unknown."""
        symbol = self.object_at(address)
        if symbol is None or self._variables is None:
            return None
        try:
            return self._variables.line_at(symbol.address)
        except DebugInfoError:
            return None

    def variables(self) -> list[Symbol]:
        return self._table.variables() if self._table else []

    def read_variable(self, name: str, read_memory: ReadMemory) -> CValue:
        """Return a variable's value; structures become objects. Raises SymbolError."""
        address, kind = self.variable_type(name)
        return kind.value(read_memory(address, kind.size) if kind.size else b"", 0)

    def variable_type(self, name: str) -> tuple[int, CType]:
        """Return a variable's address and type. Raises SymbolError."""
        symbol = self._symbol(name)
        if symbol.is_function:
            raise SymbolError(f"{name!r} must be a variable, not a function", kind="not_a_variable")
        try:
            kind = self._type(symbol.address)
        except DebugInfoError as problem:
            raise SymbolError(f"the type of {name!r} is unknown: {problem}", kind="unknown_type") from None
        if not fits(symbol.address, symbol.address + kind.size):
            raise SymbolError(
                f"{name!r} is at 0x{symbol.address:08X}, outside the chip's memories", kind="outside_memory"
            )
        return symbol.address, kind

    def function(self, name: str) -> tuple[int, Signature]:
        try:
            return self._function(name)
        except DebugInfoError as problem:
            raise SymbolError(
                f"the parameters of {name}() are unknown: {problem}", kind="unknown_type"
            ) from None

    def _function(self, name: str) -> tuple[int, Signature]:
        if self._functions is None:
            raise DebugInfoError("the debug information cannot be read")
        if not (self._table and self._table.named(name)) and self._functions.is_inlined(name):
            raise SymbolError(
                f"cannot call {name}(): the compiler inlined it; "
                "declare it __attribute__((noinline)), or compile with -O0",
                kind="inlined",
            )
        symbol = self._symbol(name)
        if not symbol.is_function:
            raise SymbolError(f"{name!r} must be a function, not a variable", kind="not_a_function")
        if symbol.name != name:
            raise SymbolError(
                f"cannot call {name}(): the compiler specialised it as {symbol.name}; "
                "declare it __attribute__((noinline, noclone)), or compile with -O0",
                kind="cloned",
            )
        return symbol.address, self._functions.signature_at(symbol.address)

    def definition(self, name: str) -> Definition | None:
        """Return the definition of a function, even if the linker has removed it; None if it is unknown."""
        try:
            if self._functions is None or not self._functions.is_defined(name):
                return None
            is_inlined = self._functions.is_inlined(name)
        except DebugInfoError:
            return None
        symbols = self._table.named(name) if self._table else []
        at = self.function_at(symbols[0].address) if symbols else None
        return Definition(is_inlined, at.start if at else None, at.size if at else 0)

    def code_ranges(self, is_wanted: Callable[[str], bool]) -> list[tuple[int, int]]:
        """Return, in ascending order, (begin, end) of the code of source files for which ``is_wanted`` is true."""
        return self._lines.ranges(is_wanted)

    def _symbol(self, name: str) -> Symbol:
        found = self._table.named(name) if self._table else []
        if not found:
            if self._is_removed(name):
                raise SymbolError(
                    f"the linker has removed {name}(), because the program does not call it", kind="removed"
                )
            near = get_close_matches(name, self._table.names() if self._table else [], 1)
            known = f"; did you mean {near[0]!r}?" if near else ""
            raise SymbolError(f"unknown variable or function {name!r}{known}", kind="unknown_name")
        if len(found) > 1:
            files = ", ".join(sorted({symbol.file or "?" for symbol in found}))
            raise SymbolError(
                f"{name!r} is static {len(found)} times ({files}); rename one of them", kind="ambiguous_name"
            )
        return found[0]

    def _is_removed(self, name: str) -> bool:
        definition = self.definition(name)
        return definition is not None and not definition.is_inlined and definition.address is None

    def _type(self, address: int) -> CType:
        if self._variables is None:
            raise DebugInfoError("the debug information cannot be read")
        return self._variables.type_at(address)

    @cached_property
    def _budget(self) -> Budget:
        from fcu_emulator.emulator.chip.image.dwarf import Budget

        return Budget()

    @cached_property
    def _table(self) -> SymbolTable | None:
        try:
            return SymbolTable(self._sections)
        except DebugInfoError as problem:
            self.notes.append(f"no symbols: {problem}")
            return None

    @cached_property
    def _lines(self) -> LineTable:
        from fcu_emulator.emulator.chip.image.lines import LineTable, read_sequences

        try:
            return LineTable(read_sequences(self._sections, self._budget))
        except DebugInfoError as problem:
            self.notes.append(f"no source lines: {problem}")
            return LineTable(())

    @cached_property
    def _functions(self) -> Functions | None:
        from fcu_emulator.emulator.chip.image.dwarf import DebugInfo
        from fcu_emulator.emulator.chip.image.functions import Functions

        try:
            return Functions(DebugInfo(self._sections, self._budget))
        except DebugInfoError as problem:
            self.notes.append(f"no types of functions: {problem}")
            return None

    @cached_property
    def _variables(self) -> Variables | None:
        from fcu_emulator.emulator.chip.image.c_types import Variables
        from fcu_emulator.emulator.chip.image.dwarf import DebugInfo

        try:
            return Variables(DebugInfo(self._sections, self._budget))
        except DebugInfoError as problem:
            self.notes.append(f"no types of variables: {problem}")
            return None
