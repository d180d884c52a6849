"""Embedded flash memory interface (RM0368 section 3.8)."""

from __future__ import annotations

from fcu_emulator.emulator.chip.registers.declaration import Word
from fcu_emulator.sensors.register import Bits

SOURCE = "RM0368 3.8"
INSTANCES = ("FLASH",)


class ACR(Word, addr=0x00):
    """Access control."""

    DCRST = Bits(12, modelled=False, doc="clears the data cache")
    ICRST = Bits(11, modelled=False, doc="clears the instruction cache")
    DCEN = Bits(10, modelled=False, doc="data cache on")
    ICEN = Bits(9, modelled=False, doc="instruction cache on")
    PRFTEN = Bits(8, modelled=False, doc="prefetch on")
    LATENCY = Bits(3, 0, doc="wait states")


class KEYR(Word, addr=0x04, access="w"):
    """Key register: two keys in a row unlock CR."""

    KEY = Bits(31, 0, doc="0x45670123, then 0xCDEF89AB")


class OPTKEYR(Word, addr=0x08, access="w", modelled=False):
    """Option key."""

    OPTKEYR = Bits(31, 0, doc="0x08192A3B, then 0x4C5D6E7F")


class SR(Word, addr=0x0C, access="rc_w1"):
    """Status."""

    BSY = Bits(16, access="r", doc="an operation is in progress")
    RDERR = Bits(8, modelled=False, doc="read protection")
    PGSERR = Bits(7, doc="wrong sequence")
    PGPERR = Bits(6, doc="wrong parallelism")
    PGAERR = Bits(5, modelled=False, doc="wrong alignment")
    WRPERR = Bits(4, modelled=False, doc="write protection")
    OPERR = Bits(1, doc="an operation has failed")
    EOP = Bits(0, doc="end of an operation")


class CR(Word, addr=0x10, reset=0x8000_0000):
    """Control."""

    LOCK = Bits(31, access="rs", doc="locked")
    ERRIE = Bits(25, doc="interrupt on OPERR")
    EOPIE = Bits(24, doc="interrupt on EOP")
    STRT = Bits(16, access="rs", doc="starts an erase")
    PSIZE = Bits(9, 8, doc="parallelism")
    SNB = Bits(6, 3, doc="sector")
    MER = Bits(2, doc="mass erase")
    SER = Bits(1, doc="sector erase")
    PG = Bits(0, doc="programming")


class OPTCR(Word, addr=0x14, reset=0x0FFF_AAED, modelled=False):
    """Option control."""

    SPRMOD = Bits(31, doc="protection mode of nWRP")
    nWRP = Bits(21, 16, doc="sectors that can be written")
    RDP = Bits(15, 8, doc="read protection")
    nRST_STDBY = Bits(7, doc="no reset when standby is entered")
    nRST_STOP = Bits(6, doc="no reset when stop is entered")
    WDG_SW = Bits(5, doc="the watchdog is started by software")
    BOR_LEV = Bits(3, 2, doc="brown-out level")
    OPTSTRT = Bits(1, access="rs", doc="programs the options")
    OPTLOCK = Bits(0, access="rs", doc="locked")
