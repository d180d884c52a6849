"""System timer (ARMv7-M ARM B3.3, PM0214 4.5); offsets in the system control space."""

from __future__ import annotations

from fcu_emulator.emulator.chip.registers.declaration import Word
from fcu_emulator.sensors.register import Bits

SOURCE = "PM0214 4.5"
INSTANCES = ("SysTick",)


class SYST_CSR(Word, addr=0x010):
    """Control and status."""

    COUNTFLAG = Bits(16, access="r", doc="the counter has reached 0 since the last read")
    CLKSOURCE = Bits(2, doc="HCLK instead of HCLK / 8")
    TICKINT = Bits(1, doc="makes the exception pending")
    ENABLE = Bits(0, doc="counts")


class SYST_RVR(Word, addr=0x014):
    """Reload value."""

    RELOAD = Bits(23, 0, doc="the period, minus one")


class SYST_CVR(Word, addr=0x018):
    """Current value; any write clears it."""

    CURRENT = Bits(23, 0, doc="the counter")


class SYST_CALIB(Word, addr=0x01C, access="r", reset=0x4000_2904):
    """Calibration value."""

    NOREF = Bits(31, doc="there is no other clock")
    SKEW = Bits(30, doc="TENMS is not exact")
    TENMS = Bits(23, 0, doc="number of counts in 1 ms at 84 MHz / 8")
