"""SYSCFG: which port each EXTI line listens to (RM0368 section 7).

Memory remapping is stored and has no effect: address 0 is always the flash, as the board's boot pins
select.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import ClassVar

from emulator.arm.peripherals.peripheral import WORD, Peripheral
from emulator.arm.soc import Soc

MEMRMP, PMC, EXTICR1, EXTICR4, CMPCR = 0x00, 0x04, 0x08, 0x14, 0x20

_PORTS = "ABCDE??H"  # 7.2.3 to 7.2.6
_CMP_PD, _READY = 1 << 0, 1 << 8


class Syscfg(Peripheral):
    """System configuration."""

    REGISTERS: ClassVar[dict[int, int]] = {MEMRMP: 0, PMC: 0, 0x08: 0, 0x0C: 0, 0x10: 0, 0x14: 0, CMPCR: 0}
    NAMES: ClassVar[dict[int, str]] = {
        MEMRMP: "MEMRMP",
        PMC: "PMC",
        0x08: "EXTICR1",
        0x0C: "EXTICR2",
        0x10: "EXTICR3",
        0x14: "EXTICR4",
        CMPCR: "CMPCR",
    }
    WRITABLE: ClassVar[dict[int, int]] = {
        MEMRMP: 0x3,
        PMC: 0x0001_0000,
        **dict.fromkeys((0x08, 0x0C, 0x10, 0x14), 0xFFFF),
        CMPCR: _CMP_PD,
    }

    def __init__(self, soc: Soc, name: str, base: int) -> None:
        super().__init__(soc, name, base)
        self._listeners: list[Callable[[], None]] = []

    def on_change(self, changed: Callable[[], None]) -> None:
        """Call ``changed()`` after the source of an EXTI line may have become another port."""
        self._listeners.append(changed)

    def port_of(self, line: int) -> str:
        """The port letter that EXTI line 0 to 15 listens to; "?" for a code without a port."""
        selection = self.registers[EXTICR1 + line // 4 * 4] >> line % 4 * 4 & 0xF
        return _PORTS[selection] if selection < len(_PORTS) else "?"

    def reset(self) -> None:
        """All lines back to port A."""
        super().reset()
        self._tell()

    def write(self, offset: int, value: int, mask: int = WORD) -> None:
        """Write a register."""
        super().write(offset, value, mask)
        if offset == MEMRMP and self.registers[MEMRMP]:
            self.note("not modelled", "MEMRMP: address 0 stays the flash")
        elif offset == CMPCR:
            self.registers[CMPCR] = (self.registers[CMPCR] & _CMP_PD) * (_CMP_PD | _READY)
        elif EXTICR1 <= offset <= EXTICR4:
            self._tell()

    def _tell(self) -> None:
        for changed in self._listeners:
            changed()
