"""What a program's names and lines are: the one face of symbol table and debug information.

Everything is read on first use and kept. What is damaged or missing answers "unknown" and leaves a note; it
never stops a run. The readers of debug information are imported when they are first needed: a run starts
sooner without them.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property
from typing import TYPE_CHECKING

from emulator.chip.image.cursor import Budget
from emulator.chip.image.lines import LineTable, SourceLine
from emulator.chip.image.memory_map import fits
from emulator.chip.image.sections import DebugInfoError, Sections
from emulator.chip.image.symbol_table import FunctionAt, Symbol, SymbolTable

if TYPE_CHECKING:
    from emulator.chip.image.c_types import CType, CValue
    from emulator.chip.image.variables import Variables

ReadMemory = Callable[[int, int], bytes]
"""``read_memory(address, size)`` gives that many bytes of flash or RAM."""


class Symbols:
    """Functions, source lines and variables of one ELF file."""

    def __init__(self, sections: Sections) -> None:
        self._sections = sections
        self._budget = Budget()
        self.notes: list[str] = []
        """What could not be read, one line each."""

    @property
    def work(self) -> int:
        """Steps taken so far to read debug information; tests hold it against the file's size."""
        return self._budget.spent

    def function_at(self, address: int) -> FunctionAt | None:
        """The function that ``address`` lies in; bit 0 (Thumb) is ignored."""
        return self._table.function_at(address) if self._table else None

    def line_at(self, address: int) -> SourceLine | None:
        """The source line of the instruction at ``address``; bit 0 (Thumb) is ignored."""
        return self._lines.line_at(address)

    def address_of(self, name: str) -> int:
        """Address of a function (even) or variable by its C name. Raises KeyError."""
        return self._symbol(name).address

    def object_at(self, address: int) -> Symbol | None:
        """The variable that ``address`` lies in."""
        return self._table.object_at(address) if self._table else None

    def read_variable(self, name: str, read_memory: ReadMemory) -> CValue:
        """The value of a global or static variable by its C name, by the type it was compiled with.

        int for integers, enumerations and pointers, bool, float, a tuple for an array, and for a structure
        or union an object with the members' names: ``read_variable("acc", read).AXIS_X``. Raises KeyError
        if there is no such variable, if several statics have the name, or if its type is unknown.
        """
        symbol = self._symbol(name)
        if symbol.is_function:
            raise KeyError(f"{name!r} is a function, not a variable")
        try:
            kind = self._type(symbol.address)
        except DebugInfoError as problem:
            raise KeyError(f"the type of {name!r} is unknown: {problem}") from None
        if not fits(symbol.address, symbol.address + kind.size):
            raise KeyError(f"{name!r} lies at 0x{symbol.address:08X}, outside the chip's memories")
        return kind.value(read_memory(symbol.address, kind.size) if kind.size else b"", 0)

    def _symbol(self, name: str) -> Symbol:
        found = self._table.named(name) if self._table else []
        if not found:
            raise KeyError(f"the firmware has no variable or function {name!r}")
        if len(found) > 1:
            files = ", ".join(sorted({symbol.file or "?" for symbol in found}))
            raise KeyError(f"{name!r} is static {len(found)} times ({files}); give one of them another name")
        return found[0]

    def _type(self, address: int) -> CType:
        if self._variables is None:
            raise DebugInfoError("the debug information cannot be read")
        return self._variables.type_at(address)

    @cached_property
    def _table(self) -> SymbolTable | None:
        try:
            return SymbolTable(self._sections)
        except DebugInfoError as problem:
            self.notes.append(f"no symbols: {problem}")
            return None

    @cached_property
    def _lines(self) -> LineTable:
        from emulator.chip.image.line_program import read_sequences

        try:
            return LineTable(read_sequences(self._sections, self._budget))
        except DebugInfoError as problem:
            self.notes.append(f"no source lines: {problem}")
            return LineTable(())

    @cached_property
    def _variables(self) -> Variables | None:
        from emulator.chip.image.debug_info import DebugInfo
        from emulator.chip.image.variables import Variables

        try:
            return Variables(DebugInfo(self._sections, self._budget))
        except DebugInfoError as problem:
            self.notes.append(f"no types of variables: {problem}")
            return None
