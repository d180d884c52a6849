"""CRC calculation unit (RM0368 section 4.4)."""

from __future__ import annotations

from fcu_emulator.emulator.chip.registers.declaration import Word
from fcu_emulator.sensors.register import Bits

SOURCE = "RM0368 4.4"
INSTANCES = ("CRC",)


class DR(Word, addr=0x00, reset=0xFFFF_FFFF):
    """Data: a word for the sum, and the sum."""


class IDR(Word, addr=0x04):
    """Independent data."""

    IDR = Bits(7, 0, doc="a byte of storage")


class CR(Word, addr=0x08, access="w"):
    """Control."""

    RESET = Bits(0, doc="restarts the calculation")
