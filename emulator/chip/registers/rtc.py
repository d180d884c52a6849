"""Real-time clock (RM0368 section 17.6)."""

from __future__ import annotations

from fcu_emulator.emulator.chip.registers.declaration import Word
from fcu_emulator.sensors.register import Bits

SOURCE = "RM0368 17.6"
INSTANCES = ("RTC",)


class TR(Word, addr=0x00):
    """Time, BCD."""

    PM = Bits(22, doc="afternoon")
    HT = Bits(21, 20, doc="hours, tens")
    HU = Bits(19, 16, doc="hours, units")
    MNT = Bits(14, 12, doc="minutes, tens")
    MNU = Bits(11, 8, doc="minutes, units")
    ST = Bits(6, 4, doc="seconds, tens")
    SU = Bits(3, 0, doc="seconds, units")


class DR(Word, addr=0x04, reset=0x2101):
    """Date, BCD."""

    YT = Bits(23, 20, doc="year, tens")
    YU = Bits(19, 16, doc="year, units")
    WDU = Bits(15, 13, doc="weekday, Monday is 1")
    MT = Bits(12, doc="month, tens")
    MU = Bits(11, 8, doc="month, units")
    DT = Bits(5, 4, doc="day, tens")
    DU = Bits(3, 0, doc="day, units")


class CR(Word, addr=0x08):
    """Control."""

    COE = Bits(23, modelled=False, doc="calibration output")
    OSEL = Bits(22, 21, modelled=False, doc="output selection")
    POL = Bits(20, modelled=False, doc="output polarity")
    COSEL = Bits(19, modelled=False, doc="calibration output at 1 Hz")
    BKP = Bits(18, doc="free bit: software can store in it that it is summer time")
    SUB1H = Bits(17, access="w", doc="subtracts an hour")
    ADD1H = Bits(16, access="w", doc="adds an hour")
    TSIE = Bits(15, doc="interrupt on time stamp")
    WUTIE = Bits(14, doc="interrupt on wake-up timer")
    ALRBIE = Bits(13, doc="interrupt on alarm B")
    ALRAIE = Bits(12, doc="interrupt on alarm A")
    TSE = Bits(11, doc="time stamp on")
    WUTE = Bits(10, doc="wake-up timer on")
    ALRBE = Bits(9, doc="alarm B on")
    ALRAE = Bits(8, doc="alarm A on")
    DCE = Bits(7, modelled=False, doc="coarse calibration on")
    FMT = Bits(6, doc="12 hour format")
    BYPSHAD = Bits(5, doc="shadow registers are bypassed")
    REFCKON = Bits(4, modelled=False, doc="reference clock detection")
    TSEDGE = Bits(3, doc="edge of the time stamp")
    WUCKSEL = Bits(2, 0, doc="clock of the wake-up timer")


class ISR(Word, addr=0x0C, access="rc_w0", reset=0x7):
    """Initialisation and status."""

    RECALPF = Bits(16, access="r", doc="recalibration pending")
    TAMP2F = Bits(14, modelled=False, doc="tamper 2")
    TAMP1F = Bits(13, doc="tamper 1")
    TSOVF = Bits(12, doc="time stamp overflow")
    TSF = Bits(11, doc="time stamp")
    WUTF = Bits(10, doc="wake-up timer")
    ALRBF = Bits(9, doc="alarm B")
    ALRAF = Bits(8, doc="alarm A")
    INIT = Bits(7, access="rw", doc="initialisation mode")
    INITF = Bits(6, access="r", doc="the calendar can be written")
    RSF = Bits(5, doc="the shadow registers are up to date")
    INITS = Bits(4, access="r", doc="the year is not 0")
    SHPF = Bits(3, access="r", doc="shift pending")
    WUTWF = Bits(2, access="r", doc="the wake-up timer can be written")
    ALRBWF = Bits(1, access="r", doc="alarm B can be written")
    ALRAWF = Bits(0, access="r", doc="alarm A can be written")


class PRER(Word, addr=0x10, reset=0x007F_00FF):
    """Prescalers."""

    PREDIV_A = Bits(22, 16, doc="asynchronous, minus one")
    PREDIV_S = Bits(14, 0, doc="synchronous, minus one")


class WUTR(Word, addr=0x14, reset=0x0000_FFFF):
    """Wake-up timer."""

    WUT = Bits(15, 0, doc="reload value")


class CALIBR(Word, addr=0x18, modelled=False):
    """Coarse calibration."""

    DCS = Bits(7, doc="sign")
    DC = Bits(4, 0, doc="amount")


class ALRMAR(Word, addr=0x1C):
    """Alarm A."""

    MSK4 = Bits(31, doc="the date is ignored")
    WDSEL = Bits(30, doc="weekday instead of date")
    DT = Bits(29, 28, doc="day, tens")
    DU = Bits(27, 24, doc="day, units")
    MSK3 = Bits(23, doc="the hours are ignored")
    PM = Bits(22, doc="afternoon")
    HT = Bits(21, 20, doc="hours, tens")
    HU = Bits(19, 16, doc="hours, units")
    MSK2 = Bits(15, doc="the minutes are ignored")
    MNT = Bits(14, 12, doc="minutes, tens")
    MNU = Bits(11, 8, doc="minutes, units")
    MSK1 = Bits(7, doc="the seconds are ignored")
    ST = Bits(6, 4, doc="seconds, tens")
    SU = Bits(3, 0, doc="seconds, units")


class ALRMBR(ALRMAR, addr=0x20):
    """Alarm B, like alarm A."""


class WPR(Word, addr=0x24, access="w"):
    """Write protection."""

    KEY = Bits(7, 0, doc="0xCA, then 0x53")


class SSR(Word, addr=0x28, access="r"):
    """Subseconds."""

    SS = Bits(15, 0, doc="the synchronous prescaler's counter")


class SHIFTR(Word, addr=0x2C, access="w"):
    """Shift control."""

    ADD1S = Bits(31, doc="adds a second")
    SUBFS = Bits(14, 0, doc="subtracts a fraction of a second")


class TSTR(Word, addr=0x30, access="r"):
    """Time stamp time."""

    PM = Bits(22, doc="afternoon")
    HT = Bits(21, 20, doc="hours, tens")
    HU = Bits(19, 16, doc="hours, units")
    MNT = Bits(14, 12, doc="minutes, tens")
    MNU = Bits(11, 8, doc="minutes, units")
    ST = Bits(6, 4, doc="seconds, tens")
    SU = Bits(3, 0, doc="seconds, units")


class TSDR(Word, addr=0x34, access="r"):
    """Time stamp date."""

    WDU = Bits(15, 13, doc="weekday")
    MT = Bits(12, doc="month, tens")
    MU = Bits(11, 8, doc="month, units")
    DT = Bits(5, 4, doc="day, tens")
    DU = Bits(3, 0, doc="day, units")


class TSSSR(Word, addr=0x38, access="r"):
    """Time stamp subseconds."""

    SS = Bits(15, 0, doc="subseconds")


class CALR(Word, addr=0x3C):
    """Smooth calibration."""

    CALP = Bits(15, doc="adds pulses")
    CALW8 = Bits(14, doc="cycle of 8 s")
    CALW16 = Bits(13, doc="cycle of 16 s")
    CALM = Bits(8, 0, doc="number of removed pulses")


class TAFCR(Word, addr=0x40):
    """Tamper and alternate function configuration."""

    ALARMOUTTYPE = Bits(18, modelled=False, doc="alarm output is push-pull")
    TSINSEL = Bits(17, modelled=False, doc="time stamp pin")
    TAMP1INSEL = Bits(16, modelled=False, doc="tamper 1 pin")
    TAMPPUDIS = Bits(15, doc="no pull-up")
    TAMPPRCH = Bits(14, 13, modelled=False, doc="precharge")
    TAMPFLT = Bits(12, 11, doc="filter")
    TAMPFREQ = Bits(10, 8, doc="sampling rate")
    TAMPTS = Bits(7, doc="time stamp on tamper")
    TAMP2TRG = Bits(4, modelled=False, doc="tamper 2, edge or level")
    TAMP2E = Bits(3, modelled=False, doc="tamper 2 on")
    TAMPIE = Bits(2, doc="interrupt on tamper")
    TAMP1TRG = Bits(1, doc="tamper 1, edge or level")
    TAMP1E = Bits(0, doc="tamper 1 on")


class ALRMASSR(Word, addr=0x44):
    """Alarm A subseconds."""

    MASKSS = Bits(27, 24, doc="bits that are compared")
    SS = Bits(14, 0, doc="subseconds")


class ALRMBSSR(Word, addr=0x48):
    """Alarm B subseconds."""

    MASKSS = Bits(27, 24, doc="bits that are compared")
    SS = Bits(14, 0, doc="subseconds")


class BKPxR(Word, addr=0x50, count=20, step=0x04):
    """Backup."""
