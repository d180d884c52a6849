"""Window watchdog (RM0368 section 16.6)."""

from __future__ import annotations

from fcu_emulator.emulator.chip.registers.declaration import Word
from fcu_emulator.sensors.register import Bits

SOURCE = "RM0368 16.6"
INSTANCES = ("WWDG",)


class CR(Word, addr=0x00, reset=0x7F):
    """Control."""

    WDGA = Bits(7, access="rs", doc="started")
    T = Bits(6, 0, doc="the counter")


class CFR(Word, addr=0x04, reset=0x7F):
    """Configuration."""

    EWI = Bits(9, doc="early wake-up interrupt")
    WDGTB = Bits(8, 7, doc="PCLK1 / 4096 divided by 1 to 8")
    W = Bits(6, 0, doc="the window")


class SR(Word, addr=0x08, access="rc_w0"):
    """Status."""

    EWIF = Bits(0, doc="the counter was at 0x40")
