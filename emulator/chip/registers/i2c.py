"""Inter-integrated circuit interface (RM0368 section 18.6)."""

from __future__ import annotations

from fcu_emulator.emulator.chip.registers.declaration import Word
from fcu_emulator.sensors.register import Bits

SOURCE = "RM0368 18.6"
INSTANCES = ("I2C1", "I2C2", "I2C3")


class CR1(Word, addr=0x00):
    """Control 1."""

    SWRST = Bits(15, doc="software reset")
    ALERT = Bits(13, modelled=False, doc="SMBus alert")
    PEC = Bits(12, modelled=False, doc="packet error checking: transfer the code")
    POS = Bits(11, doc="ACK and PEC apply to the next byte")
    ACK = Bits(10, doc="acknowledge received bytes")
    STOP = Bits(9, doc="generate a stop condition")
    START = Bits(8, doc="generate a start condition")
    NOSTRETCH = Bits(7, modelled=False, doc="no clock stretching as slave")
    ENGC = Bits(6, modelled=False, doc="answer the general call")
    ENPEC = Bits(5, modelled=False, doc="packet error checking")
    ENARP = Bits(4, modelled=False, doc="address resolution protocol")
    SMBTYPE = Bits(3, modelled=False, doc="SMBus host")
    SMBUS = Bits(1, modelled=False, doc="SMBus mode")
    PE = Bits(0, doc="enables the peripheral")


class CR2(Word, addr=0x04):
    """Control 2."""

    LAST = Bits(12, doc="the next DMA transfer ends with the last byte")
    DMAEN = Bits(11, doc="DMA requests")
    ITBUFEN = Bits(10, doc="interrupts on TXE and RXNE")
    ITEVTEN = Bits(9, doc="interrupts on events")
    ITERREN = Bits(8, doc="interrupts on errors")
    FREQ = Bits(5, 0, doc="PCLK1 in MHz")


class OAR1(Word, addr=0x08):
    """Own address 1."""

    ADDMODE = Bits(15, modelled=False, doc="ten-bit address")
    BIT14 = Bits(14, modelled=False, doc="unnamed bit; software must keep it at 1")
    ADD = Bits(9, 0, modelled=False, doc="own address as slave")


class OAR2(Word, addr=0x0C):
    """Own address 2."""

    ADD2 = Bits(7, 1, modelled=False, doc="second own address as slave")
    ENDUAL = Bits(0, modelled=False, doc="two addresses")


class DR(Word, addr=0x10):
    """Data."""

    DR = Bits(7, 0, doc="one byte")


class SR1(Word, addr=0x14, access="r"):
    """Status 1."""

    SMBALERT = Bits(15, access="rc_w0", modelled=False, doc="SMBus alert")
    TIMEOUT = Bits(14, access="rc_w0", modelled=False, doc="SMBus time-out")
    PECERR = Bits(12, access="rc_w0", modelled=False, doc="wrong packet error code")
    OVR = Bits(11, access="rc_w0", modelled=False, doc="overrun as slave")
    AF = Bits(10, access="rc_w0", doc="no acknowledge")
    ARLO = Bits(9, access="rc_w0", doc="arbitration lost")
    BERR = Bits(8, access="rc_w0", doc="misplaced start or stop condition")
    TXE = Bits(7, doc="data register empty")
    RXNE = Bits(6, doc="data register holds a received byte")
    STOPF = Bits(4, modelled=False, doc="stop condition as slave")
    ADD10 = Bits(3, modelled=False, doc="header of a ten-bit address sent")
    BTF = Bits(2, doc="byte transfer finished, and the clock is held")
    ADDR = Bits(1, doc="address sent and acknowledged")
    SB = Bits(0, doc="start condition generated")


class SR2(Word, addr=0x18, access="r"):
    """Status 2."""

    PEC = Bits(15, 8, modelled=False, doc="packet error code")
    DUALF = Bits(7, modelled=False, doc="the second address was received")
    SMBHOST = Bits(6, modelled=False, doc="SMBus host header")
    SMBDEFAULT = Bits(5, modelled=False, doc="SMBus default address")
    GENCALL = Bits(4, modelled=False, doc="general call")
    TRA = Bits(2, doc="transmitter")
    BUSY = Bits(1, doc="the bus is in use")
    MSL = Bits(0, doc="master")


class CCR(Word, addr=0x1C):
    """Clock control."""

    FS = Bits(15, doc="fast mode")
    DUTY = Bits(14, doc="fast mode: low and high time have the ratio 16 to 9")
    CCR = Bits(11, 0, doc="divider of PCLK1")


class TRISE(Word, addr=0x20, reset=0x2):
    """Rise time."""

    TRISE = Bits(5, 0, doc="rise time in periods of PCLK1, plus one")


class FLTR(Word, addr=0x24, modelled=False):
    """Filters."""

    ANOFF = Bits(4, doc="analog filter off")
    DNF = Bits(3, 0, doc="digital filter")
