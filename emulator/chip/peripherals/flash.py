"""FLASH interface: wait states, caches, unlocking (RM0368 section 3.8).

Erasing and programming end with WRPERR and a note. Wait states cost no time, but too few are noted (table 5, 2.7 to 3.6
V).
"""

from __future__ import annotations

from fcu_emulator.emulator.chip.peripherals.peripheral import WORD, InterruptInput, Peripheral, Soc
from fcu_emulator.emulator.chip.registers import DECLARED, flash
from fcu_emulator.emulator.chip.registers.declaration import masks, offsets
from fcu_emulator.emulator.time.clock import PS_PER_MS, Event

ACR, KEYR, OPTKEYR, SR, CR, OPTCR = offsets(
    flash.ACR, flash.KEYR, flash.OPTKEYR, flash.SR, flash.CR, flash.OPTCR
)

_UNLOCK = (0x4567_0123, 0xCDEF_89AB)
_PG, _SER, _STRT = masks(flash.CR.PG, flash.CR.SER, flash.CR.STRT)
_ERRIE, _LOCK = masks(flash.CR.ERRIE, flash.CR.LOCK)
_OPERR, _WRPERR = masks(flash.SR.OPERR, flash.SR.WRPERR)
_HZ_PER_WAIT_STATE = 30_000_000
_CHECK_AFTER_PS = PS_PER_MS
"""Checked after this time, because latency and clock may be set in any order."""


class Flash(Peripheral, declared=DECLARED["FLASH"]):
    """The registers; the core contains the memory."""

    def __init__(self, soc: Soc, name: str, base: int, irq: InterruptInput) -> None:
        super().__init__(soc, name, base)
        self._irq = irq
        self._key_step = 0
        self._key_refused = False
        self._check: Event | None = None
        soc.clocks.on_change(self._check_later)

    def reset(self) -> None:
        super().reset()
        self._key_step, self._key_refused = 0, False
        self._signal()

    def write(self, offset: int, value: int, mask: int = WORD) -> None:
        if offset == KEYR:
            self._unlock(value & mask)
        elif offset == SR:
            self.registers[SR] &= ~(value & mask)
            self._signal()
        elif offset == CR:
            self._control(value & mask, mask)
        elif offset in {OPTKEYR, OPTCR}:
            self.note("not modelled", "option bytes are fixed")
        else:
            super().write(offset, value, mask)
            self._check_later()

    def _unlock(self, key: int) -> None:
        """Unlock CR after two keys; a wrong one locks it until reset (3.6.1)."""
        if self._key_refused:
            return
        if key != _UNLOCK[self._key_step]:
            self._key_refused = True
            self.note("refused", "KEYR: wrong key; FLASH_CR stays locked until reset")
            return
        self._key_step += 1
        if self._key_step == len(_UNLOCK):
            self._key_step = 0
            self.registers[CR] &= ~_LOCK

    def _control(self, value: int, mask: int) -> None:
        if self.registers[CR] & _LOCK:
            self.note("refused", "CR written while it is locked; write the two keys to KEYR first")
            return
        super().write(CR, value, mask)
        if value & _LOCK:
            self.registers[CR] |= _LOCK
        if value & _PG:
            self.note("not modelled", "CR.PG: programming flash; the memory is unchanged")
        if value & _STRT:
            what = "sector" if self.registers[CR] & _SER else "mass"
            self.note("not modelled", f"CR.STRT: {what} erase; the memory is unchanged")
            self.registers[SR] |= _WRPERR
            if self.registers[CR] & _ERRIE:
                self.registers[SR] |= _OPERR  # visible only with the error interrupt enabled (3.8.4)
        self._signal()

    def _signal(self) -> None:
        self._irq.set(self.name, bool(self.registers[CR] & _ERRIE and self.registers[SR] & _OPERR))

    def _check_later(self) -> None:
        if self._check is None and self._missing_wait_states():
            self._check = self.soc.clock.schedule(self.soc.clock.now_ps + _CHECK_AFTER_PS, self._check_limits)

    def _check_limits(self) -> None:
        self._check = None
        needed = self._missing_wait_states()
        if needed:
            hclk_mhz = self.soc.clocks.nominal_hclk_hz / 1e6
            setting = f"ACR.LATENCY = {self.registers[ACR] & 0xF} at HCLK = {hclk_mhz:g} MHz"
            self.note("forbidden", f"{setting}; the flash needs {needed} wait states")

    def _missing_wait_states(self) -> int:
        needed = max(-(-self.soc.clocks.nominal_hclk_hz // _HZ_PER_WAIT_STATE) - 1, 0)
        return needed if needed > self.registers[ACR] & 0xF else 0
