"""Power controller (RM0368 section 5.4)."""

from __future__ import annotations

from fcu_emulator.emulator.chip.registers.declaration import Word
from fcu_emulator.sensors.register import Bits

SOURCE = "RM0368 5.4"
INSTANCES = ("PWR",)


class CR(Word, addr=0x00, reset=0x0000_8000):
    """Power control."""

    VOS = Bits(15, 14, doc="voltage scaling")
    ADCDC1 = Bits(13, modelled=False, doc="see AN4073")
    MRLVDS = Bits(11, modelled=False, doc="main regulator at low voltage in stop mode")
    LPLVDS = Bits(10, modelled=False, doc="low-power regulator at low voltage in stop mode")
    FPDS = Bits(9, doc="flash powered down in stop mode")
    DBP = Bits(8, doc="RTC, backup registers and RCC_BDCR can be written")
    PLS = Bits(7, 5, modelled=False, doc="level of the voltage detector")
    PVDE = Bits(4, modelled=False, doc="voltage detector on")
    CSBF = Bits(3, access="w", doc="clears SBF")
    CWUF = Bits(2, access="w", doc="clears WUF")
    PDDS = Bits(1, doc="deep sleep is standby")
    LPDS = Bits(0, doc="low-power regulator in stop mode")


class CSR(Word, addr=0x04, reset=0x0000_4000):
    """Power control and status."""

    VOSRDY = Bits(14, access="r", doc="voltage scaling is ready")
    BRE = Bits(9, doc="backup regulator on")
    EWUP = Bits(8, doc="WKUP pin on")
    BRR = Bits(3, access="r", doc="backup regulator is ready")
    PVDO = Bits(2, access="r", modelled=False, doc="supply below the detector's level")
    SBF = Bits(1, access="r", doc="standby was entered")
    WUF = Bits(0, access="r", doc="a wake-up has occurred")
