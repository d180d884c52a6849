"""Serial peripheral interface (RM0368 section 20.5)."""

from __future__ import annotations

from fcu_emulator.emulator.chip.registers.declaration import Word
from fcu_emulator.sensors.register import Bits

SOURCE = "RM0368 20.5"
INSTANCES = ("SPI1", "SPI2", "SPI3")


class CR1(Word, addr=0x00):
    """Control 1."""

    BIDIMODE = Bits(15, doc="one data line for both directions")
    BIDIOE = Bits(14, doc="the single data line is an output")
    CRCEN = Bits(13, modelled=False, doc="CRC calculation")
    CRCNEXT = Bits(12, modelled=False, doc="send the CRC next")
    DFF = Bits(11, doc="frames of 16 bits")
    RXONLY = Bits(10, doc="full duplex, but only receive")
    SSM = Bits(9, doc="NSS by software: SSI")
    SSI = Bits(8, doc="level of NSS")
    LSBFIRST = Bits(7, doc="least significant bit first")
    SPE = Bits(6, doc="enables the peripheral")
    BR = Bits(5, 3, doc="PCLK divided by 2 to 256")
    MSTR = Bits(2, doc="master")
    CPOL = Bits(1, doc="the clock is high when idle")
    CPHA = Bits(0, doc="data is sampled at the second edge")


class CR2(Word, addr=0x04):
    """Control 2."""

    TXEIE = Bits(7, doc="interrupt on TXE")
    RXNEIE = Bits(6, doc="interrupt on RXNE")
    ERRIE = Bits(5, doc="interrupt on errors")
    FRF = Bits(4, modelled=False, doc="TI frame format")
    SSOE = Bits(2, modelled=False, doc="NSS as output")
    TXDMAEN = Bits(1, doc="transmission by DMA")
    RXDMAEN = Bits(0, doc="reception by DMA")


class SR(Word, addr=0x08, access="r", reset=0x2):
    """Status."""

    FRE = Bits(8, modelled=False, doc="frame format error")
    BSY = Bits(7, doc="a transfer is in progress")
    OVR = Bits(6, doc="overrun: a frame arrived while RXNE was set")
    MODF = Bits(5, doc="mode fault: NSS of a master is low")
    CRCERR = Bits(4, access="rc_w0", modelled=False, doc="wrong CRC")
    UDR = Bits(3, modelled=False, doc="I2S underrun")
    CHSIDE = Bits(2, modelled=False, doc="I2S channel")
    TXE = Bits(1, doc="transmit buffer empty")
    RXNE = Bits(0, doc="receive buffer not empty")


class DR(Word, addr=0x0C):
    """Data."""

    DR = Bits(15, 0, doc="8 or 16 bits")


class CRCPR(Word, addr=0x10, reset=0x7):
    """CRC polynomial."""

    CRCPOLY = Bits(15, 0, modelled=False, doc="polynomial")


class RXCRCR(Word, addr=0x14, access="r"):
    """CRC of received data."""

    RXCRC = Bits(15, 0, modelled=False, doc="sum")


class TXCRCR(Word, addr=0x18, access="r"):
    """CRC of sent data."""

    TXCRC = Bits(15, 0, modelled=False, doc="sum")


class I2SCFGR(Word, addr=0x1C, modelled=False):
    """I2S configuration."""

    I2SMOD = Bits(11, doc="I2S instead of SPI")
    I2SE = Bits(10, doc="enables I2S")
    I2SCFG = Bits(9, 8, doc="slave or master, transmit or receive")
    PCMSYNC = Bits(7, doc="PCM frame synchronisation")
    I2SSTD = Bits(5, 4, doc="standard")
    CKPOL = Bits(3, doc="clock polarity")
    DATLEN = Bits(2, 1, doc="data length")
    CHLEN = Bits(0, doc="channel length")


class I2SPR(Word, addr=0x20, reset=0x2, modelled=False):
    """I2S prescaler."""

    MCKOE = Bits(9, doc="master clock output")
    ODD = Bits(8, doc="odd factor")
    I2SDIV = Bits(7, 0, doc="divider")
