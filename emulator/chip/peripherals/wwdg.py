"""WWDG: the window watchdog, a seven-bit counter on PCLK1 / 4096 (RM0368 section 16).

The counter moves with time from the moment it was written; on the chip its prescaler runs freely, so the
first count may come up to one period earlier there. Before WDGA is set the counter stands still here.
"""

from __future__ import annotations

from typing import ClassVar

from emulator.chip.peripherals.irq_line import IrqLine
from emulator.chip.peripherals.peripheral import WORD, Peripheral
from emulator.chip.soc import Soc
from emulator.time.clock import PS_PER_S, Event

CR, CFR, SR = 0x00, 0x04, 0x08

_WDGA, _T6, _EWI, _EWIF = 1 << 7, 1 << 6, 1 << 9, 1 << 0


class Wwdg(Peripheral):
    """Resets the chip when the counter passes 0x40, or is written while it is above the window."""

    REGISTERS: ClassVar[dict[int, int]] = {CR: 0x7F, CFR: 0x7F, SR: 0}
    NAMES: ClassVar[dict[int, str]] = {CR: "CR", CFR: "CFR", SR: "SR"}
    WRITABLE: ClassVar[dict[int, int]] = {CR: 0x7F, CFR: 0x3FF, SR: 0}

    def __init__(self, soc: Soc, name: str, base: int, irq: IrqLine) -> None:
        super().__init__(soc, name, base)
        self._irq = irq
        self._hz = soc.clocks.pclk1_hz
        self._since_ps = 0
        self._event: Event | None = None
        soc.clocks.on_change(self._clock_changed)

    def reset(self) -> None:
        """Not started."""
        super().reset()
        self._hz = self.soc.clocks.pclk1_hz
        self._plan()
        self._irq.set(self.name, False)

    def read(self, offset: int) -> int:
        """A register; CR shows the counter as of now."""
        return self.peek(offset)

    def peek(self, offset: int) -> int:
        """A register as of now."""
        value = super().peek(offset)
        return value & _WDGA | self._counter() if offset == CR else value

    def pure_read(self, offset: int) -> bool:
        """False for the counter."""
        return offset != CR

    def write(self, offset: int, value: int, mask: int = WORD) -> None:
        """Reload the counter (CR), set window, prescaler and early wake-up (CFR), clear the flag (SR)."""
        if offset == CR:
            self._reload(value, mask)
        elif offset == CFR:
            self._store_counter()
            early = self.registers[CFR] & _EWI  # only a reset clears it (16.6.2)
            super().write(offset, value, mask)
            self.registers[CFR] |= early
            self._plan()
        elif offset == SR:
            self.registers[SR] &= value | ~mask
            self._plan()
        self._irq.set(self.name, bool(self.registers[CFR] & _EWI and self.registers[SR] & _EWIF))

    def _reload(self, value: int, mask: int) -> None:
        running = self.registers[CR] & _WDGA
        if running and self._counter() > self.registers[CFR] & 0x7F:
            self.soc.reset("WWDG")
            return
        super().write(CR, value, mask)
        self.registers[CR] |= running | value & mask & _WDGA
        self._since_ps = self.soc.clock.now_ps
        if self.registers[CR] & _WDGA and not self.registers[CR] & _T6:
            self.soc.reset("WWDG")
            return
        self._plan()

    def _counter(self) -> int:
        value = self.registers[CR] & 0x7F
        if not self.registers[CR] & _WDGA:
            return value
        elapsed_ps = self.soc.clock.now_ps - self._since_ps
        counts = ((elapsed_ps + 1) * self._hz - 1) // (PS_PER_S * self._divider())
        return max(value - counts, 0)

    def _divider(self) -> int:
        return 4096 << (self.registers[CFR] >> 7 & 3)

    def _store_counter(self) -> None:
        self.registers[CR] = self.registers[CR] & _WDGA | self._counter()
        self._since_ps = self.soc.clock.now_ps

    def _clock_changed(self) -> None:
        self._store_counter()
        self._hz = self.soc.clocks.pclk1_hz
        self._plan()

    def _plan(self) -> None:
        """The next thing to happen: the early wake-up at 0x40, or the reset one count later."""
        if self._event is not None:
            self._event.cancel()
            self._event = None
        if not self.registers[CR] & _WDGA:
            return
        counter = self.registers[CR] & 0x7F
        early = self._counter() > _T6 and not self.registers[SR] & _EWIF
        counts = counter - (_T6 if early else _T6 - 1)
        at_ps = self._since_ps + counts * self._divider() * PS_PER_S // self._hz
        self._event = self.soc.clock.schedule(at_ps, self._due)

    def _due(self) -> None:
        self._event = None
        if self._counter() < _T6:
            self.soc.reset("WWDG")
            return
        self.registers[SR] |= _EWIF
        self._plan()
        self._irq.set(self.name, bool(self.registers[CFR] & _EWI))
