"""ST's SPI protocol, once for all parts (LSM6DSL datasheet 6.3, LIS2MDL 6.2, LPS22HB 7.3).

While chip select is low the first byte is the read flag (bit 7) and the register address; what follows is
data, from that register on. A part that asks for it has a bit in between that says whether a burst goes on to
the next register. Bits are sampled in SPI mode 0 or 3; in the other two a part sees garbage and answers none.

Wires. A part drives its answers on SDO (4-wire) or back on SDI (3-wire), as configured; a host listens on one
of the two. Where they disagree the host reads an undriven line, 0xFF. Writing works either way, which is how
a 3-wire host gets the LSM6DSL and the LPS22HB, 4-wire after reset, to talk to it: its first access is a blind
write.

Decision: a part that loads its trimming values after power-on drives nothing and takes no command, so the
host reads 0xFF and its writes are lost; the documents say "not accessible" only (AN5040 5.7, AN5069 3).
"""

from __future__ import annotations

from array import array
from collections.abc import Callable
from typing import Final

from fcu_emulator.sensors.declaration import Mode, Wires
from fcu_emulator.sensors.part import Part, with_increment_bit
from fcu_emulator.sensors.register_file import NOTHING_PREFETCHED, Prefetched

READ: Final = 0x80
UNDRIVEN: Final = 0xFF


class SpiTarget:
    """The SPI face of one part: the bytes between two edges of its chip select.

    ``now_ps`` gives the virtual time, in which the part's samples are due.
    """

    def __init__(self, part: Part, now_ps: Callable[[], int]) -> None:
        bit = part.BUS.spi_increment_bit
        self.part = with_increment_bit(part, bit)
        self._now_ps = now_ps
        self._modes = part.BUS.spi_modes
        self._command: int | None = None
        self._address = 0
        self._booting = not part.accessible(now_ps())  # asked again only while it is so

    @property
    def version(self) -> array[int]:
        """The part's: what was prefetched holds as long as the number does not change."""
        return self.part.version

    def answers(self) -> bool:
        """Whether the part was seen to answer when it was last selected; then it does so for good."""
        return not self._booting

    def select(self) -> None:
        """Chip select falls: the next byte is a command."""
        self._command = None
        if self._booting:
            now_ps = self._now_ps()
            self._booting = not self.part.accessible(now_ps)
            if self._booting:
                self.part.refuse(now_ps)

    def write(self, data: bytes, mode: Mode) -> None:
        """Bytes from the host, while it does not listen."""
        if mode not in self._modes or not data or self._booting:
            return
        if self._command is None:
            self._command, self._address = data[0], data[0] & 0x7F
            data = data[1:]
        if data and not self._command & READ:
            self.part.write(self._address, data, self._now_ps())
            self._address = self.part.advance(self._address, len(data))

    def read(self, count: int, mode: Mode, wires: Wires) -> bytes:
        """``count`` bytes as a host with ``wires`` sees them."""
        if mode not in self._modes or self._command is None or not self._command & READ:
            return bytes([UNDRIVEN]) * count
        data = self.part.read(self._address, count, self._now_ps())
        self._address = self.part.advance(self._address, count)
        return data if self.part.spi_wires() == wires else bytes([UNDRIVEN]) * count

    def prefetch(self, address: int, count: int, mode: Mode, wires: Wires, now_ps: int) -> Prefetched:
        """What a read of ``address`` would give a host, byte by byte; nothing has been read yet.

        See :meth:`fcu_emulator.sensors.register_file.RegisterFile.prefetch`.
        """
        if mode not in self._modes or self._booting or self.part.spi_wires() != wires:
            return NOTHING_PREFETCHED
        return self.part.prefetch(address & ~READ, count, now_ps)

    def consumed(self, address: int, count: int) -> None:
        """So many of these bytes have been read."""
        address &= ~READ
        self.part.consumed(address, count)
        if self.part.advance(address, 1) == address:  # each in a message of its own
            address, count = address + count - 1, 1
        self.advance_past(address, count)

    def advance_past(self, address: int, count: int) -> None:
        """Prefetched bytes have been read in the present message, which was quiet."""
        self._command = READ | address
        self._address = self.part.advance(address & ~READ, count)
