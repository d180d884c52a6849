"""PWR (RM0368 section 5). The supply is constant, and the backup regulator is ready immediately.

:mod:`fcu_emulator.emulator.chip.low_power` enters and leaves Stop and Standby.
"""

from __future__ import annotations

from collections.abc import Callable

from fcu_emulator.emulator.chip.peripherals.peripheral import WORD, Peripheral, Soc
from fcu_emulator.emulator.chip.registers import DECLARED, pwr
from fcu_emulator.emulator.chip.registers.declaration import masks, offsets

CR, CSR = offsets(pwr.CR, pwr.CSR)

LPDS, PDDS, FPDS = masks(pwr.CR.LPDS, pwr.CR.PDDS, pwr.CR.FPDS)
_CWUF, _CSBF, _DBP = masks(pwr.CR.CWUF, pwr.CR.CSBF, pwr.CR.DBP)
WUF, SBF, EWUP = masks(pwr.CSR.WUF, pwr.CSR.SBF, pwr.CSR.EWUP)
_BRR, _BRE = masks(pwr.CSR.BRR, pwr.CSR.BRE)
_WKUP = ("A", 0)


class Pwr(Peripheral, declared=DECLARED["PWR"]):
    """Power control."""

    def __init__(self, soc: Soc, name: str, base: int) -> None:
        super().__init__(soc, name, base)
        self.in_standby = False
        self.on_wake_up: Callable[[], None] = lambda: None
        """Called at each wake-up event."""
        self._watches_pin = False

    @property
    def backup_writable(self) -> bool:
        """Whether PWR_CR.DBP allows writes to the backup domain (5.1.2)."""
        return bool(self.registers[CR] & _DBP)

    def reset(self) -> None:
        """Reset CR. A system reset keeps SBF and BRE of CSR; the end of Standby keeps all of CSR (5.4.2)."""
        kept = WORD if self.in_standby else SBF | _BRE | _BRR
        self.in_standby = False
        status = self.registers[CSR] & kept
        super().reset()
        self.registers[CSR] |= status

    def write(self, offset: int, value: int, mask: int = WORD) -> None:
        before = self.registers.get(offset, 0)
        super().write(offset, value, mask)
        value &= mask
        if offset == CR:
            if value & _CWUF:
                self.registers[CSR] &= ~WUF
            if value & _CSBF:
                self.registers[CSR] &= ~SBF
        elif offset == CSR:
            ready = _BRR if self.registers[CSR] & _BRE else 0
            self.registers[CSR] = self.registers[CSR] & ~_BRR | ready
            if self.registers[CSR] & ~before & EWUP:
                self._enable_pin()

    def wake_up(self) -> None:
        """Record an event of the WKUP pin or the RTC (5.4.2, WUF)."""
        self.registers[CSR] |= WUF
        self.on_wake_up()

    def _enable_pin(self) -> None:
        """Watch PA0, which EWUP pulls down. A high level counts as an edge (5.4.2)."""
        if not self._watches_pin:
            self._watches_pin = True
            self.soc.gpio.listen(*_WKUP, self._pin_changed)
        self._pin_changed(self.soc.gpio.reads(*_WKUP))

    def _pin_changed(self, level: int) -> None:
        if level and self.registers[CSR] & EWUP:
            self.wake_up()
