"""The registers of a part by sub-address, as flat tables. How a register is declared: :mod:`registers`.

Declared registers cost nothing at run time: :class:`RegisterMap` compiles them to flat 128-byte tables.
"""

from __future__ import annotations

from collections.abc import Iterable
from types import ModuleType

from registers import Bits, Register

__all__ = ["ADDRESSES", "Bits", "Register", "RegisterMap"]

ADDRESSES = 128  # 7-bit sub-addresses


class RegisterMap:
    """The registers of one part (or of one of its banks) as flat tables indexed by sub-address."""

    def __init__(self, registers: Iterable[type[Register]]) -> None:
        self.registers = tuple(sorted(registers, key=lambda register: register.addr))
        self.names: list[str | None] = [None] * ADDRESSES
        self.at: list[type[Register] | None] = [None] * ADDRESSES
        reset, mask, unmodelled = bytearray(ADDRESSES), bytearray(ADDRESSES), bytearray(ADDRESSES)
        for register in self.registers:
            first, end = register.addr, register.addr + register.size
            if any(self.at[first:end]):
                raise TypeError(f"{register.__name__}: address 0x{first:02X} is declared twice")
            self.at[first:end] = [register] * register.size
            self.names[first:end] = register.names
            reset[first:end] = register.reset.to_bytes(register.size, "little")
            mask[first:end] = register.write_mask.to_bytes(register.size, "little")
            unmodelled[first:end] = register.unmodelled_mask().to_bytes(register.size, "little")
        self.reset = bytes(reset)
        self.write_mask = bytes(mask)
        self.unmodelled = bytes(unmodelled)

    @classmethod
    def of(cls, namespace: ModuleType | type) -> RegisterMap:
        """The map of every register that a module, or a class standing for a bank, declares."""
        return cls(
            value
            for value in vars(namespace).values()
            if isinstance(value, type) and issubclass(value, Register) and value is not Register
        )

    def without_behaviour(self) -> list[str]:
        """What is known but not modelled: names of whole registers, and of fields as ``REGISTER.FIELD``."""
        names = []
        for register in self.registers:
            if not register.modelled:
                names.append(register.__name__)
                continue
            names += [f"{register.__name__}.{bits.name}" for bits in register.fields if not bits.modelled]
        return names

    def name(self, address: int) -> str:
        """The datasheet's name of the byte at ``address``, or ``reserved``."""
        return self.names[address % ADDRESSES] or "reserved"
