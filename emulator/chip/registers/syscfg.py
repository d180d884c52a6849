"""System configuration controller (RM0368 section 7.2)."""

from __future__ import annotations

from fcu_emulator.emulator.chip.registers.declaration import Word
from fcu_emulator.sensors.register import Bits

SOURCE = "RM0368 7.2"
INSTANCES = ("SYSCFG",)


class MEMRMP(Word, addr=0x00):
    """Memory remap."""

    MEM_MODE = Bits(1, 0, modelled=False, doc="memory at address 0")


class PMC(Word, addr=0x04):
    """Peripheral mode configuration."""

    ADC1DC2 = Bits(16, modelled=False, doc="see AN4073")


class EXTICR1(Word, addr=0x08):
    """External interrupt configuration, lines 0 to 3."""

    EXTIx = Bits(3, 0, count=4, step=4, doc="port A to E, H as 7")


class EXTICR2(Word, addr=0x0C):
    """External interrupt configuration, lines 4 to 7."""

    EXTIx = Bits(3, 0, count=4, step=4, first=4, doc="port A to E, H as 7")


class EXTICR3(Word, addr=0x10):
    """External interrupt configuration, lines 8 to 11."""

    EXTIx = Bits(3, 0, count=4, step=4, first=8, doc="port A to E, H as 7")


class EXTICR4(Word, addr=0x14):
    """External interrupt configuration, lines 12 to 15."""

    EXTIx = Bits(3, 0, count=4, step=4, first=12, doc="port A to E, H as 7")


class CMPCR(Word, addr=0x20, access="r"):
    """Compensation cell control."""

    READY = Bits(8, doc="the cell is ready")
    CMP_PD = Bits(0, access="rw", doc="the cell is on")
