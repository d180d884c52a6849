"""The chip's system blocks put together: addresses (RM0368 table 1), shared interrupt inputs (table 38).

What talks to the outside world (USART, I2C, SPI, DMA) joins them where the chip is built; RCC then gets
all blocks by ``rcc.control(...)``.
"""

from __future__ import annotations

from collections.abc import Iterator

from emulator.chip.cpu.python_blocks import named_blocks
from emulator.chip.peripherals.adc import Adc, AdcInputs
from emulator.chip.peripherals.crc import Crc
from emulator.chip.peripherals.dbgmcu import Dbgmcu
from emulator.chip.peripherals.flash import Flash
from emulator.chip.peripherals.peripheral import IrqLine, Peripheral, Soc
from emulator.chip.peripherals.pwr import Pwr
from emulator.chip.peripherals.rcc import Rcc
from emulator.chip.peripherals.rtc import Rtc
from emulator.chip.peripherals.watchdogs import Iwdg, Wwdg


class SystemBlocks:
    """Iterate over it for all blocks. Sets ``soc.clocks``."""

    def __init__(self, soc: Soc, inputs: AdcInputs | None = None) -> None:
        lines = {number: IrqLine(soc, number) for number in (0, 4, 5, 18)}
        self.pwr = Pwr(soc, "PWR", 0x4000_7000)
        self.rcc = Rcc(soc, "RCC", 0x4002_3800, self.pwr, lines[5])
        soc.clocks = self.rcc
        self.flash = Flash(soc, "FLASH", 0x4002_3C00, lines[4])
        self.adc = Adc(soc, "ADC1", 0x4001_2000, lines[18], inputs or AdcInputs())
        self.crc = Crc(soc, "CRC", 0x4002_3000)
        self.rtc = Rtc(soc, "RTC", 0x4000_2800, self.pwr, self.rcc)
        self.iwdg = Iwdg(soc, "IWDG", 0x4000_3000)
        self.wwdg = Wwdg(soc, "WWDG", 0x4000_2C00, lines[0])
        self.dbgmcu = Dbgmcu(soc, "DBGMCU", 0xE004_2000)
        self.named = named_blocks(soc)

    def __iter__(self) -> Iterator[Peripheral]:
        yield from (self.rcc, self.pwr, self.flash)
        yield from (self.adc, self.crc, self.rtc, self.iwdg, self.wwdg, self.dbgmcu, *self.named)
