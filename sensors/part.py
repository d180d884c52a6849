"""Base of all sensors: signals, registers, and the I2C protocol (LSM6DSL datasheet 6.2, LIS2MDL 6.1, LPS22HB 7.2).

Decision: while a sensor loads its trimming values after power-on, it does not acknowledge its address. The documents only
say "not accessible" (AN5040 5.7, AN5069 3).
"""

from __future__ import annotations

import warnings
from array import array
from collections.abc import Callable, Mapping
from typing import Any, ClassVar, Protocol, Self, TypeAlias, cast, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from fcu_emulator.sensors.declaration import Bus, Function, Quantity, Wires
from fcu_emulator.sensors.errors import PartErrors
from fcu_emulator.sensors.pin import Pin
from fcu_emulator.sensors.register import ADDRESSES, Register, RegisterMap
from fcu_emulator.sensors.register_file import (
    NEVER_PS,
    AccessError,
    BurstReader,
    NoteCallback,
    RegisterFile,
    WriteLog,
)
from fcu_emulator.sensors.sampling import PS_PER_S, SampleStream, Times

# -- measured signals ---------------------------------------------------------------------------------------


Signal: TypeAlias = Callable[[Times], NDArray[np.float64]]
"""A quantity at n times, with shape (n, 3) in the sensor's axes, or (n,). If the quantity's ``one_row`` is True, a
constant signal may return a single row.

If a signal is a plain function, it must return filtered values.
"""


@runtime_checkable
class DynamicSignal(Protocol):
    """A signal that reports its intervals of fast motion, in which the sensor model samples it densely."""

    def __call__(self, t_s: Times, /) -> NDArray[np.float64]: ...

    def agitated(self, from_s: float, to_s: float, pace_s: float) -> list[tuple[float, float]]:
        """Return the intervals in which the signal jumps, or moves from rest to rest in less than ``pace_s``."""
        ...


# -- register access ----------------------------------------------------------------------------------------


class Read(Protocol):
    """A burst read. Raises AccessError."""

    def __call__(self, address: int, count: int, now_ps: int) -> bytes: ...


class Write(Protocol):
    """A burst write. Raises AccessError, or TypeError for data other than bytes."""

    def __call__(self, address: int, data: bytes, now_ps: int) -> None: ...


# -- the sensor ---------------------------------------------------------------------------------------------


_PS_PER_MS = PS_PER_S // 1000


class Sensor:
    """Base class of a sensor model: registers, samples and pins.

    ``read`` and ``write`` are instance attributes that refer to the register file, for speed. While a pin is wired,
    each register read calls the sensor, because a read can change the time of the next edge.
    """

    NAME: ClassVar[str]
    WHO_AM_I: ClassVar[int]
    MAP: ClassVar[RegisterMap]
    SIGNALS: ClassVar[tuple[Quantity, ...]]
    BUS: ClassVar[Bus]
    ERRORS: ClassVar[type[PartErrors]]
    FUNCTIONS: ClassVar[tuple[Function, ...]]

    @classmethod
    def build(
        cls,
        signals: Mapping[str, Signal],
        errors: PartErrors | None = None,
        seed: int = 0,
        powered_on_ps: int | None = None,
    ) -> Self:
        """Build the sensor; KeyError if a signal is missing.

        ``errors``: None for an ideal sensor; ``powered_on_ps``: power-on time; None if start-up is already over.
        """
        construct: Callable[..., Self] = cls
        own = [signals[quantity.name] for quantity in cls.SIGNALS]
        return construct(*own, errors, seed, powered_on_ps=powered_on_ps)

    @classmethod
    def maps(cls) -> dict[str, RegisterMap]:
        """Return every register map, keyed by title; the main map's title is empty."""
        return {"": cls.MAP}

    def __init__(
        self, registers: RegisterMap, wrap: Mapping[int, int] | None = None, accessible_ps: int = 0
    ) -> None:
        """``wrap``: address jumps within a burst; ``accessible_ps``: time from which the sensor answers."""
        self.registers = RegisterFile(registers, wrap)
        self.version = self.registers.version
        self._accessible_ps = accessible_ps
        self._accessed: Callable[[], None] | None = None
        self.i2c_off = False  # set by firmware that uses SPI (I2C_disable, I2C_DIS)
        self.streams: tuple[SampleStream, ...] = ()
        """All sample streams; the subclass's constructor sets them."""
        self._activate(self.registers)

    def _activate(self, registers: RegisterFile) -> None:
        self.active = registers
        self.read: Read = registers.read
        self.write: Write = _checked(self._writer(registers), self.registers.take_back)
        self.advance = registers.advance
        self.burst_reader: Callable[[int, int], BurstReader] = registers.burst_reader
        if self._accessed is not None:
            self.read = _read_then(self.read, self._accessed)
            self.burst_reader = _burst_reader_of(self.read)
            self.write = _write_then(self.write, self._accessed)

    def _writer(self, registers: RegisterFile) -> Write:
        return registers.write

    def watch(self, accessed: Callable[[], None]) -> None:
        """Call ``accessed()`` after every register access, because an access can change the time of the next pin edge."""
        self._accessed = accessed
        self.version[0] += 1
        self._activate(self.active)

    def shared_bank(self) -> int:
        """Return the address of the registers that C can read, or 0 while Python must handle every read."""
        return 0 if self._accessed is not None else self.active.shared_bank()

    def files(self) -> tuple[RegisterFile, ...]:
        return (self.registers,)

    def observe(self, note: NoteCallback, write_log: WriteLog | None) -> None:
        """Report notes, and register writes if ``write_log`` is given."""
        for registers in self.files():
            registers.note, registers.write_log = note, write_log

    def register_name(self, address: int) -> str:
        return self.active.map.name(address & 0x7F)

    def accessible(self, now_ps: int) -> bool:
        """Return whether the sensor has loaded its trimming values, so that it answers on the bus."""
        return now_ps >= self._accessible_ps

    def refuse(self, now_ps: int) -> None:
        from_ms = self._accessible_ps / _PS_PER_MS
        self.registers.note(
            now_ps,
            "not accessible",
            "loading",
            f"trimming values are loaded until the time {from_ms:g} ms",
            until_ms=from_ms,
        )

    def supply_current_ua(self) -> float:
        """Return the supply current in microampere as configured."""
        raise AssertionError(f"{type(self).__name__} has no supply")

    def spi_wires(self) -> Wires:
        return 4

    def pins(self) -> tuple[Pin, ...]:
        """The interrupt and data-ready pins."""
        return ()

    def catch_up(self, now_ps: int) -> None:
        """Do all work that is due until ``now_ps``."""

    def next_event_ps(self) -> int:
        """Return when a wired pin may change, or ``NEVER_PS``."""
        return NEVER_PS

    def world_changed(self, now_ps: int | None = None) -> None:
        """Discard samples computed ahead, because the signals change at ``now_ps``."""
        if not any(stream.running for stream in self.streams):
            return
        self.registers.take_back()
        if now_ps is not None:
            self.catch_up(now_ps)
        for stream in self.streams:
            stream.world_changed(now_ps)

    def sample_range(self, channel: str) -> tuple[float, float, float]:
        """Return the lowest value, highest value and LSB of ``channel``, in the channel's unit."""
        raise KeyError(channel)


def _burst_reader_of(read: Read) -> Callable[[int, int], BurstReader]:
    def burst_reader(address: int, count: int) -> BurstReader:
        return lambda now_ps: (read(address, count, now_ps), 0)

    return burst_reader


def _checked(write: Write, take_back: Callable[[], None]) -> Write:
    def checked(address: int, data: bytes, now_ps: int) -> None:
        if not isinstance(data, bytes | bytearray):
            raise TypeError(f"cannot write {data!r} at sub-address {address!r}; give bytes")
        if not data or not 0 <= address < ADDRESSES:
            raise AccessError("write", address, len(data))
        take_back()
        write(address, data, now_ps)

    return checked


def _read_then(read: Read, then: Callable[[], None]) -> Read:
    def read_then(address: int, count: int, now_ps: int) -> bytes:
        data = read(address, count, now_ps)
        then()
        return data

    return read_then


def _write_then(write: Write, then: Callable[[], None]) -> Write:
    def write_then(address: int, data: bytes, now_ps: int) -> None:
        write(address, data, now_ps)
        then()

    return write_then


# -- self-clearing bits -------------------------------------------------------------------------------------


class SelfClearingBits:
    """Bits that read 1 for some time after a write (BOOT, SW_RESET)."""

    def __init__(self, registers: RegisterFile, register: type[Register]) -> None:
        self._mem = registers.mem
        self._address = register.addr
        self._due: list[tuple[int, int]] = []

    def begin(self, mask: int, until_ps: int) -> None:
        self._mem[self._address] |= mask
        self._due.append((until_ps, mask))

    def pending(self, mask: int, now_ps: int) -> bool:
        return any(until > now_ps and bits & mask for until, bits in self._due)

    def before_read(self, first: int, end: int, now_ps: int) -> None:
        del first, end
        if self._due:
            for until, mask in self._due:
                if until <= now_ps:
                    self._mem[self._address] &= ~mask
            self._due = [entry for entry in self._due if entry[0] > now_ps]
            for _, mask in self._due:  # the bit was set again or written with 0 meanwhile
                self._mem[self._address] |= mask


# -- I2C interface -----------------------------------------------------------------------------------------


class _IncrementBit:
    """Wrapper of a sensor; a bit of the address enables the increment."""

    def __init__(self, part: Sensor, bit: int) -> None:
        self._part = part
        self._bit = bit

    def __getattr__(self, name: str) -> Any:
        return getattr(self._part, name)

    def read(self, address: int, count: int, now_ps: int) -> bytes:
        register = address & ~self._bit
        if address & self._bit:
            return self._part.read(register, count, now_ps)
        return b"".join(self._part.read(register, 1, now_ps) for _ in range(count))

    def write(self, address: int, data: bytes, now_ps: int) -> None:
        register = address & ~self._bit
        if address & self._bit:
            self._part.write(register, data, now_ps)
            return
        for value in data:
            self._part.write(register, bytes((value,)), now_ps)

    def advance(self, address: int, count: int) -> int:
        if not address & self._bit:
            return address
        return self._part.advance(address & ~self._bit, count) | self._bit

    def register_name(self, address: int) -> str:
        return self._part.register_name(address & ~self._bit)

    def burst_reader(self, address: int, count: int) -> BurstReader:
        if address & self._bit:
            return self._part.burst_reader(address & ~self._bit, count)
        return lambda now_ps: (self.read(address, count, now_ps), 0)


def with_increment_bit(part: Sensor, bit: int) -> Sensor:
    """Return the sensor with an address ``bit`` that enables the increment."""
    return cast("Sensor", _IncrementBit(part, bit)) if bit else part


class SubaddressTarget:
    """I2C interface of one sensor."""

    def __init__(self, part: Sensor, now_ps: Callable[[], int]) -> None:
        self.increment_bit = bit = part.BUS.i2c_increment_bit
        self.part = with_increment_bit(part, bit)
        self._now_ps = now_ps
        self.address_mask = ADDRESSES - 1 | bit
        """Bits of a sub-address that the sensor evaluates."""
        self.last_burst = (0, 0)
        """Sub-address and length of the latest read or write; the next transfer continues after these bytes."""
        self._expects_subaddress = False
        self._booting = not part.accessible(now_ps())  # checked again only while it is True

    def start(self, *, read: bool) -> bool:
        """Begin a transfer; return True to acknowledge."""
        self._expects_subaddress = not read
        if not self._booting:
            return not self.part.i2c_off
        answers = self.answers()
        if self._booting:
            self.part.refuse(self._now_ps())
        return answers

    def write(self, data: bytes) -> int:
        payload = data
        if self._expects_subaddress and data:
            self.last_burst = (data[0] & self.address_mask, 0)
            self._expects_subaddress = False
            payload = data[1:]
        if payload:
            address = self.position
            self.part.write(address, payload, self._now_ps())
            self.last_burst = (address, len(payload))
        return len(data)

    def read(self, count: int) -> bytes:
        address = self.position
        data = self.part.read(address, count, self._now_ps())
        self.last_burst = (address, count)
        return data

    def shared_bank(self) -> int | None:
        """Return the sensor's :meth:`Sensor.shared_bank`, or None if the sensor does not answer."""
        return self.part.shared_bank() if self.answers() else None

    def move_to(self, subaddress: int) -> None:
        """Set the next sub-address to ``subaddress``, after C has read registers directly."""
        self.last_burst = (subaddress, 0)
        self._expects_subaddress = False

    @property
    def version(self) -> array[int]:
        """Counter of the sensor's state changes."""
        return self.part.version

    @property
    def position(self) -> int:
        address, count = self.last_burst
        if count:
            address = self.part.advance(address, count)
            self.last_burst = (address, 0)
        return address

    def stop(self) -> None:
        self._expects_subaddress = False

    def read_from(self, subaddress: int, count: int, now_ps: int) -> bytes | None:
        """Write a sub-address and read ``count`` bytes; return None if the sensor does not answer."""
        if not self.answers():
            return None
        address = subaddress & self.address_mask
        self.last_burst = (address, count)
        return self.part.read(address, count, now_ps)

    def name(self) -> str:
        return self.part.NAME

    def register_name(self, address: int) -> str:
        return self.part.register_name(address)

    def answers(self) -> bool:
        """Return whether the sensor acknowledges its address. If the result is True, it is valid until the next write."""
        if self._booting:
            self._booting = not self.part.accessible(self._now_ps())
        return not self._booting and not self.part.i2c_off


def __getattr__(name: str) -> type[Sensor]:
    """Return :class:`Sensor` for its former name."""
    if name != "Part":
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    warnings.warn("Part is now called Sensor; use that name", DeprecationWarning, stacklevel=2)
    return Sensor
