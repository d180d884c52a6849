"""``board.i2c2``: Python as the master of the sensors' bus, for tests of drivers."""

from __future__ import annotations

from collections.abc import Callable

from emulator.errors import InputError
from emulator.i2c import I2CBus, I2CFault


class I2CMaster:
    """A bus master in Python. Transfers take their time on the wire; firmware, if any, runs meanwhile.

    Addresses have 7 bits. A transfer nobody acknowledges raises I2CNackError, a broken bus I2CBusError or
    I2CStuckError; an address or a length that cannot be, InputError.
    """

    def __init__(self, bus: I2CBus, run_until: Callable[[int], None]) -> None:
        self._bus = bus
        self._run_until = run_until

    @property
    def speed_hz(self) -> int:
        """Clock rate of the bus."""
        return self._bus.speed_hz

    def write(self, address: int, data: bytes) -> None:
        """Start, address, ``data``, stop."""
        self._transfer(address, bytes(data), 0)

    def read(self, address: int, n: int) -> bytes:
        """Start, address, ``n`` bytes, stop."""
        return self._transfer(address, b"", _length(n))

    def write_read(self, address: int, data: bytes, n: int) -> bytes:
        """Start, address, ``data``, repeated start, address, ``n`` bytes, stop."""
        return self._transfer(address, bytes(data), _length(n))

    def inject(self, fault: I2CFault) -> None:
        """Break transfers as the rule says, those of firmware included."""
        self._bus.inject(fault)

    def _transfer(self, address: int, data: bytes, count: int) -> bytes:
        if not 0 <= address <= 0x7F:
            raise InputError(f"I2C address {address:#x} has more than 7 bits; give 0x00 to 0x7F, no R/W bit")
        self._run_until(max(self._bus.end_ps, self._bus.now_ps))  # firmware may be in a transfer
        try:
            return self._bus.transfer(address, data, count)
        finally:
            self._run_until(self._bus.end_ps)


def _length(n: int) -> int:
    if not 1 <= n <= 65535:
        raise InputError(f"cannot read {n} bytes in one transfer; give 1 to 65535")
    return n
