"""EXTI: 23 edge detectors on pins and inner signals (RM0368 section 10.2; interrupt numbers of table 38).

Lines 0 to 15 are pins, chosen by SYSCFG; 16 the voltage detector, 17 the RTC's alarm, 18 USB wake-up, 21
the RTC's tamper and time stamp, 22 its wake-up timer; 19 and 20 do not exist on this chip.

The pending bit is set by an edge whether or not IMR lets it through, as figure 29 draws it; the text about
SWIER asks for IMR, and is followed for SWIER. Event mode (EMR, a wake-up for WFE without an interrupt) is
not modelled.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from typing import ClassVar

from emulator.arm.peripherals.irq_line import IrqLine
from emulator.arm.peripherals.peripheral import WORD, Peripheral
from emulator.arm.peripherals.syscfg import Syscfg
from emulator.arm.soc import Soc

IMR, EMR, RTSR, FTSR, SWIER, PR = 0x00, 0x04, 0x08, 0x0C, 0x10, 0x14

_LINES = 0x007F_FFFF
_GROUPS = {  # interrupt number: the lines that raise it
    6: 1 << 0,
    7: 1 << 1,
    8: 1 << 2,
    9: 1 << 3,
    10: 1 << 4,
    23: 0x0000_03E0,
    40: 0x0000_FC00,
    1: 1 << 16,
    41: 1 << 17,
    42: 1 << 18,
    2: 1 << 21,
    3: 1 << 22,
}

NUMBERS = tuple(_GROUPS)
"""The interrupt numbers EXTI drives."""


class Exti(Peripheral):
    """External interrupt controller. ``irqs``: the lines by interrupt number, for all of ``NUMBERS``."""

    REGISTERS: ClassVar[dict[int, int]] = {IMR: 0, EMR: 0, RTSR: 0, FTSR: 0, SWIER: 0, PR: 0}
    NAMES: ClassVar[dict[int, str]] = {
        IMR: "IMR",
        EMR: "EMR",
        RTSR: "RTSR",
        FTSR: "FTSR",
        SWIER: "SWIER",
        PR: "PR",
    }
    WRITABLE: ClassVar[dict[int, int]] = dict.fromkeys((IMR, EMR, RTSR, FTSR, SWIER), _LINES)

    def __init__(self, soc: Soc, name: str, base: int, syscfg: Syscfg, irqs: Mapping[int, IrqLine]) -> None:
        super().__init__(soc, name, base)
        self._irqs = irqs
        self._syscfg = syscfg
        self._levels = 0  # what each line saw last
        self._ports = ["A"] * 16  # of lines 0 to 15; kept here because every edge of every pin asks
        for port in "ABCDEH":
            for pin in range(16):
                soc.gpio.listen(port, pin, partial(self._pin_changed, port, pin))
        syscfg.on_change(self._sources_changed)

    def reset(self) -> None:
        """No line enabled, nothing pending."""
        super().reset()
        self._signal()

    def set_line(self, line: int, level: bool) -> None:
        """A line's input: a pin, or an inner signal for lines 16 and up."""
        bit = 1 << line
        if bool(self._levels & bit) is level:
            return
        self._levels ^= bit
        if self.registers[RTSR if level else FTSR] & bit:
            self.registers[PR] |= bit
            self._signal()

    def write(self, offset: int, value: int, mask: int = WORD) -> None:
        """Write a register; PR clears where 1 is written, and SWIER with it (10.3.5, 10.3.6)."""
        value &= mask
        if offset == PR:
            self.registers[PR] &= ~value
            self.registers[SWIER] &= ~value
        elif offset == SWIER:
            rising = value & ~self.registers[SWIER] & _LINES
            self.registers[SWIER] |= rising
            self.registers[PR] |= rising & self.registers[IMR]
        else:
            super().write(offset, value, mask)
            if offset == EMR and self.registers[EMR]:
                self.note("not modelled", "EMR: events that wake WFE without an interrupt")
        self._signal()

    def _pin_changed(self, port: str, pin: int, level: int) -> None:
        if self._ports[pin] == port:
            self.set_line(pin, level == 1)

    def _sources_changed(self) -> None:
        """Another pin on a line is an edge if it has another level."""
        self._ports = [self._syscfg.port_of(line) for line in range(16)]
        for line, port in enumerate(self._ports):
            self.set_line(line, port != "?" and bool(self.soc.gpio.reads(port, line)))

    def _signal(self) -> None:
        active = self.registers[PR] & self.registers[IMR]
        for number, lines in _GROUPS.items():
            self._irqs[number].set(self.name, bool(active & lines))
