"""External interrupt and event controller (RM0368 section 10.3)."""

from __future__ import annotations

from fcu_emulator.emulator.chip.registers.declaration import Word
from fcu_emulator.sensors.register import Bits

SOURCE = "RM0368 10.3"
INSTANCES = ("EXTI",)


class IMR(Word, addr=0x00):
    """Interrupt mask."""

    MRx = Bits(0, count=23, doc="the line's interrupt is let through")


class EMR(Word, addr=0x04):
    """Event mask."""

    MRx = Bits(0, count=23, doc="the line's event is let through")


class RTSR(Word, addr=0x08):
    """Rising trigger selection."""

    TRx = Bits(0, count=23, doc="rising edges count")


class FTSR(Word, addr=0x0C):
    """Falling trigger selection."""

    TRx = Bits(0, count=23, doc="falling edges count")


class SWIER(Word, addr=0x10):
    """Software interrupt event."""

    SWIERx = Bits(0, count=23, doc="raises the line")


class PR(Word, addr=0x14, access="rc_w1"):
    """Pending."""

    PRx = Bits(0, count=23, doc="an edge has come")
