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

from collections.abc import Callable
from typing import ClassVar, Protocol


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

    def read_ahead(self, address: int, now_ps: int) -> tuple[bytes, int]:
        """What single reads would give, and until when (ps); none if that is not sure."""
        ...

    def taken(self, address: int, count: int) -> None:
        """So many of these bytes have been read."""
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
        self._address = 0
        self._lag = 0  # bytes of the last burst that ``_address`` has not been moved past yet
        self._expects_subaddress = False
        self._booting = not device.accessible(now_ps())  # asked again only while it is so

    def start(self, *, read: bool) -> bool:
        """A start or repeated start addressed this part; True acknowledges."""
        self._expects_subaddress = not read
        if not self._booting:
            return not self.device.i2c_off
        answers = self._answers()
        if self._booting:
            self.device.refuse(self._now_ps())
        return answers

    def write(self, data: bytes) -> int:
        """Bytes from the master; the number acknowledged (all of them)."""
        payload = data
        if self._expects_subaddress and data:
            self._address, self._lag = data[0] & 0x7F, 0
            self._expects_subaddress = False
            payload = data[1:]
        if payload:
            self.device.write(self._catch_up(), payload, self._now_ps())
            self._lag = len(payload)
        return len(data)

    def read(self, count: int) -> bytes:
        """Bytes for the master, from the sub-address left behind."""
        data = self.device.read(self._catch_up(), count, self._now_ps())
        self._lag = count
        return data

    def read_ahead(self, now_ps: int) -> tuple[bytes, int]:
        """What the next reads of one byte would give, and until when (ps); nothing has been read yet."""
        return self.device.read_ahead(self._catch_up(), now_ps)

    def taken(self, count: int) -> None:
        """So many of these bytes have been read."""
        self.device.taken(self._address, count)
        self._lag = count

    def stop(self) -> None:
        """The master ended the transfer; the sub-address stays."""
        self._expects_subaddress = False

    def read_from(self, subaddress: int, count: int, now_ps: int) -> bytes | None:
        """A whole "write sub-address, repeated start, read"; None if the part does not answer."""
        if (self._booting or self.device.i2c_off) and not self._answers():
            return None
        self._address = address = subaddress & 0x7F
        self._lag = count
        return self.device.read(address, count, now_ps)

    def name(self) -> str:
        """The part's name."""
        return self.device.NAME

    def register_name(self, address: int) -> str:
        """The datasheet's name of the register at a sub-address."""
        return self.device.register_name(address)

    def _answers(self) -> bool:
        if self._booting:
            self._booting = not self.device.accessible(self._now_ps())
        return not self._booting and not self.device.i2c_off

    def _catch_up(self) -> int:
        if self._lag:
            self._address = self.device.advance(self._address, self._lag)
            self._lag = 0
        return self._address
