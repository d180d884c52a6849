"""DWT: the cycle counter CYCCNT (ARMv7-M ARM C1.8); comparators and profiling counters are stored only.

CYCCNT counts while DEMCR.TRCENA and DWT_CTRL.CYCCNTENA are set. It goes on in sleep here, where HCLK runs
on; the manual leaves that to the implementation.
"""

from __future__ import annotations

from typing import ClassVar

from emulator.arm.peripherals.peripheral import WORD, Peripheral
from emulator.arm.soc import Soc
from emulator.clock import PS_PER_S

CTRL, CYCCNT = 0x000, 0x004
LAR, LSR = 0xFB0, 0xFB4

_CYCCNTENA = 1
_TRCENA = 1 << 24


class Dwt(Peripheral):
    """Data watchpoint and trace unit at 0xE0001000."""

    REGISTERS: ClassVar[dict[int, int]] = {
        CTRL: 0x4000_0000,  # four comparators
        **dict.fromkeys(range(CYCCNT, 0x60, 4), 0),
        LAR: 0,
        LSR: 0,
    }
    NAMES: ClassVar[dict[int, str]] = {CTRL: "CTRL", CYCCNT: "CYCCNT", LAR: "LAR", LSR: "LSR"}
    WRITABLE: ClassVar[dict[int, int]] = {CTRL: 0x007F_1FFF, LAR: 0, LSR: 0}

    def __init__(self, soc: Soc, name: str = "DWT", base: int = 0xE000_1000) -> None:
        super().__init__(soc, name, base, 0x1000)
        self._trace_enabled = False
        self._since_ps = 0
        self._hz = soc.clocks.hclk_hz
        soc.clocks.on_change(self._retime)

    def reset(self) -> None:
        """Off, and 0."""
        super().reset()
        self._trace_enabled = False
        self._since_ps, self._hz = self.soc.clock.now_ps, self.soc.clocks.hclk_hz

    def enable(self, demcr: int) -> None:
        """DEMCR has been written; its TRCENA is the unit's main switch."""
        self._settle()
        self._trace_enabled = bool(demcr & _TRCENA)

    def read(self, offset: int) -> int:
        """CYCCNT as of now."""
        value = super().read(offset)
        if offset == CYCCNT and self._trace_enabled and self.registers[CTRL] & _CYCCNTENA:
            value += (self.soc.clock.now_ps - self._since_ps + 1) * self._hz // PS_PER_S
        return value & WORD

    def peek(self, offset: int) -> int:
        """The same."""
        return self.read(offset)

    def write(self, offset: int, value: int, mask: int = WORD) -> None:
        """Firmware sets CYCCNT to 0, and switches it on in CTRL."""
        self._settle()
        super().write(offset, value, mask)

    def pure_read(self, offset: int) -> bool:
        """The counter runs."""
        return offset != CYCCNT

    def _settle(self) -> None:
        """The count so far becomes the value counted on from; times are rounded down by less than 1 ps."""
        now_ps = self.soc.clock.now_ps
        if self._trace_enabled and self.registers[CTRL] & _CYCCNTENA:
            cycles = (now_ps - self._since_ps + 1) * self._hz // PS_PER_S
            self.registers[CYCCNT] = (self.registers[CYCCNT] + cycles) & WORD
        self._since_ps = now_ps

    def _retime(self) -> None:
        self._settle()
        self._hz = self.soc.clocks.hclk_hz
