"""Python as the master of an I2C bus, for tests of drivers: ``board.i2c("I2C2")``."""

from __future__ import annotations

from collections.abc import Callable

from emulator.buses import arguments as bus_arguments
from emulator.buses.i2c import I2CBus, I2CFault


class I2CMaster:
    """A bus master in Python. Transfers take their time on the wire; firmware, if any, runs meanwhile.

    Addresses have 7 bits. A transfer nobody acknowledges raises I2CNackError, a broken bus I2CBusError or
    I2CStuckError; an address, a length or data that cannot be, InputError.
    """

    def __init__(self, bus: I2CBus, run_until_ps: Callable[[int], None]) -> None:
        self.bus = bus
        """The bus itself: its speed, its targets, its latest transfers."""
        self._run_until = run_until_ps

    @property
    def speed_hz(self) -> int:
        """Clock rate of the bus."""
        return self.bus.speed_hz

    def write(self, address: int, data: bytes) -> None:
        """Start, address, ``data``, stop."""
        self._transfer(address, bus_arguments.payload(data), 0)

    def read(self, address: int, n: int) -> bytes:
        """Start, address, ``n`` bytes, stop."""
        return self._transfer(address, b"", bus_arguments.length(n, 1))

    def write_read(self, address: int, data: bytes, n: int) -> bytes:
        """Start, address, ``data``, repeated start, address, ``n`` bytes, stop."""
        return self._transfer(address, bus_arguments.payload(data), bus_arguments.length(n, 1))

    def inject(self, fault: I2CFault) -> None:
        """Break transfers as the rule says, those of firmware included."""
        self.bus.inject(fault)

    def _transfer(self, address: int, data: bytes, count: int) -> bytes:
        address = bus_arguments.address(address)
        self._run_until(max(self.bus.end_ps, self.bus.now_ps))  # firmware may be in a transfer
        try:
            return self.bus.transfer(address, data, count)
        finally:
            self._run_until(self.bus.end_ps)
