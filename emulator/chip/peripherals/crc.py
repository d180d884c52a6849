"""CRC unit: the Ethernet polynomial over whole words (RM0368 section 4)."""

from __future__ import annotations

from typing import ClassVar

from emulator.chip.peripherals.peripheral import WORD, Peripheral

DR, IDR, CR = 0x00, 0x04, 0x08

_POLYNOMIAL = 0x04C1_1DB7
_TOP = 1 << 31


class Crc(Peripheral):
    """CRC-32 without reflection or final inversion, one word (most significant bit first) a write."""

    REGISTERS: ClassVar[dict[int, int]] = {DR: WORD, IDR: 0, CR: 0}
    NAMES: ClassVar[dict[int, str]] = {DR: "DR", IDR: "IDR", CR: "CR"}
    WRITABLE: ClassVar[dict[int, int]] = {IDR: 0xFF, CR: 0}

    def write(self, offset: int, value: int, mask: int = WORD) -> None:
        """DR takes a word into the sum; CR.RESET starts again; IDR is a byte of storage."""
        if offset == DR:
            self.registers[DR] = _next(self.registers[DR] ^ value & mask)
        elif offset == CR:
            if value & mask & 1:
                self.registers[DR] = WORD
        else:
            super().write(offset, value, mask)


def _next(remainder: int) -> int:
    for _ in range(32):
        remainder = remainder << 1 ^ _POLYNOMIAL if remainder & _TOP else remainder << 1
    return remainder & WORD
