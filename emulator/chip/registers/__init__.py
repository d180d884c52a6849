"""The registers of the chip's peripherals, by chapter of the manual.

The C headers, the rows of the fidelity table and the output of ``fcu registers TIM9`` are generated
from these declarations.
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
from fcu_emulator.emulator.chip.registers.declaration import DeclaredPeripheral, Word, peripheral

KINDS: Final[tuple[ModuleType, ...]] = (
    *(crc, pwr, rcc, syscfg, gpio, dma, exti, adc, tim, iwdg, wwdg, rtc, i2c, usart, spi, flash, dbgmcu),
    *(systick, nvic, scb, dwt),
)
"""The declared peripherals in the order of the reference manual, followed by those of the core."""

IN_C: Final[tuple[ModuleType, ...]] = (
    *(crc, syscfg, gpio, dma, exti, adc, tim, i2c, usart, spi),
    *(systick, nvic, scb, dwt),
)
"""The peripherals for which C headers are generated."""

DECLARED: Final[dict[str, DeclaredPeripheral]] = {
    name: peripheral(module, name) for module in KINDS for name in module.INSTANCES
}
"""All declared peripherals, by their names in the manual."""

SYSTEM_CONTROL_SPACE: Final = ("SysTick", "NVIC", "SCB")
"""These peripherals share one address range."""


def address_of(peripheral_name: str, register: type[Word]) -> int:
    """Return the address of a register, or of the first of several such registers."""
    place = "SCS" if peripheral_name in SYSTEM_CONTROL_SPACE else peripheral_name
    return memory_map.ADDRESSES[place][0] + register.addr


def names_of(peripheral_name: str) -> dict[int, str]:
    """Return the registers' names by offset."""
    parts = SYSTEM_CONTROL_SPACE if peripheral_name == "SCS" else (peripheral_name,)
    return {
        offset: name for part in parts if part in DECLARED for offset, name in DECLARED[part].names.items()
    }
