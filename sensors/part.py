"""What all parts have in common: signals that they measure, registers behind sub-addresses, and the I2C
protocol by which a master reaches these.

After the address byte of an I2C message a write's first byte is the sub-address, the rest is data; a read
goes on at the sub-address left behind (LSM6DSL datasheet 6.2, LIS2MDL 6.1, LPS22HB 7.2). Bit 7 of the
sub-address carries no meaning for these three: the LSM6DSL has none, and the other two increment with and
without it, as drivers of both kinds work on silicon. Where a part asks for a bit, its declaration says which
(:class:`fcu_emulator.sensors.declaration.Bus`), and the address space here is twice as large: the registers, and the
registers with that bit.

Decision: a part that loads its trimming values after power-on does not acknowledge its address; the documents
say "not accessible" only (AN5040 5.7, AN5069 3). The alternative, stretching the clock for 15 ms, is in no
description of these parts' interface.
"""

from __future__ import annotations

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
    NOTHING_PREFETCHED,
    AccessError,
    BurstReader,
    NoteCallback,
    Prefetched,
    RegisterFile,
    WriteLog,
)
from fcu_emulator.sensors.sampling import PS_PER_S, SampleStream, Times

# -- what a part measures -----------------------------------------------------------------------------------


Signal: TypeAlias = Callable[[Times], NDArray[np.float64]]
"""A physical quantity at the given times: shape (n, 3) in the sensor's own axes, or (n,) for a scalar.

Where a part says so, n may be 1 for what is the same at all times asked for. A plain function gives what a
sensor's converter and its filters make of the world; a signal that is :class:`DynamicSignal` is the world itself.
"""


@runtime_checkable
class DynamicSignal(Protocol):
    """A signal that knows when it moves fast and has to be looked at closely (``sensors.front_end``)."""

    def __call__(self, t_s: Times, /) -> NDArray[np.float64]:
        """Return the values at these times, as :data:`Signal`."""
        ...

    def agitated(self, from_s: float, to_s: float, pace_s: float) -> list[tuple[float, float]]:
        """When, between these times, it jumps, or moves from rest to rest in less than ``pace_s``."""
        ...


# -- how its registers are reached --------------------------------------------------------------------------


class Read(Protocol):
    """A burst read. Raises AccessError for one that no bus could carry."""

    def __call__(self, address: int, count: int, now_ps: int) -> bytes:
        """``count`` bytes from ``address`` on."""
        ...


class Write(Protocol):
    """A burst write. Raises AccessError for one that no bus could carry, TypeError for what is no bytes."""

    def __call__(self, address: int, data: bytes, now_ps: int) -> None:
        """Write ``data`` from ``address`` on."""
        ...


class Prefetch(Protocol):
    """See :meth:`RegisterFile.prefetch`."""

    def __call__(self, address: int, count: int, now_ps: int) -> Prefetched:
        """About ``count`` bytes from ``address`` on."""
        ...


# -- a part -------------------------------------------------------------------------------------------------


_PS_PER_MS = PS_PER_S // 1000


class Part:
    """One sensor behind its bus.

    ``read``, ``write``, ``advance``, ``prefetch``, ``consumed`` and ``burst_reader`` are those of its active
    register file. They are instance attributes, so that the 800 Hz path reaches the registers without a
    detour; a part with register banks replaces them when firmware switches. While a pin is wired, every
    access has to be seen, and nothing is prefetched.
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
        """The part in a world that gives ``signals``: those of ``SIGNALS`` by name; others may be there.

        ``errors``: of the type ``ERRORS``, None for an ideal part. ``powered_on_ps``: when supply came, None
        for long ago. Raises KeyError for a signal that is not given.
        """
        construct: Callable[..., Self] = cls
        own = [signals[quantity.name] for quantity in cls.SIGNALS]
        return construct(*own, errors, seed, powered_on_ps=powered_on_ps)

    @classmethod
    def maps(cls) -> dict[str, RegisterMap]:
        """Every register map by the title of its bank; the main one has none."""
        return {"": cls.MAP}

    def __init__(
        self, registers: RegisterMap, wrap: Mapping[int, int] | None = None, accessible_ps: int = 0
    ) -> None:
        """``wrap``: where a burst does not simply go on; ``accessible_ps``: when the part first answers."""
        self.registers = RegisterFile(registers, wrap)
        self.version = self.registers.version
        self._accessible_ps = accessible_ps
        self._accessed: Callable[[], None] | None = None
        self.i2c_off = False  # firmware that uses SPI switches I2C off (I2C_disable, I2C_DIS)
        self.streams: tuple[SampleStream, ...] = ()
        """Of all that it measures; a part's own constructor gives them."""
        self._activate(self.registers)

    def _activate(self, registers: RegisterFile) -> None:
        self.active = registers
        self.read: Read = registers.read
        self.write: Write = _checked(self._writer(registers))
        self.advance = registers.advance
        self.prefetch: Prefetch = registers.prefetch
        self.consumed = registers.consumed
        self.burst_reader: Callable[[int, int], BurstReader] = registers.burst_reader
        if self._accessed is not None:
            self.read = _read_then(self.read, self._accessed)
            self.prefetch, self.burst_reader = _nothing_prefetched, _burst_reader_of(self.read)
            self.write = _write_then(self.write, self._accessed)

    def _writer(self, registers: RegisterFile) -> Write:
        return registers.write

    def watch(self, accessed: Callable[[], None]) -> None:
        """Call ``accessed()`` after every read and write: a pin may change earlier than it would have."""
        self._accessed = accessed
        self.version[0] += 1
        self._activate(self.active)

    def files(self) -> tuple[RegisterFile, ...]:
        """Every register file of the part: the main one and its embedded banks."""
        return (self.registers,)

    def observe(self, note: NoteCallback, write_log: WriteLog | None) -> None:
        """Report notes, and register writes where ``write_log`` is given, to the caller."""
        for registers in self.files():
            registers.note, registers.write_log = note, write_log

    def register_name(self, address: int) -> str:
        """The datasheet's name of the register at a sub-address, in the active bank."""
        return self.active.map.name(address & 0x7F)

    def accessible(self, now_ps: int) -> bool:
        """Whether the registers answer; not while a part just powered on loads its trimming values.

        Its face to the bus asks (:class:`SubaddressTarget`, ``sensors.spi``), not ``read`` and ``write``.
        """
        return now_ps >= self._accessible_ps

    def refuse(self, now_ps: int) -> None:
        """Note that somebody has tried in vain to reach a part that is not accessible yet."""
        from_ms = self._accessible_ps / _PS_PER_MS
        self.registers.note(now_ps, "not accessible", f"trimming values are loaded until {from_ms:g} ms")

    def supply_current_ua(self) -> float:
        """Supply current in microampere as now configured."""
        raise AssertionError(f"{type(self).__name__} has no supply")

    def spi_wires(self) -> Wires:
        """Three wires or four, as configured."""
        return 4

    def pins(self) -> tuple[Pin, ...]:
        """The part's interrupt and data-ready pins."""
        return ()

    def catch_up(self, now_ps: int) -> None:
        """Do all that has become due until ``now_ps``: FIFO, event detection, pins."""

    def next_event_ps(self) -> int:
        """When a wired pin may change next (``NEVER_PS`` if none can)."""
        return NEVER_PS

    def world_changed(self, now_ps: int | None = None) -> None:
        """The physical signals are others from ``now_ps`` on: what was computed ahead is computed anew.

        ``now_ps`` may be left out where no function of the part looks at every sample. A part that measures
        nothing has nothing to forget.
        """
        if not any(stream.running for stream in self.streams):
            return
        if now_ps is not None:
            self.catch_up(now_ps)
        for stream in self.streams:
            stream.world_changed(now_ps)

    def sample_range(self, channel: str) -> tuple[float, float, float]:
        """(lowest value, highest value, size of one LSB) of ``channel`` as now configured, in its unit."""
        raise KeyError(channel)


def _nothing_prefetched(address: int, count: int, now_ps: int) -> Prefetched:
    del address, count, now_ps
    return NOTHING_PREFETCHED


def _burst_reader_of(read: Read) -> Callable[[int, int], BurstReader]:
    def burst_reader(address: int, count: int) -> BurstReader:
        return lambda now_ps: (read(address, count, now_ps), 0)

    return burst_reader


def _checked(write: Write) -> Write:
    """``write`` for callers who may be wrong; reads are checked where bursts are planned."""

    def checked(address: int, data: bytes, now_ps: int) -> None:
        if not isinstance(data, bytes | bytearray):
            raise TypeError(f"cannot write {data!r} at sub-address {address!r}; give bytes")
        if not data or not 0 <= address < ADDRESSES:
            raise AccessError("write", address, len(data))
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


# -- bits that a part clears itself -------------------------------------------------------------------------


class SelfClearingBits:
    """Bits of one register that read as 1 for some time after they were written (BOOT, SW_RESET)."""

    def __init__(self, registers: RegisterFile, register: type[Register]) -> None:
        self._mem = registers.mem
        self._address = register.addr
        self._due: list[tuple[int, int]] = []

    def begin(self, mask: int, until_ps: int) -> None:
        """The bits of ``mask`` read as 1 until ``until_ps``."""
        self._mem[self._address] |= mask
        self._due.append((until_ps, mask))

    def pending(self, mask: int, now_ps: int) -> bool:
        """Whether any bit of ``mask`` is still at work."""
        return any(until > now_ps and bits & mask for until, bits in self._due)

    def before_read(self, first: int, end: int, now_ps: int) -> None:
        """Read hook: clear what is over."""
        del first, end
        if self._due:
            for until, mask in self._due:
                if until <= now_ps:
                    self._mem[self._address] &= ~mask
            self._due = [entry for entry in self._due if entry[0] > now_ps]
            for _, mask in self._due:  # begun again since, or written with 0 meanwhile
                self._mem[self._address] |= mask


# -- the I2C face ------------------------------------------------------------------------------------------


class _IncrementBit:
    """A part whose bursts stay at one register unless a bit of the sub-address says that they go on.

    Addresses have that bit where it was set; all else is the part's own.
    """

    def __init__(self, part: Part, bit: int) -> None:
        self._part = part
        self._bit = bit

    def __getattr__(self, name: str) -> Any:
        return getattr(self._part, name)

    def read(self, address: int, count: int, now_ps: int) -> bytes:
        """``count`` bytes from ``address`` on, or of ``address``."""
        register = address & ~self._bit
        if address & self._bit:
            return self._part.read(register, count, now_ps)
        return b"".join(self._part.read(register, 1, now_ps) for _ in range(count))

    def write(self, address: int, data: bytes, now_ps: int) -> None:
        """Write ``data`` from ``address`` on, or each byte to ``address``."""
        register = address & ~self._bit
        if address & self._bit:
            self._part.write(register, data, now_ps)
            return
        for value in data:
            self._part.write(register, bytes((value,)), now_ps)

    def advance(self, address: int, count: int) -> int:
        """The address a burst leaves behind."""
        if not address & self._bit:
            return address
        return self._part.advance(address & ~self._bit, count) | self._bit

    def register_name(self, address: int) -> str:
        """The datasheet's name of the register at a sub-address."""
        return self._part.register_name(address & ~self._bit)

    def prefetch(self, address: int, count: int, now_ps: int) -> Prefetched:
        """Without the bit one byte at a time: the next one is read after this one."""
        data, until_ps, quiet = self._part.prefetch(address & ~self._bit, count, now_ps)
        if address & self._bit:
            return data, until_ps, quiet
        return data[:1], until_ps, quiet & 0b10

    def consumed(self, address: int, count: int) -> None:
        """So many of these bytes have been read."""
        self._part.consumed(address & ~self._bit, count)

    def burst_reader(self, address: int, count: int) -> BurstReader:
        """What reads such a burst."""
        if address & self._bit:
            return self._part.burst_reader(address & ~self._bit, count)
        return lambda now_ps: (self.read(address, count, now_ps), 0)


def with_increment_bit(part: Part, bit: int) -> Part:
    """The part as it is reached where ``bit`` of an address says that a burst goes on; 0: where none does."""
    return cast("Part", _IncrementBit(part, bit)) if bit else part


class SubaddressTarget:
    """The I2C face of one part: keeps the sub-address between the phases of a transfer.

    ``now_ps`` gives the virtual time in picoseconds, in which the part's samples are due.
    """

    def __init__(self, part: Part, now_ps: Callable[[], int]) -> None:
        bit = part.BUS.i2c_increment_bit
        self.part = with_increment_bit(part, bit)
        self._now_ps = now_ps
        self.address_mask = ADDRESSES - 1 | bit
        """The bits of a sub-address that mean something to the part."""
        self.last_burst = (0, 0)
        """Sub-address and length of the last burst; the next read without a sub-address goes on after it."""
        self._expects_subaddress = False
        self._booting = not part.accessible(now_ps())  # asked again only while it is so

    def start(self, *, read: bool) -> bool:
        """A start or repeated start addressed this part; True acknowledges."""
        self._expects_subaddress = not read
        if not self._booting:
            return not self.part.i2c_off
        answers = self.answers()
        if self._booting:
            self.part.refuse(self._now_ps())
        return answers

    def write(self, data: bytes) -> int:
        """Bytes from the master; the number acknowledged (all of them)."""
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
        """Bytes for the master, from the sub-address left behind."""
        address = self.position
        data = self.part.read(address, count, self._now_ps())
        self.last_burst = (address, count)
        return data

    def prefetch(self, subaddress: int, count: int, now_ps: int) -> Prefetched:
        """What the next reads of one byte from there on would give; nothing has been read yet.

        See :meth:`fcu_emulator.sensors.register_file.RegisterFile.prefetch`.
        """
        if not self.answers():
            return NOTHING_PREFETCHED
        return self.part.prefetch(subaddress & self.address_mask, count, now_ps)

    def consumed(self, subaddress: int, count: int) -> None:
        """So many of these bytes have been read."""
        address = subaddress & self.address_mask
        self.part.consumed(address, count)
        if self.part.advance(address, 1) == address:  # each in a read of its own
            address, count = address + count - 1, 1
        self.advance_past(address, count)

    def advance_past(self, subaddress: int, count: int) -> None:
        """Prefetched bytes have been read, which was quiet: all that it leaves is the sub-address."""
        self.last_burst = (subaddress & self.address_mask, count)
        self._expects_subaddress = False

    @property
    def version(self) -> array[int]:
        """The part's: what was prefetched holds as long as the number does not change."""
        return self.part.version

    @property
    def position(self) -> int:
        """The sub-address left behind, where a read goes on."""
        address, count = self.last_burst
        if count:
            address = self.part.advance(address, count)
            self.last_burst = (address, 0)
        return address

    def stop(self) -> None:
        """The master ended the transfer; the sub-address stays."""
        self._expects_subaddress = False

    def read_from(self, subaddress: int, count: int, now_ps: int) -> bytes | None:
        """A whole "write sub-address, repeated start, read"; None if the part does not answer."""
        if not self.answers():
            return None
        address = subaddress & self.address_mask
        self.last_burst = (address, count)
        return self.part.read(address, count, now_ps)

    def name(self) -> str:
        """The name of the sensor."""
        return self.part.NAME

    def register_name(self, address: int) -> str:
        """The datasheet's name of the register at a sub-address."""
        return self.part.register_name(address)

    def answers(self) -> bool:
        """Whether the part acknowledges its address; only a write to it changes that, once it does."""
        if self._booting:
            self._booting = not self.part.accessible(self._now_ps())
        return not self._booting and not self.part.i2c_off
