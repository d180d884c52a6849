"""Which bit of RCC gates and resets which block (RM0368 sections 6.3.5 to 6.3.12). A table, no behaviour."""

from __future__ import annotations

_AHB1 = {
    0: "GPIOA",
    1: "GPIOB",
    2: "GPIOC",
    3: "GPIOD",
    4: "GPIOE",
    7: "GPIOH",
    12: "CRC",
    21: "DMA1",
    22: "DMA2",
}
_AHB2 = {7: "OTG_FS"}
_APB1 = {
    0: "TIM2",
    1: "TIM3",
    2: "TIM4",
    3: "TIM5",
    11: "WWDG",
    14: "SPI2",
    15: "SPI3",
    17: "USART2",
    21: "I2C1",
    22: "I2C2",
    23: "I2C3",
    28: "PWR",
}
_APB2 = {
    0: "TIM1",
    4: "USART1",
    5: "USART6",
    8: "ADC1",
    11: "SDIO",
    12: "SPI1",
    13: "SPI4",
    14: "SYSCFG",
    16: "TIM9",
    17: "TIM10",
    18: "TIM11",
}

ENABLE = {0x30: _AHB1, 0x34: _AHB2, 0x40: _APB1, 0x44: _APB2}
"""By offset of AHB1ENR, AHB2ENR, APB1ENR, APB2ENR: the block's name by bit number."""

RESET = {0x10: _AHB1, 0x14: _AHB2, 0x20: _APB1, 0x24: _APB2}
"""Likewise AHB1RSTR, AHB2RSTR, APB1RSTR, APB2RSTR; the ADC's reset bit is its enable bit's number too."""
