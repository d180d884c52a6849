"""Nested vectored interrupt controller (ARMv7-M ARM B3.4); offsets in the system control space."""

from __future__ import annotations

from fcu_emulator.emulator.chip.registers.declaration import Word
from fcu_emulator.sensors.register import Bits

SOURCE = "PM0214 4.3"
INSTANCES = ("NVIC",)


class ICTR(Word, addr=0x004, access="r", reset=0x2):
    """Interrupt controller type."""

    INTLINESNUM = Bits(3, 0, doc="number of groups of 32 interrupts, minus one")


class NVIC_ISERx(Word, addr=0x100, count=3, step=0x04):
    """Interrupt set-enable."""


class NVIC_ICERx(Word, addr=0x180, count=3, step=0x04):
    """Interrupt clear-enable."""


class NVIC_ISPRx(Word, addr=0x200, count=3, step=0x04):
    """Interrupt set-pending."""


class NVIC_ICPRx(Word, addr=0x280, count=3, step=0x04):
    """Interrupt clear-pending."""


class NVIC_IABRx(Word, addr=0x300, count=3, step=0x04, access="r"):
    """Interrupt active bit."""


class NVIC_IPRx(Word, addr=0x400, count=22, step=0x04):
    """Interrupt priority, four interrupts each."""

    PRI_Nx = Bits(7, 0, count=4, step=8, doc="priority; only the upper four bits are implemented")


class STIR(Word, addr=0xF00, access="w"):
    """Software trigger interrupt."""

    INTID = Bits(8, 0, doc="number of the interrupt")
