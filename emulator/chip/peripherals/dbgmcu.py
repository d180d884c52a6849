"""DBGMCU and system memory (RM0368 sections 23.6 and 24).

The calibration values are typical values (STM32F401xB/C datasheet).

Freeze bits have no effect, because a halt stops virtual time. Only power-on resets the registers (23.16.1).
"""

from __future__ import annotations

import struct

from fcu_emulator.emulator.chip.peripherals.peripheral import Peripheral
from fcu_emulator.emulator.chip.registers import DECLARED, dbgmcu
from fcu_emulator.emulator.chip.registers.declaration import masks

SYSTEM_MEMORY = 0x1FFF_7A00
"""The address of the bytes that :func:`system_memory` returns."""

FLASH_KIB = 256

_UID, _FLASH_SIZE, _VREFINT_CAL = 0x10, 0x22, 0x2A
_FIRST_COORDINATES = 0x0025_0031  # the wafer coordinates of board 0
_FULL_SCALE, _VDDA = 4095, 3.3
_CR = dbgmcu.CR.addr
DBG_STANDBY, DBG_STOP = masks(dbgmcu.CR.DBG_STANDBY, dbgmcu.CR.DBG_STOP)


class Dbgmcu(Peripheral, declared=DECLARED["DBGMCU"]):
    """Identity code, the bits for Stop and Standby, and freeze bits without effect."""

    def reset(self) -> None:
        """Keep the registers at a system reset."""

    def lose_power(self) -> None:
        super().reset()

    def has(self, bit: int) -> bool:
        """Return whether ``bit`` of CR is set."""
        return bool(self.registers[_CR] & bit)


def system_memory(board: int = 0) -> bytes:
    """Return the bytes at ``SYSTEM_MEMORY``: unique id, flash size and ADC calibration."""
    memory = bytearray(b"\xff" * 0x30)
    # wafer coordinates, wafer number, lot number in ASCII (24.1)
    coordinates = _FIRST_COORDINATES + board & 0xFFFF_FFFF
    struct.pack_into("<II4s", memory, _UID, coordinates, 0x3031_0A05, b"FCU1")
    struct.pack_into("<H", memory, _FLASH_SIZE, FLASH_KIB)
    volts = (1.21, 0.76 + 0.0025 * (30 - 25), 0.76 + 0.0025 * (110 - 25))  # VREFINT, TS_CAL1, TS_CAL2
    struct.pack_into("<3H", memory, _VREFINT_CAL, *(round(level / _VDDA * _FULL_SCALE) for level in volts))
    return bytes(memory)
