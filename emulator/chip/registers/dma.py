"""Direct memory access controller (RM0368 section 9.5)."""

from __future__ import annotations

from fcu_emulator.emulator.chip.registers.declaration import Word
from fcu_emulator.sensors.register import Bits

SOURCE = "RM0368 9.5"
INSTANCES = ("DMA1", "DMA2")
REQUESTS = (
    "ADC1",
    *(f"{name}_{direction}" for name in ("I2C1", "I2C2", "I2C3") for direction in ("RX", "TX")),
    *(f"{name}_{direction}" for name in ("SPI1", "SPI2", "SPI3") for direction in ("RX", "TX")),
    *(f"{name}_{direction}" for name in ("USART1", "USART2", "USART6") for direction in ("RX", "TX")),
    *(f"TIM{number}_UP" for number in range(1, 6)),
)
"""The modelled request lines (tables 28 and 29). In C, a line's number is its position here, counted from 1."""


class LISR(Word, addr=0x00, access="r"):
    """Interrupt status, streams 0 to 3."""

    TCIF3 = Bits(27, doc="stream 3: transfer complete")
    HTIF3 = Bits(26, doc="stream 3: half transfer")
    TEIF3 = Bits(25, doc="stream 3: transfer error")
    DMEIF3 = Bits(24, doc="stream 3: direct mode error")
    FEIF3 = Bits(22, modelled=False, doc="stream 3: FIFO error")
    TCIF2 = Bits(21, doc="stream 2: transfer complete")
    HTIF2 = Bits(20, doc="stream 2: half transfer")
    TEIF2 = Bits(19, doc="stream 2: transfer error")
    DMEIF2 = Bits(18, doc="stream 2: direct mode error")
    FEIF2 = Bits(16, modelled=False, doc="stream 2: FIFO error")
    TCIF1 = Bits(11, doc="stream 1: transfer complete")
    HTIF1 = Bits(10, doc="stream 1: half transfer")
    TEIF1 = Bits(9, doc="stream 1: transfer error")
    DMEIF1 = Bits(8, doc="stream 1: direct mode error")
    FEIF1 = Bits(6, modelled=False, doc="stream 1: FIFO error")
    TCIF0 = Bits(5, doc="stream 0: transfer complete")
    HTIF0 = Bits(4, doc="stream 0: half transfer")
    TEIF0 = Bits(3, doc="stream 0: transfer error")
    DMEIF0 = Bits(2, doc="stream 0: direct mode error")
    FEIF0 = Bits(0, modelled=False, doc="stream 0: FIFO error")


class HISR(Word, addr=0x04, access="r"):
    """Interrupt status, streams 4 to 7."""

    TCIF7 = Bits(27, doc="stream 7: transfer complete")
    HTIF7 = Bits(26, doc="stream 7: half transfer")
    TEIF7 = Bits(25, doc="stream 7: transfer error")
    DMEIF7 = Bits(24, doc="stream 7: direct mode error")
    FEIF7 = Bits(22, modelled=False, doc="stream 7: FIFO error")
    TCIF6 = Bits(21, doc="stream 6: transfer complete")
    HTIF6 = Bits(20, doc="stream 6: half transfer")
    TEIF6 = Bits(19, doc="stream 6: transfer error")
    DMEIF6 = Bits(18, doc="stream 6: direct mode error")
    FEIF6 = Bits(16, modelled=False, doc="stream 6: FIFO error")
    TCIF5 = Bits(11, doc="stream 5: transfer complete")
    HTIF5 = Bits(10, doc="stream 5: half transfer")
    TEIF5 = Bits(9, doc="stream 5: transfer error")
    DMEIF5 = Bits(8, doc="stream 5: direct mode error")
    FEIF5 = Bits(6, modelled=False, doc="stream 5: FIFO error")
    TCIF4 = Bits(5, doc="stream 4: transfer complete")
    HTIF4 = Bits(4, doc="stream 4: half transfer")
    TEIF4 = Bits(3, doc="stream 4: transfer error")
    DMEIF4 = Bits(2, doc="stream 4: direct mode error")
    FEIF4 = Bits(0, modelled=False, doc="stream 4: FIFO error")


class LIFCR(Word, addr=0x08, access="w"):
    """Interrupt flag clear, streams 0 to 3."""

    CTCIF3 = Bits(27, doc="clears TCIF3")
    CHTIF3 = Bits(26, doc="clears HTIF3")
    CTEIF3 = Bits(25, doc="clears TEIF3")
    CDMEIF3 = Bits(24, doc="clears DMEIF3")
    CFEIF3 = Bits(22, modelled=False, doc="clears FEIF3")
    CTCIF2 = Bits(21, doc="clears TCIF2")
    CHTIF2 = Bits(20, doc="clears HTIF2")
    CTEIF2 = Bits(19, doc="clears TEIF2")
    CDMEIF2 = Bits(18, doc="clears DMEIF2")
    CFEIF2 = Bits(16, modelled=False, doc="clears FEIF2")
    CTCIF1 = Bits(11, doc="clears TCIF1")
    CHTIF1 = Bits(10, doc="clears HTIF1")
    CTEIF1 = Bits(9, doc="clears TEIF1")
    CDMEIF1 = Bits(8, doc="clears DMEIF1")
    CFEIF1 = Bits(6, modelled=False, doc="clears FEIF1")
    CTCIF0 = Bits(5, doc="clears TCIF0")
    CHTIF0 = Bits(4, doc="clears HTIF0")
    CTEIF0 = Bits(3, doc="clears TEIF0")
    CDMEIF0 = Bits(2, doc="clears DMEIF0")
    CFEIF0 = Bits(0, modelled=False, doc="clears FEIF0")


class HIFCR(Word, addr=0x0C, access="w"):
    """Interrupt flag clear, streams 4 to 7."""

    CTCIF7 = Bits(27, doc="clears TCIF7")
    CHTIF7 = Bits(26, doc="clears HTIF7")
    CTEIF7 = Bits(25, doc="clears TEIF7")
    CDMEIF7 = Bits(24, doc="clears DMEIF7")
    CFEIF7 = Bits(22, modelled=False, doc="clears FEIF7")
    CTCIF6 = Bits(21, doc="clears TCIF6")
    CHTIF6 = Bits(20, doc="clears HTIF6")
    CTEIF6 = Bits(19, doc="clears TEIF6")
    CDMEIF6 = Bits(18, doc="clears DMEIF6")
    CFEIF6 = Bits(16, modelled=False, doc="clears FEIF6")
    CTCIF5 = Bits(11, doc="clears TCIF5")
    CHTIF5 = Bits(10, doc="clears HTIF5")
    CTEIF5 = Bits(9, doc="clears TEIF5")
    CDMEIF5 = Bits(8, doc="clears DMEIF5")
    CFEIF5 = Bits(6, modelled=False, doc="clears FEIF5")
    CTCIF4 = Bits(5, doc="clears TCIF4")
    CHTIF4 = Bits(4, doc="clears HTIF4")
    CTEIF4 = Bits(3, doc="clears TEIF4")
    CDMEIF4 = Bits(2, doc="clears DMEIF4")
    CFEIF4 = Bits(0, modelled=False, doc="clears FEIF4")


class SxCR(Word, addr=0x10, count=8, step=0x18):
    """Stream configuration."""

    CHSEL = Bits(27, 25, doc="request line")
    MBURST = Bits(24, 23, modelled=False, doc="burst on the memory side")
    PBURST = Bits(22, 21, modelled=False, doc="burst on the peripheral side")
    CT = Bits(19, doc="number of the memory area in use, 0 or 1")
    DBM = Bits(18, doc="double buffer")
    PL = Bits(17, 16, modelled=False, doc="priority")
    PINCOS = Bits(15, modelled=False, doc="peripheral addresses increase by four")
    MSIZE = Bits(14, 13, doc="size of an item in memory")
    PSIZE = Bits(12, 11, doc="size of an item of the peripheral")
    MINC = Bits(10, doc="memory addresses increase")
    PINC = Bits(9, doc="peripheral addresses increase")
    CIRC = Bits(8, doc="circular: restarts at the end")
    DIR = Bits(7, 6, doc="peripheral to memory, memory to peripheral, memory to memory")
    PFCTRL = Bits(5, modelled=False, doc="the peripheral ends the transfer")
    TCIE = Bits(4, doc="interrupt on transfer complete")
    HTIE = Bits(3, doc="interrupt on half transfer")
    TEIE = Bits(2, doc="interrupt on transfer error")
    DMEIE = Bits(1, doc="interrupt on direct mode error")
    EN = Bits(0, doc="enables the stream")


class SxNDTR(Word, addr=0x14, count=8, step=0x18):
    """Number of items left."""

    NDT = Bits(15, 0, doc="number of items to transfer")


class SxPAR(Word, addr=0x18, count=8, step=0x18):
    """Peripheral address."""


class SxM0AR(Word, addr=0x1C, count=8, step=0x18):
    """Memory 0 address."""


class SxM1AR(Word, addr=0x20, count=8, step=0x18):
    """Memory 1 address."""


class SxFCR(Word, addr=0x24, count=8, step=0x18, reset=0x21):
    """FIFO control."""

    FEIE = Bits(7, modelled=False, doc="interrupt on FIFO error")
    FS = Bits(5, 3, access="r", doc="FIFO status")
    DMDIS = Bits(2, doc="direct mode off")
    FTH = Bits(1, 0, doc="threshold")
