"""Declarations of registers and their bits: 8-bit registers of the sensors and 32-bit registers of the chip.

A register is a class::

    class CTRL1_XL(Register, addr=0x10):
        \"\"\"Accelerometer control 1.\"\"\"
        ODR_XL = Bits(7, 4, doc="output data rate")
        BW0_XL = Bits(0, modelled=False, doc="analog chain bandwidth")

Decision: registers are classes rather than tables of tuples. An editor completes their names, and a misspelt field
fails at import. A bit is modelled, not modelled (it can be written and read back, with a note), or reserved (not
declared). This package imports no other package, so the classes are here.
"""

from __future__ import annotations

from collections.abc import Iterable
from types import ModuleType
from typing import ClassVar, Final

ACCESSES: Final = ("rw", "r", "w", "rc_w0", "rc_w1", "rs")
"""In order: read and write; read; write; cleared by writing 0; cleared by writing 1; set by writing 1."""


class Bits:
    """Bits ``msb`` down to ``lsb`` of a register.

    ``access``: access to the field, if it differs from the register's access. ``count``: number of equal fields, which
    are ``step`` bits apart; in their names a number, counted from ``first``, replaces the ``x``. ``overlay``: True for
    a second meaning of bits that another field declares.
    """

    __slots__ = (
        "access",
        "count",
        "doc",
        "first",
        "lsb",
        "mask",
        "modelled",
        "msb",
        "name",
        "overlay",
        "step",
    )

    def __init__(
        self,
        msb: int,
        lsb: int | None = None,
        *,
        modelled: bool = True,
        doc: str = "",
        name: str = "",
        access: str = "",
        count: int = 1,
        step: int = 0,
        first: int = 0,
        overlay: bool = False,
    ) -> None:
        self.msb = msb
        self.lsb = msb if lsb is None else lsb
        self.count, self.first, self.overlay = count, first, overlay
        self.step = step or self.msb + 1 - self.lsb
        one = (1 << (self.msb + 1)) - (1 << self.lsb)
        self.mask = sum(one << number * self.step for number in range(count))
        """All bits of the field, or of all fields if there are several."""
        self.modelled = modelled
        self.doc = doc
        self.name = name
        self.access = access

    def __set_name__(self, owner: type, name: str) -> None:
        self.name = self.name or name

    def get(self, value: int) -> int:
        return (value & self.mask) >> self.lsb

    def put(self, value: int, field: int) -> int:
        return (value & ~self.mask) | ((field << self.lsb) & self.mask)

    def numbered(self, number: int) -> str:
        """Return the name of field ``number``, counted from 0, for example ``MODER3``."""
        return self.name.replace("x", str(self.first + number)) if self.count > 1 else self.name


class Register:
    """Base of every declared register.

    ``addr``: first sub-address or offset; None for a base class. ``size``: number of bytes. ``reset``: value after
    reset, little endian. ``names``: names of the bytes. ``modelled=False``: the register has no behaviour. ``count``,
    ``step`` (bytes), ``first``: as for :class:`Bits`.
    """

    addr: ClassVar[int]
    size: ClassVar[int] = 1
    named_bytes: ClassVar[bool] = True
    """Whether each byte has a name. True for sensors, because their registers are addressed by byte."""
    access: ClassVar[str]
    reset: ClassVar[int]
    modelled: ClassVar[bool]
    names: ClassVar[tuple[str, ...]]
    count: ClassVar[int]
    step: ClassVar[int]
    first: ClassVar[int]
    fields: ClassVar[tuple[Bits, ...]]
    write_mask: ClassVar[int]
    """Bits on which a write has an effect: "rw" and "w"."""
    stored_mask: ClassVar[int]
    """Bits that keep a written value: "rw"."""

    @classmethod
    def meaning(cls) -> str:
        return (cls.__doc__ or "").strip().partition("\n")[0]

    def __init_subclass__(
        cls,
        *,
        addr: int | None = None,
        size: int | None = None,
        access: str = "rw",
        reset: int = 0,
        names: tuple[str, ...] = (),
        modelled: bool = True,
        count: int = 1,
        step: int = 0,
        first: int = 0,
    ) -> None:
        if size is not None:
            cls.size = size
        if addr is None:
            return
        cls.addr, cls.access, cls.reset, cls.modelled = addr, access, reset, modelled
        cls.count, cls.step, cls.first = count, step, first
        cls.names = names or ((cls.__name__,) if cls.size == 1 else ())
        kinds = reversed(cls.__mro__)  # a derived register inherits fields
        cls.fields = tuple(
            value for kind in kinds for value in vars(kind).values() if isinstance(value, Bits)
        )
        if cls.named_bytes and len(cls.names) != cls.size:
            raise TypeError(f"{cls.__name__}: a register of {cls.size} bytes needs a name for each")
        if sum(bits.mask for bits in cls.fields if not bits.overlay) != cls._used():
            raise TypeError(f"{cls.__name__}: fields overlap")
        unknown = {access, *(bits.access or access for bits in cls.fields)} - set(ACCESSES)
        if unknown:
            raise TypeError(f"{cls.__name__}: unknown access {unknown}; known: {', '.join(ACCESSES)}")
        cls.write_mask = cls._accessed("rw", "w")
        cls.stored_mask = cls._accessed("rw")

    @classmethod
    def _used(cls) -> int:
        used = 0
        for bits in cls.fields:
            used |= bits.mask
        return used

    @classmethod
    def _accessed(cls, *accesses: str) -> int:
        if not cls.fields:
            return (1 << (8 * cls.size)) - 1 if cls.access in accesses else 0
        mask = 0
        for bits in cls.fields:
            if (bits.access or cls.access) in accesses:
                mask |= bits.mask
        return mask

    @classmethod
    def unmodelled_mask(cls) -> int:
        if not cls.modelled:
            return cls.write_mask
        mask = 0
        for bits in cls.fields:
            if not bits.modelled and not bits.overlay:
                mask |= bits.mask
        return mask & cls.write_mask

    @classmethod
    def numbered(cls, number: int) -> str:
        """Return the name of register ``number``, counted from 0, for example ``EXTICR2``."""
        return cls.__name__.replace("x", str(cls.first + number)) if cls.count > 1 else cls.__name__


# -- a sensor's registers by sub-address ---------------------------------------------------------------

ADDRESSES = 128  # 7-bit sub-addresses


class RegisterMap:
    """Registers of one sensor or bank, as flat tables that are indexed by sub-address."""

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
        """Return the map of a module's or class's registers."""
        return cls(
            value
            for value in vars(namespace).values()
            if isinstance(value, type) and issubclass(value, Register) and value is not Register
        )

    def without_behaviour(self) -> list[str]:
        """Return the names of registers and bits that have no behaviour."""
        names = []
        for register in self.registers:
            if not register.modelled:
                names.append(register.__name__)
                continue
            names += [f"{register.__name__}.{bits.name}" for bits in register.fields if not bits.modelled]
        return names

    def name(self, address: int) -> str:
        """Return the byte's name, or ``reserved``."""
        return self.names[address % ADDRESSES] or "reserved"
