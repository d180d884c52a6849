"""Universal synchronous asynchronous receiver transmitter (RM0368 section 19.6)."""

from __future__ import annotations

from fcu_emulator.emulator.chip.registers.declaration import Word
from fcu_emulator.sensors.register import Bits

SOURCE = "RM0368 19.6"
INSTANCES = ("USART1", "USART2", "USART6")


class SR(Word, addr=0x00, access="r", reset=0xC0):
    """Status."""

    CTS = Bits(9, access="rc_w0", modelled=False, doc="the CTS input has changed")
    LBD = Bits(8, access="rc_w0", modelled=False, doc="a LIN break was detected")
    TXE = Bits(7, doc="data register empty")
    TC = Bits(6, access="rc_w0", doc="transmission complete")
    RXNE = Bits(5, access="rc_w0", doc="data register holds a received byte")
    IDLE = Bits(4, doc="an idle line was detected")
    ORE = Bits(3, doc="overrun: a byte arrived while RXNE was set")
    NF = Bits(2, doc="noise was detected")
    FE = Bits(1, doc="framing error, or a break")
    PE = Bits(0, modelled=False, doc="parity error")


class DR(Word, addr=0x04):
    """Data: the received byte, and the byte to be sent."""

    DR = Bits(8, 0, doc="eight or nine bits")


class BRR(Word, addr=0x08):
    """Baud rate: the kernel clock is divided by 16 (or 8) times this number."""

    DIV_Mantissa = Bits(15, 4, doc="whole part")
    DIV_Fraction = Bits(3, 0, doc="sixteenths")


class CR1(Word, addr=0x0C):
    """Control 1."""

    OVER8 = Bits(15, doc="oversampling by 8")
    UE = Bits(13, doc="enables the USART")
    M = Bits(12, doc="nine data bits")
    WAKE = Bits(11, modelled=False, doc="event that ends mute mode")
    PCE = Bits(10, doc="parity is sent and checked")
    PS = Bits(9, modelled=False, doc="odd parity")
    PEIE = Bits(8, doc="interrupt on PE")
    TXEIE = Bits(7, doc="interrupt on TXE")
    TCIE = Bits(6, doc="interrupt on TC")
    RXNEIE = Bits(5, doc="interrupt on RXNE and ORE")
    IDLEIE = Bits(4, doc="interrupt on IDLE")
    TE = Bits(3, doc="enables the transmitter")
    RE = Bits(2, doc="enables the receiver")
    RWU = Bits(1, modelled=False, doc="mute mode")
    SBK = Bits(0, modelled=False, doc="send a break")


class CR2(Word, addr=0x10):
    """Control 2."""

    LINEN = Bits(14, modelled=False, doc="LIN mode")
    STOP = Bits(13, 12, doc="1, 0.5, 2, 1.5 stop bits")
    CLKEN = Bits(11, modelled=False, doc="clock output of synchronous mode")
    CPOL = Bits(10, modelled=False, doc="clock polarity")
    CPHA = Bits(9, modelled=False, doc="clock phase")
    LBCL = Bits(8, modelled=False, doc="clock pulse of the last bit")
    LBDIE = Bits(6, modelled=False, doc="interrupt on LBD")
    LBDL = Bits(5, modelled=False, doc="length of a LIN break")
    ADD = Bits(3, 0, modelled=False, doc="address that ends mute mode")


class CR3(Word, addr=0x14):
    """Control 3."""

    ONEBIT = Bits(11, modelled=False, doc="one sample per bit")
    CTSIE = Bits(10, modelled=False, doc="interrupt on CTS")
    CTSE = Bits(9, modelled=False, doc="flow control by CTS")
    RTSE = Bits(8, modelled=False, doc="flow control by RTS")
    DMAT = Bits(7, doc="transmission by DMA")
    DMAR = Bits(6, doc="reception by DMA")
    SCEN = Bits(5, modelled=False, doc="smartcard mode")
    NACK = Bits(4, modelled=False, doc="smartcard: send NACK after a parity error")
    HDSEL = Bits(3, modelled=False, doc="half duplex")
    IRLP = Bits(2, modelled=False, doc="IrDA low power")
    IREN = Bits(1, modelled=False, doc="IrDA mode")
    EIE = Bits(0, doc="interrupt on FE, NF and ORE with DMA")


class GTPR(Word, addr=0x18, modelled=False):
    """Guard time and prescaler, of smartcard and IrDA mode."""

    GT = Bits(15, 8, doc="guard time")
    PSC = Bits(7, 0, doc="prescaler")
