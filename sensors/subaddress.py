"""ST's I2C sub-address protocol, once for all parts.

After the address byte a write's first byte is the sub-address, the rest is data; a read goes on at the
sub-address left behind (LSM6DSL datasheet 6.2, LIS2MDL 6.1, LPS22HB 7.2). Bit 7 of the sub-address carries no
meaning for these three: the LSM6DSL has none, and the other two increment with and without it, as drivers of
both kinds work on silicon. Where a part asks for a bit, its declaration says which
(:class:`sensors.declaration.Bus`), and the address space here is twice as large: the registers, and the
registers with that bit.

Decision: a part that loads its trimming values after power-on does not acknowledge its address; the documents
say "not accessible" only (AN5040 5.7, AN5069 3). The alternative, stretching the clock for 15 ms, is in no
description of these parts' interface.
"""

from __future__ import annotations

from array import array
from collections.abc import Callable
from typing import Any, ClassVar, Protocol, cast

from sensors.declaration import Bus
from sensors.register import ADDRESSES
from sensors.register_file import NOTHING_PREFETCHED, BurstReader, Prefetched


class AddressedDevice(Protocol):
    """A part seen through its sub-addresses."""

    NAME: ClassVar[str]
    BUS: ClassVar[Bus]
    i2c_off: bool
    """Whether the part does not answer on I2C."""

    def read(self, address: int, count: int, now_ps: int) -> bytes:
        """``count`` bytes from ``address`` on."""
        ...

    def write(self, address: int, data: bytes, now_ps: int) -> None:
        """Write ``data`` from ``address`` on."""
        ...

    def advance(self, address: int, count: int) -> int:
        """The address a burst leaves behind."""
        ...

    def register_name(self, address: int) -> str:
        """The datasheet's name of the register at a sub-address."""
        ...

    version: array[int]
    """One number, which changes with everything that makes prefetched bytes wrong."""

    def prefetch(self, address: int, count: int, now_ps: int) -> Prefetched:
        """What single reads would give, until when (ps), and which of them are quiet."""
        ...

    def consumed(self, address: int, count: int) -> None:
        """So many of these bytes have been read."""
        ...

    def burst_reader(self, address: int, count: int) -> BurstReader:
        """What reads such a burst, and says how long it lasts, in the present version."""
        ...

    def accessible(self, now_ps: int) -> bool:
        """Whether the registers answer; once they do, they do so for good."""
        ...

    def refuse(self, now_ps: int) -> None:
        """Somebody has tried to reach the part before that."""
        ...


class IncrementBit:
    """A part whose bursts stay at one register unless a bit of the sub-address says that they go on.

    Addresses have that bit where it was set; all else is the part's own.
    """

    def __init__(self, device: AddressedDevice, bit: int) -> None:
        self._device = device
        self._bit = bit

    def __getattr__(self, name: str) -> Any:
        return getattr(self._device, name)

    def read(self, address: int, count: int, now_ps: int) -> bytes:
        """``count`` bytes from ``address`` on, or of ``address``."""
        register = address & ~self._bit
        if address & self._bit:
            return self._device.read(register, count, now_ps)
        return b"".join(self._device.read(register, 1, now_ps) for _ in range(count))

    def write(self, address: int, data: bytes, now_ps: int) -> None:
        """Write ``data`` from ``address`` on, or each byte to ``address``."""
        register = address & ~self._bit
        if address & self._bit:
            self._device.write(register, data, now_ps)
            return
        for value in data:
            self._device.write(register, bytes((value,)), now_ps)

    def advance(self, address: int, count: int) -> int:
        """The address a burst leaves behind."""
        if not address & self._bit:
            return address
        return self._device.advance(address & ~self._bit, count) | self._bit

    def register_name(self, address: int) -> str:
        """The datasheet's name of the register at a sub-address."""
        return self._device.register_name(address & ~self._bit)

    def prefetch(self, address: int, count: int, now_ps: int) -> Prefetched:
        """Without the bit one byte at a time: the next one is read after this one."""
        data, until_ps, quiet = self._device.prefetch(address & ~self._bit, count, now_ps)
        if address & self._bit:
            return data, until_ps, quiet
        return data[:1], until_ps, quiet & 0b10

    def consumed(self, address: int, count: int) -> None:
        """So many of these bytes have been read."""
        self._device.consumed(address & ~self._bit, count)

    def burst_reader(self, address: int, count: int) -> BurstReader:
        """What reads such a burst."""
        if address & self._bit:
            return self._device.burst_reader(address & ~self._bit, count)
        return lambda now_ps: (self.read(address, count, now_ps), 0)


class SubaddressTarget:
    """The I2C face of one part: keeps the sub-address between the phases of a transfer.

    ``now_ps`` gives the virtual time in picoseconds, in which the part's samples are due.
    """

    def __init__(self, device: AddressedDevice, now_ps: Callable[[], int]) -> None:
        bit = device.BUS.i2c_increment_bit
        self.device = cast("AddressedDevice", IncrementBit(device, bit)) if bit else device
        self._now_ps = now_ps
        self.address_mask = ADDRESSES - 1 | bit
        """The bits of a sub-address that mean something to the part."""
        self.last_burst = (0, 0)
        """Sub-address and length of the last burst; the next read without a sub-address goes on after it."""
        self._expects_subaddress = False
        self._booting = not device.accessible(now_ps())  # asked again only while it is so

    def start(self, *, read: bool) -> bool:
        """A start or repeated start addressed this part; True acknowledges."""
        self._expects_subaddress = not read
        if not self._booting:
            return not self.device.i2c_off
        answers = self.answers()
        if self._booting:
            self.device.refuse(self._now_ps())
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
            self.device.write(address, payload, self._now_ps())
            self.last_burst = (address, len(payload))
        return len(data)

    def read(self, count: int) -> bytes:
        """Bytes for the master, from the sub-address left behind."""
        address = self.position
        data = self.device.read(address, count, self._now_ps())
        self.last_burst = (address, count)
        return data

    def prefetch(self, subaddress: int, count: int, now_ps: int) -> Prefetched:
        """What the next reads of one byte from there on would give; nothing has been read yet.

        See :meth:`sensors.register_file.RegisterFile.prefetch`.
        """
        if not self.answers():
            return NOTHING_PREFETCHED
        return self.device.prefetch(subaddress & self.address_mask, count, now_ps)

    def consumed(self, subaddress: int, count: int) -> None:
        """So many of these bytes have been read."""
        address = subaddress & self.address_mask
        self.device.consumed(address, count)
        if self.device.advance(address, 1) == address:  # each in a read of its own
            address, count = address + count - 1, 1
        self.advance_past(address, count)

    def advance_past(self, subaddress: int, count: int) -> None:
        """Prefetched bytes have been read, which was quiet: all that it leaves is the sub-address."""
        self.last_burst = (subaddress & self.address_mask, count)
        self._expects_subaddress = False

    @property
    def version(self) -> array[int]:
        """The part's: what was prefetched holds as long as the number does not change."""
        return self.device.version

    @property
    def position(self) -> int:
        """The sub-address left behind, where a read goes on."""
        address, count = self.last_burst
        if count:
            address = self.device.advance(address, count)
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
        return self.device.read(address, count, now_ps)

    def name(self) -> str:
        """The part's name."""
        return self.device.NAME

    def register_name(self, address: int) -> str:
        """The datasheet's name of the register at a sub-address."""
        return self.device.register_name(address)

    def answers(self) -> bool:
        """Whether the part acknowledges its address; only a write to it changes that, once it does."""
        if self._booting:
            self._booting = not self.device.accessible(self._now_ps())
        return not self._booting and not self.device.i2c_off
