"""PWR (RM0368 section 5). The supply is constant; stop and standby are not modelled."""

from __future__ import annotations

from fcu_emulator.emulator.chip.peripherals.peripheral import WORD, Peripheral
from fcu_emulator.emulator.chip.registers import DECLARED, pwr
from fcu_emulator.emulator.chip.registers.declaration import masks, offsets

CR, CSR = offsets(pwr.CR, pwr.CSR)

_LPDS, _PDDS, _CWUF, _CSBF, _DBP = masks(pwr.CR.LPDS, pwr.CR.PDDS, pwr.CR.CWUF, pwr.CR.CSBF, pwr.CR.DBP)
_WUF, _SBF, _BRR, _BRE = masks(pwr.CSR.WUF, pwr.CSR.SBF, pwr.CSR.BRR, pwr.CSR.BRE)


class Pwr(Peripheral, declared=DECLARED["PWR"]):
    """Power control."""

    @property
    def backup_writable(self) -> bool:
        """Whether PWR_CR.DBP allows writes to the backup domain (5.1.2)."""
        return bool(self.registers[CR] & _DBP)

    def write(self, offset: int, value: int, mask: int = WORD) -> None:
        super().write(offset, value, mask)
        value &= mask
        if offset == CR:
            if value & _CWUF:
                self.registers[CSR] &= ~_WUF
            if value & _CSBF:
                self.registers[CSR] &= ~_SBF
            if value & (_LPDS | _PDDS):
                self.note(
                    "not modelled",
                    "stop-standby",
                    "CR: stop and standby mode (LPDS, PDDS); the core only sleeps",
                )
        elif offset == CSR:
            # the backup regulator is ready immediately
            ready = _BRR if self.registers[CSR] & _BRE else 0
            self.registers[CSR] = self.registers[CSR] & ~_BRR | ready
