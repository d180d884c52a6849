"""Declarations of 32-bit registers, and of differences between peripherals of the same kind."""

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
    """A register that differs from the declaration of its kind; ``bits`` are the bits that exist."""

    bits: int = WORD
    reset: int | None = None


@dataclass(frozen=True)
class Field:
    """A field from ``msb`` down to ``lsb``."""

    name: str
    msb: int
    lsb: int
    bits: Bits


@dataclass(frozen=True)
class PeripheralRegister:
    """A register of one peripheral, with a full name such as ``S3CR``."""

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
        return self.declared.stored_mask & self.exists

    def fields(self) -> Iterator[Field]:
        """Return the fields, the upper fields first."""
        for bits in self.declared.fields:
            if bits.mask & self.exists:
                yield from (
                    Field(bits.numbered(n), bits.msb + n * bits.step, bits.lsb + n * bits.step, bits)
                    for n in range(bits.count)
                )


@dataclass(frozen=True)
class DeclaredPeripheral:
    """A peripheral with its name in the manual; ``source`` is the chapter."""

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
    def by_offset(self) -> dict[int, PeripheralRegister]:
        return {register.offset: register for register in self.registers}

    @cached_property
    def names(self) -> dict[int, str]:
        return {register.offset: register.name for register in self.registers}

    @cached_property
    def resets(self) -> dict[int, int]:
        """Values after reset, by offset."""
        return {register.offset: register.reset for register in self.registers}

    @cached_property
    def stored(self) -> dict[int, int]:
        """Bits that store written values, by offset."""
        return {register.offset: register.stored for register in self.registers}

    def without_behaviour(self) -> list[str]:
        """Return unmodelled registers, and unmodelled fields as ``REGISTER.FIELD``."""
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
    """Return the offsets of registers."""
    return tuple(register.addr for register in registers)


def masks(*fields: Bits) -> tuple[int, ...]:
    """Return the masks of fields."""
    return tuple(bits.mask for bits in fields)


def words(module: ModuleType) -> list[type[Word]]:
    """Return the registers that a module declares."""
    return [
        value
        for value in vars(module).values()
        if isinstance(value, type) and issubclass(value, Word) and value is not Word
    ]


def peripheral(module: ModuleType, name: str) -> DeclaredPeripheral:
    """Return a peripheral of the kind that ``module`` declares."""
    variants = getattr(module, "VARIANTS", {}).get(name, {})
    title = (module.__doc__ or "").partition("\n")[0]
    return DeclaredPeripheral.of(name, title, module.SOURCE, words(module), variants)
