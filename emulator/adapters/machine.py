"""``machine.I2C`` of MicroPython, on the virtual board's I2C2.

Shape: MicroPython's ``machine.I2C`` documentation. ``stop=False`` ends in a stop all the same: the three
parts keep the sub-address over it, so a driver cannot see the difference.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from emulator.adapters.os_errors import ENODEV, os_errors
from emulator.adapters.scan import scan
from emulator.buses.i2c_master import I2CMaster

if TYPE_CHECKING:
    from typing_extensions import Buffer  # in collections.abc from Python 3.12 on


class MachineI2C:
    """Give ``MachineI2C(board.i2c2)`` to a MicroPython driver in place of ``machine.I2C(...)``.

    Addresses have 7 bits, memory addresses ``addrsize`` bits, most significant byte first. A device that does
    not answer is OSError(ENODEV), a stuck bus OSError(ETIMEDOUT).
    """

    def __init__(self, master: I2CMaster) -> None:
        self._master = master

    def scan(self) -> list[int]:
        """Addresses at which a device answers."""
        with os_errors(ENODEV):
            return scan(self._master)

    def writeto(self, addr: int, buf: Buffer, stop: bool = True) -> int:
        """Write ``buf``; the number of bytes acknowledged."""
        del stop
        data = bytes(buf)
        with os_errors(ENODEV):
            self._master.write(addr, data)
        return len(data)

    def readfrom(self, addr: int, nbytes: int, stop: bool = True) -> bytes:
        """Read ``nbytes``."""
        del stop
        with os_errors(ENODEV):
            return self._master.read(addr, nbytes)

    def readfrom_into(self, addr: int, buf: Buffer, stop: bool = True) -> None:
        """Fill ``buf``."""
        target = memoryview(buf).cast("B")
        target[:] = self.readfrom(addr, len(target), stop)

    def writeto_mem(self, addr: int, memaddr: int, buf: Buffer, *, addrsize: int = 8) -> None:
        """Write ``buf`` from ``memaddr`` on."""
        with os_errors(ENODEV):
            self._master.write(addr, memaddr.to_bytes(addrsize // 8, "big") + bytes(buf))

    def readfrom_mem(self, addr: int, memaddr: int, nbytes: int, *, addrsize: int = 8) -> bytes:
        """Read ``nbytes`` from ``memaddr`` on."""
        with os_errors(ENODEV):
            return self._master.write_read(addr, memaddr.to_bytes(addrsize // 8, "big"), nbytes)

    def readfrom_mem_into(self, addr: int, memaddr: int, buf: Buffer, *, addrsize: int = 8) -> None:
        """Fill ``buf`` from ``memaddr`` on."""
        target = memoryview(buf).cast("B")
        target[:] = self.readfrom_mem(addr, memaddr, len(target), addrsize=addrsize)
