"""The system control space, 0xE000E000: one block whose registers belong to NVIC, SCB and SysTick.

The MPU (0xE000ED90) is named and not modelled: firmware that sets it up runs as if everything were allowed.
So does unprivileged code (CONTROL.nPRIV), which may even come here.
"""

from __future__ import annotations

from emulator.arm.cpu import scb as scb_registers
from emulator.arm.cpu.nvic import Nvic
from emulator.arm.cpu.scb import Scb
from emulator.arm.cpu.systick import SysTick
from emulator.arm.peripherals.peripheral import WORD, Peripheral
from emulator.arm.soc import Soc

BASE = 0xE000_E000
_MPU_TYPE, _MPU_END = 0xD90, 0xDBC
_EIGHT_REGIONS = 0x800


class SystemControlSpace(Peripheral):
    """Reads and writes go to the part that has the register."""

    def __init__(self, soc: Soc, nvic: Nvic, scb: Scb, systick: SysTick) -> None:
        super().__init__(soc, "SCS", BASE, 0x1000)
        self._systick = systick
        parts: tuple[Nvic | Scb | SysTick, ...] = (nvic, scb, systick)
        self._parts = {offset: part for part in parts for offset in part.OFFSETS}
        self._names = _names()

    def register_name(self, offset: int) -> str:
        """As the architecture manual spells it."""
        return self._names.get(offset, f"offset 0x{offset:03X}")

    def read(self, offset: int) -> int:
        """The word at ``offset``."""
        part = self._parts.get(offset)
        return part.read(offset) if part is not None else self._absent(offset, "read")

    def peek(self, offset: int) -> int:
        """The same without clearing SysTick's COUNTFLAG."""
        if offset in SysTick.OFFSETS:
            return self._systick.peek(offset)
        return self._parts[offset].read(offset) if offset in self._parts else 0

    def write(self, offset: int, value: int, mask: int = WORD) -> None:
        """Write the bits of ``mask``."""
        part = self._parts.get(offset)
        if part is not None:
            part.write(offset, value, mask)
        else:
            self._absent(offset, "written")

    def pure_read(self, offset: int) -> bool:
        """All but SysTick's counter and flag."""
        return offset not in SysTick.OFFSETS or self._systick.pure_read(offset)

    def _absent(self, offset: int, what: str) -> int:
        if _MPU_TYPE <= offset < _MPU_END:
            if what == "written":
                self.note("not modelled", "MPU: set up by the firmware; nothing is protected")
            return _EIGHT_REGIONS if offset == _MPU_TYPE else 0
        self.note("not modelled", f"0x{BASE + offset:08X} {what}; there is no such register")
        return 0


def _names() -> dict[int, str]:
    names = dict(scb_registers.NAMES)
    names |= {0x004: "ICTR", 0x010: "SYST_CSR", 0x014: "SYST_RVR", 0x018: "SYST_CVR", 0x01C: "SYST_CALIB"}
    for base, name in ((0x100, "ISER"), (0x180, "ICER"), (0x200, "ISPR"), (0x280, "ICPR"), (0x300, "IABR")):
        names |= {base + 4 * word: f"NVIC_{name}{word}" for word in range(3)}
    return names | {0x400 + 4 * word: f"NVIC_IPR{word}" for word in range(22)} | {0xF00: "STIR"}
