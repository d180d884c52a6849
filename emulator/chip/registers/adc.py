"""Analog-to-digital converter (RM0368 section 11.12)."""

from __future__ import annotations

from fcu_emulator.emulator.chip.registers.declaration import Word
from fcu_emulator.sensors.register import Bits

SOURCE = "RM0368 11.12"
INSTANCES = ("ADC1",)


class SR(Word, addr=0x000, access="rc_w0"):
    """Status."""

    OVR = Bits(5, doc="overrun: a result was lost")
    STRT = Bits(4, doc="a regular conversion has started")
    JSTRT = Bits(3, doc="an injected conversion has started")
    JEOC = Bits(2, doc="injected conversions are complete")
    EOC = Bits(1, doc="a regular conversion is complete")
    AWD = Bits(0, doc="analog watchdog")


class CR1(Word, addr=0x004):
    """Control 1."""

    OVRIE = Bits(26, doc="interrupt on OVR")
    RES = Bits(25, 24, doc="resolution: 12, 10, 8, 6 bits")
    AWDEN = Bits(23, doc="analog watchdog on regular channels")
    JAWDEN = Bits(22, doc="analog watchdog on injected channels")
    DISCNUM = Bits(15, 13, doc="number of channels in discontinuous mode, minus one")
    JDISCEN = Bits(12, doc="discontinuous mode, injected")
    DISCEN = Bits(11, doc="discontinuous mode, regular")
    JAUTO = Bits(10, doc="injected conversions follow regular ones")
    AWDSGL = Bits(9, doc="analog watchdog on one channel")
    SCAN = Bits(8, doc="the whole sequence is converted")
    JEOCIE = Bits(7, doc="interrupt on JEOC")
    AWDIE = Bits(6, doc="interrupt on AWD")
    EOCIE = Bits(5, doc="interrupt on EOC")
    AWDCH = Bits(4, 0, doc="channel of the analog watchdog")


class CR2(Word, addr=0x008):
    """Control 2."""

    SWSTART = Bits(30, access="rs", doc="starts regular conversions")
    EXTEN = Bits(29, 28, doc="external trigger, regular")
    EXTSEL = Bits(27, 24, doc="source of the regular trigger")
    JSWSTART = Bits(22, access="rs", doc="starts injected conversions")
    JEXTEN = Bits(21, 20, doc="external trigger, injected")
    JEXTSEL = Bits(19, 16, doc="source of the injected trigger")
    ALIGN = Bits(11, doc="results are left-aligned")
    EOCS = Bits(10, doc="EOC after each conversion")
    DDS = Bits(9, doc="DMA requests continue after the last transfer")
    DMA = Bits(8, doc="results are read by DMA")
    CONT = Bits(1, doc="continuous conversion: the sequence repeats")
    ADON = Bits(0, doc="on")


class SMPR1(Word, addr=0x00C):
    """Sample time, channels 10 to 18."""

    SMPx = Bits(2, 0, count=9, step=3, first=10, doc="sampling time, 3 to 480 cycles")


class SMPR2(Word, addr=0x010):
    """Sample time, channels 0 to 9."""

    SMPx = Bits(2, 0, count=10, step=3, doc="sampling time, 3 to 480 cycles")


class JOFRx(Word, addr=0x014, count=4, step=0x04, first=1):
    """Injected channel data offset."""

    JOFFSET = Bits(11, 0, doc="offset")


class HTR(Word, addr=0x024, reset=0xFFF):
    """Watchdog higher threshold."""

    HT = Bits(11, 0, doc="threshold")


class LTR(Word, addr=0x028):
    """Watchdog lower threshold."""

    LT = Bits(11, 0, doc="threshold")


class SQR1(Word, addr=0x02C):
    """Regular sequence, length and places 13 to 16."""

    L = Bits(23, 20, doc="length, minus one")
    SQx = Bits(4, 0, count=4, step=5, first=13, doc="channel")


class SQR2(Word, addr=0x030):
    """Regular sequence, places 7 to 12."""

    SQx = Bits(4, 0, count=6, step=5, first=7, doc="channel")


class SQR3(Word, addr=0x034):
    """Regular sequence, places 1 to 6."""

    SQx = Bits(4, 0, count=6, step=5, first=1, doc="channel")


class JSQR(Word, addr=0x038):
    """Injected sequence."""

    JL = Bits(21, 20, doc="length, minus one")
    JSQx = Bits(4, 0, count=4, step=5, first=1, doc="channel")


class JDRx(Word, addr=0x03C, count=4, step=0x04, first=1, access="r"):
    """Injected data."""

    JDATA = Bits(15, 0, doc="result")


class DR(Word, addr=0x04C, access="r"):
    """Regular data."""

    DATA = Bits(15, 0, doc="result")


class CCR(Word, addr=0x304):
    """Common control."""

    TSVREFE = Bits(23, doc="temperature sensor and reference on")
    VBATE = Bits(22, doc="channel 18 measures a quarter of the backup supply")
    ADCPRE = Bits(17, 16, doc="PCLK2 divided by 2, 4, 6, 8")
