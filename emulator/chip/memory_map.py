"""The memory map of the STM32F401CC (RM0368 table 1, section 2.3; DS9716 section 5; ARMv7-M ARM table B3-3)."""

from __future__ import annotations

from typing import Final, NamedTuple

CHIP_NAME: Final = "STM32F401"
"""The chip's name in the trace."""

FLASH: Final = 0x0800_0000
FLASH_SIZE: Final = 0x4_0000
RAM: Final = 0x2000_0000
RAM_SIZE: Final = 0x1_0000
SYSTEM_MEMORY: Final = 0x1FFF_0000
SYSTEM_MEMORY_SIZE: Final = 0x1_0000

PERIPHERALS: Final = 0x4000_0000
PERIPHERALS_SIZE: Final = 0x8_0000
OTG: Final = 0x5000_0000
OTG_SIZE: Final = 0x4_0000
PRIVATE: Final = 0xE000_0000
PRIVATE_SIZE: Final = 0x10_0000
RAM_BITS: Final = 0x2200_0000
PERIPHERAL_BITS: Final = 0x4200_0000

PAGE_SHIFT: Final = 10
"""A page has one kilobyte, because two peripherals never share a kilobyte."""

ADDRESSES: Final = {
    "TIM2": (0x4000_0000, 0x400),
    "TIM3": (0x4000_0400, 0x400),
    "TIM4": (0x4000_0800, 0x400),
    "TIM5": (0x4000_0C00, 0x400),
    "RTC": (0x4000_2800, 0x400),
    "WWDG": (0x4000_2C00, 0x400),
    "IWDG": (0x4000_3000, 0x400),
    "I2S2ext": (0x4000_3400, 0x400),
    "SPI2": (0x4000_3800, 0x400),
    "SPI3": (0x4000_3C00, 0x400),
    "I2S3ext": (0x4000_4000, 0x400),
    "USART2": (0x4000_4400, 0x400),
    "I2C1": (0x4000_5400, 0x400),
    "I2C2": (0x4000_5800, 0x400),
    "I2C3": (0x4000_5C00, 0x400),
    "PWR": (0x4000_7000, 0x400),
    "TIM1": (0x4001_0000, 0x400),
    "USART1": (0x4001_1000, 0x400),
    "USART6": (0x4001_1400, 0x400),
    "ADC1": (0x4001_2000, 0x400),
    "SDIO": (0x4001_2C00, 0x400),
    "SPI1": (0x4001_3000, 0x400),
    "SPI4": (0x4001_3400, 0x400),
    "SYSCFG": (0x4001_3800, 0x400),
    "EXTI": (0x4001_3C00, 0x400),
    "TIM9": (0x4001_4000, 0x400),
    "TIM10": (0x4001_4400, 0x400),
    "TIM11": (0x4001_4800, 0x400),
    "GPIOA": (0x4002_0000, 0x400),
    "GPIOB": (0x4002_0400, 0x400),
    "GPIOC": (0x4002_0800, 0x400),
    "GPIOD": (0x4002_0C00, 0x400),
    "GPIOE": (0x4002_1000, 0x400),
    "GPIOH": (0x4002_1C00, 0x400),
    "CRC": (0x4002_3000, 0x400),
    "RCC": (0x4002_3800, 0x400),
    "FLASH": (0x4002_3C00, 0x400),
    "DMA1": (0x4002_6000, 0x400),
    "DMA2": (0x4002_6400, 0x400),
    "OTG_FS": (OTG, OTG_SIZE),
    "ITM": (0xE000_0000, 0x1000),
    "DWT": (0xE000_1000, 0x1000),
    "FPB": (0xE000_2000, 0x1000),
    "SCS": (0xE000_E000, 0x1000),
    "TPIU": (0xE004_0000, 0x1000),
    "ETM": (0xE004_1000, 0x1000),
    "DBGMCU": (0xE004_2000, 0x400),
    "ROM table": (0xE00F_F000, 0x1000),
}
"""First address and size, by the name in the manual."""


class Region(NamedTuple):
    """A memory range from ``start`` to before ``end``."""

    name: str
    start: int
    end: int

    def holds(self, start: int, end: int) -> bool:
        return self.start <= start <= end <= self.end

    def __str__(self) -> str:
        return f"{self.name} 0x{self.start:08X}..0x{self.end - 1:08X}"


FLASH_MEMORY: Final = Region("flash", FLASH, FLASH + FLASH_SIZE)
RAM_MEMORY: Final = Region("RAM", RAM, RAM + RAM_SIZE)
CAPACITY: Final = FLASH_SIZE + RAM_SIZE
CHIP: Final = f"this board's STM32F401CC has {FLASH_MEMORY} and {RAM_MEMORY}"


def fits(start: int, end: int) -> bool:
    """Return whether flash or RAM contains [start, end)."""
    return FLASH_MEMORY.holds(start, end) or RAM_MEMORY.holds(start, end)
