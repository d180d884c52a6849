"""The registers of the chip's blocks, declared once, one chapter of a manual a module.

From here come the names in traces, diagnoses and debuggers, ``fcu registers TIM9``, the reset values and
masks of the blocks in Python, the C headers of the blocks in C (``python -m fcu_emulator.emulator.chip.registers`` writes
them) and the chip's rows of the fidelity table.
"""

from __future__ import annotations

from types import ModuleType
from typing import Final

from fcu_emulator.emulator.chip import memory_map
from fcu_emulator.emulator.chip.registers import (
    adc,
    crc,
    dbgmcu,
    dma,
    dwt,
    exti,
    flash,
    gpio,
    i2c,
    iwdg,
    nvic,
    pwr,
    rcc,
    rtc,
    scb,
    spi,
    syscfg,
    systick,
    tim,
    usart,
    wwdg,
)
from fcu_emulator.emulator.chip.registers.block import DeclaredBlock, Word, block

KINDS: Final[tuple[ModuleType, ...]] = (
    *(crc, pwr, rcc, syscfg, gpio, dma, exti, adc, tim, iwdg, wwdg, rtc, i2c, usart, spi, flash, dbgmcu),
    *(systick, nvic, scb, dwt),
)
"""In the order of the reference manual, then the core's."""

IN_C: Final[tuple[ModuleType, ...]] = (
    *(syscfg, gpio, dma, exti, tim, i2c, usart, spi),
    *(systick, nvic, scb, dwt),
)
"""Of these the blocks in C have headers."""

BLOCKS: Final[dict[str, DeclaredBlock]] = {
    name: block(module, name) for module in KINDS for name in module.INSTANCES
}
"""Every declared block by the manual's name."""

SYSTEM_CONTROL_SPACE: Final = ("SysTick", "NVIC", "SCB")
"""Blocks that share one place in the memory map; their offsets are those in it."""


def address_of(block_name: str, register: type[Word]) -> int:
    """Where a register of a block is, the first one of several."""
    place = "SCS" if block_name in SYSTEM_CONTROL_SPACE else block_name
    return memory_map.BLOCKS[place][0] + register.addr


def names_of(block_name: str) -> dict[int, str]:
    """The registers' names by offset of a block in the memory map; none if it is not declared."""
    parts = SYSTEM_CONTROL_SPACE if block_name == "SCS" else (block_name,)
    return {offset: name for part in parts if part in BLOCKS for offset, name in BLOCKS[part].names.items()}
