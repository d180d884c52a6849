"""The chip's system blocks put together: addresses (RM0368 table 1), shared interrupt inputs (table 38).

What talks to the outside world (USART, I2C, SPI, DMA) joins them where the chip is built; RCC then gets
all blocks by ``rcc.control(...)``.
"""

from __future__ import annotations

from collections.abc import Iterator

from emulator.chip.cpu.python_blocks import named_blocks
from emulator.chip.memory_map import BLOCKS
from emulator.chip.peripherals.adc import Adc, AdcInputs
from emulator.chip.peripherals.crc import Crc
from emulator.chip.peripherals.dbgmcu import Dbgmcu
from emulator.chip.peripherals.flash import Flash
from emulator.chip.peripherals.peripheral import InterruptInput, Peripheral, Soc
from emulator.chip.peripherals.pwr import Pwr
from emulator.chip.peripherals.rcc import Rcc
from emulator.chip.peripherals.rtc import Rtc
from emulator.chip.peripherals.watchdogs import Iwdg, Wwdg


def _place(name: str) -> tuple[str, int]:
    """Name and address."""
    return name, BLOCKS[name][0]


class SystemBlocks:
    """Iterate over it for all blocks. Sets ``soc.clocks``."""

    def __init__(self, soc: Soc, inputs: AdcInputs | None = None) -> None:
        lines = {number: InterruptInput(soc, number) for number in (0, 4, 5, 18)}
        self.pwr = Pwr(soc, *_place("PWR"))
        self.rcc = Rcc(soc, *_place("RCC"), self.pwr, lines[5])
        soc.clocks = self.rcc
        self.flash = Flash(soc, *_place("FLASH"), lines[4])
        self.adc = Adc(soc, *_place("ADC1"), lines[18], inputs or AdcInputs())
        self.crc = Crc(soc, *_place("CRC"))
        self.rtc = Rtc(soc, *_place("RTC"), self.pwr, self.rcc)
        self.iwdg = Iwdg(soc, *_place("IWDG"))
        self.wwdg = Wwdg(soc, *_place("WWDG"), lines[0])
        self.dbgmcu = Dbgmcu(soc, *_place("DBGMCU"))
        self.named = named_blocks(soc)

    def __iter__(self) -> Iterator[Peripheral]:
        yield from (self.rcc, self.pwr, self.flash)
        yield from (self.adc, self.crc, self.rtc, self.iwdg, self.wwdg, self.dbgmcu, *self.named)
