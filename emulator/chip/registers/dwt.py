"""Data watchpoint and trace unit (ARMv7-M ARM C1.8)."""

from __future__ import annotations

from fcu_emulator.emulator.chip.registers.declaration import Word
from fcu_emulator.sensors.register import Bits

SOURCE = "ARMv7-M ARM C1.8"
INSTANCES = ("DWT",)
C_PREFIX = "DWT_"  # LSR is also the name of a shift


class CTRL(Word, addr=0x000, reset=0x4000_0000):
    """Control."""

    NUMCOMP = Bits(31, 28, access="r", doc="comparators")
    CYCEVTENA = Bits(22, modelled=False, doc="events of POSTCNT")
    FOLDEVTENA = Bits(21, modelled=False, doc="events of FOLDCNT")
    LSUEVTENA = Bits(20, modelled=False, doc="events of LSUCNT")
    SLEEPEVTENA = Bits(19, modelled=False, doc="events of SLEEPCNT")
    EXCEVTENA = Bits(18, modelled=False, doc="events of EXCCNT")
    CPIEVTENA = Bits(17, modelled=False, doc="events of CPICNT")
    EXCTRCENA = Bits(16, modelled=False, doc="exception trace")
    PCSAMPLENA = Bits(12, modelled=False, doc="PC sampling")
    SYNCTAP = Bits(11, 10, modelled=False, doc="synchronisation packets")
    CYCTAP = Bits(9, modelled=False, doc="bit of CYCCNT that clocks POSTCNT")
    POSTINIT = Bits(8, 5, modelled=False, doc="first value of POSTCNT")
    POSTPRESET = Bits(4, 1, modelled=False, doc="reload value of POSTCNT")
    CYCCNTENA = Bits(0, doc="counts cycles")


class CYCCNT(Word, addr=0x004):
    """Cycle count."""


class CPICNT(Word, addr=0x008, modelled=False):
    """Additional cycles of instructions."""


class EXCCNT(Word, addr=0x00C, modelled=False):
    """Cycles of exception entry and return."""


class SLEEPCNT(Word, addr=0x010, modelled=False):
    """Cycles asleep."""


class LSUCNT(Word, addr=0x014, modelled=False):
    """Additional cycles of loads and stores."""


class FOLDCNT(Word, addr=0x018, modelled=False):
    """Folded instructions."""


class PCSR(Word, addr=0x01C, access="r", modelled=False):
    """Program counter sample."""


class COMPx(Word, addr=0x020, count=4, step=0x10, modelled=False):
    """Comparator: reference value."""


class MASKx(Word, addr=0x024, count=4, step=0x10, modelled=False):
    """Comparator: mask."""


class FUNCTIONx(Word, addr=0x028, count=4, step=0x10, modelled=False):
    """Comparator: function and match."""


class LAR(Word, addr=0xFB0, access="w", modelled=False):
    """Lock access."""


class LSR(Word, addr=0xFB4, access="r", modelled=False):
    """Lock status."""
