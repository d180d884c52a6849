"""ST's SPI protocol, common to all sensors (LSM6DSL datasheet 6.3, LIS2MDL 6.2, LPS22HB 7.3).

A host that listens to the wrong line, SDO (4-wire) or SDI (3-wire), reads 0xFF. Writes always work.

Decision: a sensor that loads its trimming values after power-on drives nothing and ignores commands, so the host reads
0xFF. The documents only say "not accessible" (AN5040 5.7, AN5069 3).
"""

from __future__ import annotations

from array import array
from collections.abc import Callable
from typing import Final

from fcu_emulator.sensors.declaration import Mode, Wires
from fcu_emulator.sensors.part import Sensor, with_increment_bit
from fcu_emulator.sensors.register_file import NOTHING_PREFETCHED, Prefetched

READ: Final = 0x80
UNDRIVEN: Final = 0xFF


class SpiTarget:
    """SPI interface of one sensor, between two edges of its chip select."""

    def __init__(self, part: Sensor, now_ps: Callable[[], int]) -> None:
        bit = part.BUS.spi_increment_bit
        self.part = with_increment_bit(part, bit)
        self._now_ps = now_ps
        self._modes = part.BUS.spi_modes
        self._command: int | None = None
        self._address = 0
        self._booting = not part.accessible(now_ps())  # checked again only while it is True

    @property
    def version(self) -> array[int]:
        """Version of the state; a change invalidates prefetched bytes."""
        return self.part.version

    def answers(self) -> bool:
        """Return whether the sensor answered when last selected."""
        return not self._booting

    def select(self) -> None:
        """Start a message at the falling edge of chip select."""
        self._command = None
        if self._booting:
            now_ps = self._now_ps()
            self._booting = not self.part.accessible(now_ps)
            if self._booting:
                self.part.refuse(now_ps)

    def write(self, data: bytes, mode: Mode) -> None:
        if mode not in self._modes or not data or self._booting:
            return
        if self._command is None:
            self._command, self._address = data[0], data[0] & 0x7F
            data = data[1:]
        if data and not self._command & READ:
            self.part.write(self._address, data, self._now_ps())
            self._address = self.part.advance(self._address, len(data))

    def read(self, count: int, mode: Mode, wires: Wires) -> bytes:
        if mode not in self._modes or self._command is None or not self._command & READ:
            return bytes([UNDRIVEN]) * count
        data = self.part.read(self._address, count, self._now_ps())
        self._address = self.part.advance(self._address, count)
        return data if self.part.spi_wires() == wires else bytes([UNDRIVEN]) * count

    def prefetch(self, address: int, count: int, mode: Mode, wires: Wires, now_ps: int) -> Prefetched:
        """Return byte-by-byte reads; see :meth:`fcu_emulator.sensors.register_file.RegisterFile.prefetch`."""
        if mode not in self._modes or self._booting or self.part.spi_wires() != wires:
            return NOTHING_PREFETCHED
        return self.part.prefetch(address & ~READ, count, now_ps)

    def commit(self, address: int, count: int) -> None:
        address &= ~READ
        self.part.commit(address, count)
        if self.part.advance(address, 1) == address:  # each in a separate message
            address, count = address + count - 1, 1
        self.advance_past(address, count)

    def advance_past(self, address: int, count: int) -> None:
        """Advance past prefetched bytes that were read without side effects."""
        self._command = READ | address
        self._address = self.part.advance(address & ~READ, count)
