"""The chip's communication blocks put together: addresses (RM0368 table 1) and the board's wiring.

They need ``soc.clocks``, so the system blocks come first; ``soc.dma`` is set here. USART1 is the terminal,
I2C2 and SPI2 are the sensors' buses, SPI1 leads to a Bluetooth module that is absent; to the others nothing
is connected. Pins are the board's (board facts, section 2), alternate functions the STM32F401xB/C datasheet's
(table 9).
"""

from __future__ import annotations

from collections.abc import Iterator

from emulator.arm.peripherals.bluenrg import BlueNrgAbsent
from emulator.arm.peripherals.dma import Dma
from emulator.arm.peripherals.dma_requests import DmaLines
from emulator.arm.peripherals.i2c import I2c
from emulator.arm.peripherals.peripheral import Peripheral
from emulator.arm.peripherals.spi import Spi
from emulator.arm.peripherals.usart import Usart
from emulator.arm.soc import Soc
from emulator.i2c import I2CBus
from emulator.spi import SpiBus
from emulator.spi_wire import SpiWire
from emulator.uart import Uart

_USART1_TX = ("A", 9, 7)
_I2C2_PINS = (("B", 10, 4), ("B", 3, 9))
_SPI2_PINS = (("B", 13, 5), ("B", 15, 5))


class CommBlocks:
    """Iterate over it for all blocks. ``uart``, ``i2c2`` and ``spi2`` are the board's."""

    def __init__(self, soc: Soc, uart: Uart, i2c2: I2CBus, spi2: SpiBus) -> None:
        clock, trace, gpio = soc.clock, soc.trace, soc.gpio
        requests = DmaLines()
        soc.dma = requests
        self.dma1 = Dma(soc, "DMA1", 0x4002_6000, requests)
        self.dma2 = Dma(soc, "DMA2", 0x4002_6400, requests)
        self.usart1 = Usart(soc, "USART1", 0x4001_1000, uart, tx_pin=_USART1_TX)
        self.usart2 = Usart(soc, "USART2", 0x4000_4400, _idle_line(soc, "USART2"), terminal_baud=None)
        self.usart6 = Usart(soc, "USART6", 0x4001_1400, _idle_line(soc, "USART6"), terminal_baud=None)
        self.i2c1 = I2c(soc, "I2C1", 0x4000_5400, I2CBus("I2C1", clock, trace))
        self.i2c2 = I2c(soc, "I2C2", 0x4000_5800, i2c2, _I2C2_PINS)
        self.i2c3 = I2c(soc, "I2C3", 0x4000_5C00, I2CBus("I2C3", clock, trace))
        self.spi1 = Spi(soc, "SPI1", 0x4001_3000, BlueNrgAbsent(gpio, clock, trace))
        self.spi2 = Spi(soc, "SPI2", 0x4000_3800, SpiWire(spi2, gpio, clock, trace), _SPI2_PINS)
        self.spi3 = Spi(soc, "SPI3", 0x4000_3C00, None)

    def __iter__(self) -> Iterator[Peripheral]:
        yield from (self.dma1, self.dma2, self.usart1, self.usart2, self.usart6)
        yield from (self.i2c1, self.i2c2, self.i2c3, self.spi1, self.spi2, self.spi3)


def _idle_line(soc: Soc, name: str) -> Uart:
    return Uart(name, soc.clock, soc.trace, soc.clocks.pclk2_hz)
