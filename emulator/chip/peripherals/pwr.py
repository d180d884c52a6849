"""PWR: voltage scaling, access to the backup domain, low-power mode selection (RM0368 section 5).

The supply never moves: the voltage detector reports "above threshold", scaling is ready at once. Stop and
standby are selected here (PDDS, LPDS) and entered by the core; they are noted as not modelled.
"""

from __future__ import annotations

from typing import ClassVar

from emulator.chip.peripherals.peripheral import WORD, Peripheral

CR, CSR = 0x00, 0x04

_LPDS, _PDDS, _CWUF, _CSBF, _DBP = 1 << 0, 1 << 1, 1 << 2, 1 << 3, 1 << 8
_WUF, _SBF, _BRR, _BRE, _VOSRDY = 1 << 0, 1 << 1, 1 << 3, 1 << 9, 1 << 14


class Pwr(Peripheral):
    """Power control."""

    REGISTERS: ClassVar[dict[int, int]] = {CR: 0x0000_8000, CSR: _VOSRDY}
    NAMES: ClassVar[dict[int, str]] = {CR: "CR", CSR: "CSR"}
    WRITABLE: ClassVar[dict[int, int]] = {CR: 0x0000_DFF3, CSR: 0x0000_0300}

    @property
    def backup_writable(self) -> bool:
        """Whether RTC, backup registers and RCC_BDCR can be written (PWR_CR.DBP, section 5.1.2)."""
        return bool(self.registers[CR] & _DBP)

    def write(self, offset: int, value: int, mask: int = WORD) -> None:
        """Write a register; CWUF and CSBF clear flags of CSR and read as 0."""
        super().write(offset, value, mask)
        value &= mask
        if offset == CR:
            if value & _CWUF:
                self.registers[CSR] &= ~_WUF
            if value & _CSBF:
                self.registers[CSR] &= ~_SBF
            if value & (_LPDS | _PDDS):
                self.note("not modelled", "CR: stop and standby mode (LPDS, PDDS); the core only sleeps")
        elif offset == CSR:
            # the backup regulator is ready at once
            ready = _BRR if self.registers[CSR] & _BRE else 0
            self.registers[CSR] = self.registers[CSR] & ~_BRR | ready
