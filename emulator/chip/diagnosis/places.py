"""Addresses in a student's words: function and source line, as far as the file tells."""

from __future__ import annotations

from emulator.chip.image import FirmwareImage
from emulator.chip.image.symbols import FunctionAt


class Places:
    """Names of addresses of one firmware; stripped firmware has numbers only."""

    def __init__(self, image: FirmwareImage) -> None:
        self._symbols = image.symbols
        self.stack_top = image.stack_pointer

    def function(self, address: int) -> FunctionAt | None:
        """The function that holds an address."""
        return self._symbols.function_at(address) if self._symbols else None

    def function_name(self, address: int) -> str:
        """Its name; empty where there is none."""
        found = self.function(address)
        return found.name if found else ""

    def place(self, address: int) -> str:
        """``main(), main.c:42``; without line numbers ``main() + 0x1C``; without symbols the address."""
        function = self.function(address)
        line = self._symbols.line_at(address) if self._symbols else None
        if function is None:
            return f"{line}" if line else f"0x{address:08X}"
        if line is None:
            return f"{function.name}() + 0x{function.offset:X} (0x{address:08X})"
        return f"{function.name}(), {line}"

    def variable(self, address: int) -> str:
        """The variable at an address, or the address."""
        symbol = self._symbols.object_at(address) if self._symbols else None
        return symbol.name if symbol else f"the variable at 0x{address:08X}"

    def address_of(self, *names: str) -> int | None:
        """The address of the first symbol of these names that there is."""
        for name in names:
            try:
                return self._symbols.address_of(name) if self._symbols else None
            except KeyError:
                continue
        return None

    def end_of_variables(self) -> int | None:
        """Where ``.bss`` ends and heap and stack may begin, by the linker script's usual symbols."""
        return self.address_of("_end", "end", "_ebss", "__bss_end__")

    def help(self) -> list[str]:
        """What to do for better names."""
        if self._symbols is None:
            return ["The file has no symbols, so these are addresses; run the ELF that was not stripped."]
        return []
