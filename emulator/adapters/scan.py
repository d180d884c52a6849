"""Looking for devices, as CircuitPython and MicroPython do it."""

from __future__ import annotations

from contextlib import suppress

from emulator.buses.i2c_master import I2CMaster
from emulator.errors import I2CNackError

_ADDRESSES = range(0x08, 0x78)  # the others are reserved (NXP UM10204, Table 3)


def scan(master: I2CMaster) -> list[int]:
    """The 7-bit addresses that acknowledge an empty write, in ascending order. Raises I2CError."""
    found = []
    for address in _ADDRESSES:
        with suppress(I2CNackError):
            master.write(address, b"")
            found.append(address)
    return found
