"""The declaration of a peripheral of the chip: its registers, words of 32 bits, and the differences between
peripherals of a kind.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from types import MappingProxyType, ModuleType

from fcu_emulator.sensors.register import Bits, Register

WORD = 0xFFFF_FFFF


class Word(Register, size=4):
    """A register of a peripheral; ``addr`` is its offset."""

    named_bytes = False


@dataclass(frozen=True)
class Variant:
    """A register of one peripheral that differs from those of its kind.

    ``bits``: those that exist, none if the register does not.
    """

    bits: int = WORD
    reset: int | None = None


@dataclass(frozen=True)
class Field:
    """A field of a peripheral's register; ``msb`` down to ``lsb``."""

    name: str
    msb: int
    lsb: int
    bits: Bits


@dataclass(frozen=True)
class PeripheralRegister:
    """A register of one peripheral; one of several (``S3CR``) has its full name."""

    name: str
    offset: int
    reset: int
    exists: int
    """The bits that exist in this peripheral."""
    declared: type[Word]

    @property
    def bits(self) -> int:
        """The bits that are not reserved."""
        used = 0
        for field in self.declared.fields:
            used |= field.mask
        return (used or WORD) & self.exists

    @property
    def stored(self) -> int:
        """The bits that store written values."""
        return self.declared.stored_mask & self.exists

    def fields(self) -> Iterator[Field]:
        """Return the fields as in the manual, the upper ones first."""
        for bits in self.declared.fields:
            if bits.mask & self.exists:
                yield from (
                    Field(bits.numbered(n), bits.msb + n * bits.step, bits.lsb + n * bits.step, bits)
                    for n in range(bits.count)
                )


@dataclass(frozen=True)
class DeclaredPeripheral:
    """A peripheral by the manual's name; ``source`` is the chapter. Its address is the memory map's."""

    name: str
    title: str
    source: str
    registers: tuple[PeripheralRegister, ...]

    @classmethod
    def of(
        cls,
        name: str,
        title: str,
        source: str,
        declared: Iterable[type[Word]],
        variants: Mapping[str, Variant] = MappingProxyType({}),
    ) -> DeclaredPeripheral:
        """Return the peripheral with these registers, except for those that differ in it."""
        registers = []
        for kind in declared:
            for number in range(kind.count):
                own = kind.numbered(number)
                variant = variants.get(own, Variant())
                if variant.bits:
                    reset = kind.reset if variant.reset is None else variant.reset
                    offset = kind.addr + number * kind.step
                    registers.append(PeripheralRegister(own, offset, reset, variant.bits, kind))
        registers.sort(key=lambda register: register.offset)
        return cls(name, title, source, tuple(registers))

    @cached_property
    def names(self) -> dict[int, str]:
        """Return the manual's name of each register, by offset."""
        return {register.offset: register.name for register in self.registers}

    @cached_property
    def resets(self) -> dict[int, int]:
        """Return the value after reset, by offset."""
        return {register.offset: register.reset for register in self.registers}

    @cached_property
    def stored(self) -> dict[int, int]:
        """Return the bits that store written values, by offset."""
        return {register.offset: register.stored for register in self.registers}

    def without_behaviour(self) -> list[str]:
        """Return known but unmodelled parts: whole registers, and fields as ``REGISTER.FIELD``."""
        names: dict[str, None] = {}
        for register in self.registers:
            kind = register.declared
            if not kind.modelled:
                names[kind.__name__] = None
                continue
            fields = (bits for bits in kind.fields if not bits.modelled and bits.mask & register.exists)
            names |= dict.fromkeys(f"{kind.__name__}.{bits.name}" for bits in fields)
        return list(names)


def offsets(*registers: type[Word]) -> tuple[int, ...]:
    """Return their offsets, to be named by the caller."""
    return tuple(register.addr for register in registers)


def masks(*fields: Bits) -> tuple[int, ...]:
    """Return their bits, to be named by the caller."""
    return tuple(bits.mask for bits in fields)


def words(module: ModuleType) -> list[type[Word]]:
    """Return the registers that a module declares, in its order."""
    return [
        value
        for value in vars(module).values()
        if isinstance(value, type) and issubclass(value, Word) and value is not Word
    ]


def peripheral(module: ModuleType, name: str) -> DeclaredPeripheral:
    """Return one of the peripherals of the kind that ``module`` declares."""
    variants = getattr(module, "VARIANTS", {}).get(name, {})
    title = (module.__doc__ or "").partition("\n")[0]
    return DeclaredPeripheral.of(name, title, module.SOURCE, words(module), variants)
