"""Registers and their bits, declared once, in the order of the datasheet's register chapter.

A register is a class::

    class CTRL1_XL(Register, addr=0x10):
        \"\"\"Accelerometer control 1.\"\"\"
        ODR_XL = Bits(7, 4, doc="output data rate")
        BW0_XL = Bits(0, modelled=False, doc="analog chain bandwidth")

Everything else is derived: write mask, reset image, names for the trace, the printed register map, and the
contract tests. Decision: classes rather than tables of tuples, because ``CTRL1_XL.ODR_XL`` is what the
datasheet calls it, an editor completes it, and a misspelt field fails when the module is imported. They cost
nothing at run time: :class:`RegisterMap` compiles them to flat 128-byte tables.

A bit is in one of three honest states: modelled; known but not modelled (``modelled=False``: it can be
written and read back, and touching it is reported by name); reserved (not declared: it never sticks).
"""

from __future__ import annotations

from collections.abc import Iterable
from types import ModuleType
from typing import ClassVar

ADDRESSES = 128  # 7-bit sub-addresses, all three parts


class Bits:
    """A field of a register: bits ``msb`` down to ``lsb`` (one bit when ``lsb`` is left out)."""

    __slots__ = ("doc", "lsb", "mask", "modelled", "msb", "name")

    def __init__(
        self, msb: int, lsb: int | None = None, *, modelled: bool = True, doc: str = "", name: str = ""
    ) -> None:
        self.msb = msb
        self.lsb = msb if lsb is None else lsb
        self.mask = (1 << (self.msb + 1)) - (1 << self.lsb)
        self.modelled = modelled
        self.doc = doc
        self.name = name

    def __set_name__(self, owner: type, name: str) -> None:
        self.name = self.name or name

    def get(self, value: int) -> int:
        """The field's number inside a register value."""
        return (value & self.mask) >> self.lsb

    def put(self, value: int, field: int) -> int:
        """``value`` with the field set to ``field``; its neighbours stay."""
        return (value & ~self.mask) | ((field << self.lsb) & self.mask)


class Register:
    """Base of every declared register; never instantiated.

    ``addr``: first sub-address; ``size``: bytes; ``access``: "rw", "r" or "w"; ``reset``: value after reset
    (little-endian over the bytes); ``write_mask``: only where a register without fields is not writable as a
    whole; ``names``: the datasheet's name of each byte of a larger register; ``modelled=False``: the
    whole register is known but has no behaviour here.
    """

    addr: ClassVar[int]
    size: ClassVar[int]
    access: ClassVar[str]
    reset: ClassVar[int]
    modelled: ClassVar[bool]
    names: ClassVar[tuple[str, ...]]
    fields: ClassVar[tuple[Bits, ...]]
    write_mask: ClassVar[int]

    def __init_subclass__(
        cls,
        *,
        addr: int,
        size: int = 1,
        access: str = "rw",
        reset: int = 0,
        names: tuple[str, ...] = (),
        modelled: bool = True,
    ) -> None:
        cls.addr, cls.size, cls.access, cls.reset, cls.modelled = addr, size, access, reset, modelled
        cls.names = names or ((cls.__name__,) if size == 1 else ())
        cls.fields = tuple(value for value in vars(cls).values() if isinstance(value, Bits))
        if len(cls.names) != size:
            raise TypeError(f"{cls.__name__}: a register of {size} bytes needs a name for each")
        if sum(bits.mask for bits in cls.fields) != cls._used():
            raise TypeError(f"{cls.__name__}: fields overlap")
        whole = (1 << (8 * size)) - 1
        cls.write_mask = (cls._used() or whole) if "w" in access else 0

    @classmethod
    def _used(cls) -> int:
        used = 0
        for bits in cls.fields:
            used |= bits.mask
        return used

    @classmethod
    def unmodelled_mask(cls) -> int:
        """The bits that can be written but have no behaviour."""
        if not cls.modelled:
            return cls.write_mask
        mask = 0
        for bits in cls.fields:
            if not bits.modelled:
                mask |= bits.mask
        return mask & cls.write_mask


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
