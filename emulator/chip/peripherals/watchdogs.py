"""The watchdogs: IWDG on LSI (RM0368 section 15), and WWDG on PCLK1 / 4096 (section 16).

LSI is 32 kHz in the model, but 17 to 47 kHz on the board. A reload of IWDG applies new settings
(PVU and RVU are not modelled), but does not reset the prescaler. On the chip, the first count of
WWDG may be shorter.
"""

from __future__ import annotations

from fcu_emulator.emulator.chip.peripherals.peripheral import (
    NOT_CACHEABLE_PS,
    WORD,
    InterruptInput,
    Peripheral,
    Soc,
)
from fcu_emulator.emulator.chip.peripherals.rcc import LSI_HZ
from fcu_emulator.emulator.chip.registers import DECLARED, iwdg, wwdg
from fcu_emulator.emulator.chip.registers.declaration import masks, offsets
from fcu_emulator.emulator.clock import NEVER_PS, PS_PER_S, Event

# -- IWDG ---------------------------------------------------------------------------------------------------

IWDG_KR, IWDG_PR, IWDG_RLR = offsets(iwdg.KR, iwdg.PR, iwdg.RLR)

_UNLOCK, _RELOAD, _START = 0x5555, 0xAAAA, 0xCCCC


class Iwdg(Peripheral, declared=DECLARED["IWDG"]):
    """The independent watchdog, which can be stopped only by a reset."""

    def __init__(self, soc: Soc, name: str, base: int) -> None:
        super().__init__(soc, name, base)
        self._unlocked = False
        self._deadline_ps: int | None = None
        self._event: Event | None = None
        self._event_ps = 0
        self._since_ps = 0  # time at which the prescaler started
        self._same_until_ps = NOT_CACHEABLE_PS

    def reset(self) -> None:
        super().reset()
        self._unlocked = False
        self._deadline_ps = None
        if self._event is not None:
            self._event.cancel()
            self._event = None

    def write(self, offset: int, value: int, mask: int = WORD) -> None:
        """Write a register; PR and RLR need the key 0x5555 (15.3.2)."""
        if offset == IWDG_KR:
            self._take_key(value & mask & 0xFFFF)
        elif not self._unlocked:
            name = self.NAMES.get(offset, f"0x{offset:02X}")
            self.note("refused", "no-key", f"{name} written without the key 0x5555 in KR", register=name)
        else:
            super().write(offset, value, mask)

    def _take_key(self, key: int) -> None:
        self._unlocked = key == _UNLOCK
        if key == (_START if self._deadline_ps is None else _RELOAD):
            self._reload()

    def _reload(self) -> None:
        """Reload the counter. The event of the previous deadline stays scheduled; when it is due, it
        schedules the later deadline."""
        divider = 4 << min(self.registers[IWDG_PR], 6)
        if self._deadline_ps is None:
            self._since_ps = self.soc.clock.now_ps
        counts = (self.soc.clock.now_ps - self._since_ps) * LSI_HZ // (divider * PS_PER_S)
        self._same_until_ps = self._after(divider * (counts + 1))
        self._deadline_ps = self._after(divider * (counts + self.registers[IWDG_RLR] + 1))
        if self._event is None:
            self._event = self.soc.clock.schedule(self._deadline_ps, self._due)
        elif self._deadline_ps < self._event_ps:
            self._event.cancel()
            self._event = self.soc.clock.schedule(self._deadline_ps, self._due)
        else:
            return
        self._event_ps = self._deadline_ps

    def _after(self, cycles: int) -> int:
        return self._since_ps - (-cycles * PS_PER_S // LSI_HZ)

    def same_write_until_ps(self, offset: int, value: int) -> int:
        """Return the end of the current count."""
        if offset != IWDG_KR or value & 0xFFFF != _RELOAD:
            return NOT_CACHEABLE_PS
        return NEVER_PS if self._deadline_ps is None else self._same_until_ps

    @property
    def is_running(self) -> bool:
        return self._deadline_ps is not None

    def _due(self) -> None:
        assert self._event is not None
        assert self._deadline_ps is not None
        if self._deadline_ps > self.soc.clock.now_ps:
            self._event_ps = self._deadline_ps
            self.soc.clock.repeat(self._event, self._deadline_ps)
            return
        self._event = None
        self.soc.reset("IWDG")


# -- WWDG ---------------------------------------------------------------------------------------------------

WWDG_CR, WWDG_CFR, WWDG_SR = offsets(wwdg.CR, wwdg.CFR, wwdg.SR)

_WDGA, _EWI, _EWIF = masks(wwdg.CR.WDGA, wwdg.CFR.EWI, wwdg.SR.EWIF)
_T6 = 1 << 6  # highest bit of CR.T: the chip is reset if this bit is 0


class Wwdg(Peripheral, declared=DECLARED["WWDG"]):
    """The window watchdog. It resets the chip if its counter is below 0x40, or if CR is written while the
    counter is above the window.
    """

    def __init__(self, soc: Soc, name: str, base: int, irq: InterruptInput) -> None:
        super().__init__(soc, name, base)
        self._irq = irq
        self._hz = soc.clocks.pclk1_hz
        self._since_ps = 0
        self._frozen = False
        self._event: Event | None = None
        soc.clocks.on_change(self._clock_changed)

    def reset(self) -> None:
        super().reset()
        self._hz = self.soc.clocks.pclk1_hz
        self._plan()
        self._irq.set(self.name, False)

    def read(self, offset: int) -> int:
        return self.peek(offset)

    def peek(self, offset: int) -> int:
        value = super().peek(offset)
        return value & _WDGA | self._counter() if offset == WWDG_CR else value

    def pure_read(self, offset: int) -> bool:
        return offset != WWDG_CR

    def write(self, offset: int, value: int, mask: int = WORD) -> None:
        if offset == WWDG_CR:
            self._reload(value, mask)
        elif offset == WWDG_CFR:
            self._store_counter()
            early = self.registers[WWDG_CFR] & _EWI  # only a reset clears EWI (16.6.2)
            super().write(offset, value, mask)
            self.registers[WWDG_CFR] |= early
            self._plan()
        elif offset == WWDG_SR:
            self.registers[WWDG_SR] &= value | ~mask
            self._plan()
        self._irq.set(self.name, bool(self.registers[WWDG_CFR] & _EWI and self.registers[WWDG_SR] & _EWIF))

    def _reload(self, value: int, mask: int) -> None:
        running = self.registers[WWDG_CR] & _WDGA
        if running and self._counter() > wwdg.CFR.W.get(self.registers[WWDG_CFR]):
            self.soc.reset("WWDG")
            return
        super().write(WWDG_CR, value, mask)
        self.registers[WWDG_CR] |= running | value & mask & _WDGA
        self._since_ps = self.soc.clock.now_ps
        if self.registers[WWDG_CR] & _WDGA and not self.registers[WWDG_CR] & _T6:
            self.soc.reset("WWDG")
            return
        self._plan()

    def freeze(self, frozen: bool) -> None:
        """Stop the counter in Stop, or let it continue."""
        if self._frozen != frozen:
            self._store_counter()
            self._frozen = frozen
            self._plan()

    def _counter(self) -> int:
        value = wwdg.CR.T.get(self.registers[WWDG_CR])
        if not self.registers[WWDG_CR] & _WDGA or self._frozen:
            return value
        elapsed_ps = self.soc.clock.now_ps - self._since_ps
        counts = ((elapsed_ps + 1) * self._hz - 1) // (PS_PER_S * self._divider())
        return max(value - counts, 0)

    def _divider(self) -> int:
        return 4096 << wwdg.CFR.WDGTB.get(self.registers[WWDG_CFR])

    def _store_counter(self) -> None:
        self.registers[WWDG_CR] = self.registers[WWDG_CR] & _WDGA | self._counter()
        self._since_ps = self.soc.clock.now_ps

    def _clock_changed(self) -> None:
        running = self.registers[WWDG_CR] & _WDGA
        if running:
            self._store_counter()
        self._hz = self.soc.clocks.pclk1_hz
        if running:
            self._plan()

    def _plan(self) -> None:
        """Schedule the next event: the early wake-up at the count 0x40, or the reset."""
        if self._event is not None:
            self._event.cancel()
            self._event = None
        if not self.registers[WWDG_CR] & _WDGA or self._frozen:
            return
        counter = wwdg.CR.T.get(self.registers[WWDG_CR])
        early = self._counter() > _T6 and not self.registers[WWDG_SR] & _EWIF
        counts = counter - (_T6 if early else _T6 - 1)
        at_ps = self._since_ps + counts * self._divider() * PS_PER_S // self._hz
        self._event = self.soc.clock.schedule(at_ps, self._due)

    def _due(self) -> None:
        self._event = None
        if self._counter() < _T6:
            self.soc.reset("WWDG")
            return
        self.registers[WWDG_SR] |= _EWIF
        self._plan()
        self._irq.set(self.name, bool(self.registers[WWDG_CFR] & _EWI))
