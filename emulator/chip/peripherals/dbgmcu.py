"""DBGMCU and the identity in system memory (RM0368 sections 23.6 and 24).

Freezing timers while the core is halted by a debugger needs no bit here: virtual time stops for all of
them.

Calibration values are those of a typical part by the STM32F401xB/C datasheet (V25 = 0.76 V, 2.5 mV/degC,
reference 1.21 V, measured at 3.3 V); a real chip's differ by a few per cent.
"""

from __future__ import annotations

import struct
from typing import ClassVar

from emulator.chip.peripherals.peripheral import Peripheral

IDCODE, CR, APB1_FZ, APB2_FZ = 0x00, 0x04, 0x08, 0x0C

SYSTEM_MEMORY = 0x1FFF_7A00
"""Where :func:`system_memory` belongs in the address space."""

FLASH_KIB = 256

_UID, _FLASH_SIZE, _VREFINT_CAL = 0x10, 0x22, 0x2A
_DEVICE, _REVISION = 0x423, 0x1001  # STM32F401xB/C, revision Z
_FULL_SCALE, _VDDA = 4095, 3.3


class Dbgmcu(Peripheral):
    """Identity code and freeze bits; only the code matters."""

    REGISTERS: ClassVar[dict[int, int]] = {IDCODE: _REVISION << 16 | _DEVICE, CR: 0, APB1_FZ: 0, APB2_FZ: 0}
    NAMES: ClassVar[dict[int, str]] = {IDCODE: "IDCODE", CR: "CR", APB1_FZ: "APB1_FZ", APB2_FZ: "APB2_FZ"}
    WRITABLE: ClassVar[dict[int, int]] = {IDCODE: 0, CR: 0xE7, APB1_FZ: 0x00E0_1C0F, APB2_FZ: 0x0007_0001}


def system_memory(board: int = 0) -> bytes:
    """The 48 bytes from ``SYSTEM_MEMORY``: unique id of board ``board``, flash size, ADC calibration."""
    memory = bytearray(b"\xff" * 0x30)
    # the id of a real chip: wafer coordinates, wafer number, lot number in ASCII (24.1)
    struct.pack_into("<II4s", memory, _UID, board & 0xFFFF_FFFF, 0x3031_0A05, b"FCU1")
    struct.pack_into("<H", memory, _FLASH_SIZE, FLASH_KIB)
    volts = (1.21, 0.76 + 0.0025 * (30 - 25), 0.76 + 0.0025 * (110 - 25))  # VREFINT, TS_CAL1, TS_CAL2
    struct.pack_into("<3H", memory, _VREFINT_CAL, *(round(level / _VDDA * _FULL_SCALE) for level in volts))
    return bytes(memory)
