"""ST's I2C sub-address protocol, once for all three parts.

After the address byte a write's first byte is the sub-address, the rest is data; a read goes on at the
sub-address left behind (LSM6DSL datasheet 6.2, LIS2MDL 6.1, LPS22HB 7.2). Bit 7 of the sub-address carries no
meaning here: the LSM6DSL has none, and the other two increment with and without it (sensor facts, DIS-11 and
DIS-14: drivers of both kinds work on silicon).

Decision: a part that loads its trimming values after power-on does not acknowledge its address; the documents
say "not accessible" only (AN5040 5.7, AN5069 3). The alternative, stretching the clock for 15 ms, is in no
description of these parts' interface.
"""

from __future__ import annotations

from array import array
from collections.abc import Callable
from typing import ClassVar, Protocol

from sensors.register_file import UNFORESEEN, Foreseen, Taker


class AddressedDevice(Protocol):
    """A part seen through its sub-addresses."""

    NAME: ClassVar[str]
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
    """One number, which changes with everything that makes bytes told ahead wrong."""

    def ahead(self, address: int, count: int, now_ps: int) -> Foreseen:
        """What single reads would give, until when (ps), and which of them are quiet."""
        ...

    def taken(self, address: int, count: int) -> None:
        """So many of these bytes have been read."""
        ...

    def taker(self, address: int, count: int) -> Taker:
        """What reads such a burst, and says how long it lasts, in the present version."""
        ...

    def accessible(self, now_ps: int) -> bool:
        """Whether the registers answer; once they do, they do so for good."""
        ...

    def refuse(self, now_ps: int) -> None:
        """Somebody has tried to reach the part before that."""
        ...


class SubaddressTarget:
    """The I2C face of one part: keeps the sub-address between the phases of a transfer.

    ``now_ps`` gives the virtual time in picoseconds, in which the part's samples are due.
    """

    def __init__(self, device: AddressedDevice, now_ps: Callable[[], int]) -> None:
        self.device = device
        self._now_ps = now_ps
        self.behind = (0, 0)
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
            self.behind = (data[0] & 0x7F, 0)
            self._expects_subaddress = False
            payload = data[1:]
        if payload:
            address = self.position
            self.device.write(address, payload, self._now_ps())
            self.behind = (address, len(payload))
        return len(data)

    def read(self, count: int) -> bytes:
        """Bytes for the master, from the sub-address left behind."""
        address = self.position
        data = self.device.read(address, count, self._now_ps())
        self.behind = (address, count)
        return data

    def ahead(self, subaddress: int, count: int, now_ps: int) -> Foreseen:
        """What the next reads of one byte from there on would give; nothing has been read yet.

        See :meth:`sensors.register_file.RegisterFile.ahead`.
        """
        if not self.answers():
            return UNFORESEEN
        return self.device.ahead(subaddress & 0x7F, count, now_ps)

    def taken(self, subaddress: int, count: int) -> None:
        """So many of these bytes have been read."""
        self.device.taken(subaddress & 0x7F, count)
        self.served(subaddress, count)

    def served(self, subaddress: int, count: int) -> None:
        """Bytes told ahead have been read, which was quiet: all that it leaves is the sub-address."""
        self.behind = (subaddress & 0x7F, count)
        self._expects_subaddress = False

    @property
    def version(self) -> array[int]:
        """The part's: what was told ahead holds as long as the number does not change."""
        return self.device.version

    @property
    def position(self) -> int:
        """The sub-address left behind, where a read goes on."""
        address, count = self.behind
        if count:
            address = self.device.advance(address, count)
            self.behind = (address, 0)
        return address

    def stop(self) -> None:
        """The master ended the transfer; the sub-address stays."""
        self._expects_subaddress = False

    def read_from(self, subaddress: int, count: int, now_ps: int) -> bytes | None:
        """A whole "write sub-address, repeated start, read"; None if the part does not answer."""
        if not self.answers():
            return None
        address = subaddress & 0x7F
        self.behind = (address, count)
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
