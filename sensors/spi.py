"""ST's SPI protocol, common to all sensors (LSM6DSL datasheet 6.3, LIS2MDL 6.2, LPS22HB 7.3).

The sensor answers on SDO (4-wire) or SDI (3-wire). If the host reads the wrong line, it reads 0xFF. Writes always work.

Decision: while a sensor loads its trimming values after power-on, it drives nothing and ignores commands, so
the host reads 0xFF. The documents only say "not accessible" (AN5040 5.7, AN5069 3).
"""

from __future__ import annotations

from array import array
from collections.abc import Callable
from typing import Final

from fcu_emulator.sensors.declaration import Mode, Wires
from fcu_emulator.sensors.part import Sensor, with_increment_bit

READ: Final = 0x80
UNDRIVEN: Final = 0xFF


class SpiTarget:
    """SPI interface of one sensor."""

    def __init__(self, part: Sensor, now_ps: Callable[[], int]) -> None:
        self.increment_bit = part.BUS.spi_increment_bit
        self.part = with_increment_bit(part, self.increment_bit)
        self._now_ps = now_ps
        self._modes = part.BUS.spi_modes
        self._command: int | None = None
        self.position = 0
        self._booting = not part.accessible(now_ps())  # checked again only while it is True

    @property
    def version(self) -> array[int]:
        """Counter of the sensor's state changes."""
        return self.part.version

    def answers(self) -> bool:
        """Return whether the sensor answered at its latest selection."""
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
            self._command, self.position = data[0], data[0] & 0x7F
            data = data[1:]
        if data and not self._command & READ:
            self.part.write(self.position, data, self._now_ps())
            self.position = self.part.advance(self.position, len(data))

    def read(self, count: int, mode: Mode, wires: Wires) -> bytes:
        if mode not in self._modes or self._command is None or not self._command & READ:
            return bytes([UNDRIVEN]) * count
        data = self.part.read(self.position, count, self._now_ps())
        self.position = self.part.advance(self.position, count)
        return data if self.part.spi_wires() == wires else bytes([UNDRIVEN]) * count

    def shared_bank(self, mode: Mode, wires: Wires) -> int | None:
        """Return the sensor's ``shared_bank()``, or None if the sensor does not answer in this mode."""
        if mode not in self._modes or self._booting or self.part.spi_wires() != wires:
            return None
        return self.part.shared_bank()

    def move_to(self, address: int) -> None:
        """Set the next register address to ``address``, after C has read registers directly."""
        self._command, self.position = READ | address, address
