"""CRC unit: the Ethernet polynomial over words (RM0368 section 4)."""

from __future__ import annotations

from fcu_emulator.emulator.chip.peripherals.peripheral import WORD, Peripheral
from fcu_emulator.emulator.chip.registers import DECLARED, crc
from fcu_emulator.emulator.chip.registers.declaration import offsets

DR, IDR, CR = offsets(crc.DR, crc.IDR, crc.CR)

_POLYNOMIAL = 0x04C1_1DB7
_TOP = 1 << 31


class Crc(Peripheral, declared=DECLARED["CRC"]):
    """CRC-32 without reflection or final inversion."""

    def write(self, offset: int, value: int, mask: int = WORD) -> None:
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
