"""Names of exceptions and of their handlers (ARMv7-M ARM table B1-4; RM0368 table 38)."""

from __future__ import annotations

from typing import Final

from emulator.chip.cpu.exceptions import FIRST_INTERRUPT

_SYSTEM: Final = {
    2: "NMI",
    3: "HardFault",
    4: "MemManage",
    5: "BusFault",
    6: "UsageFault",
    11: "SVC",
    12: "DebugMon",
    14: "PendSV",
    15: "SysTick",
}


def _from(first: int, *names: str) -> dict[int, str]:
    return dict(enumerate(names, first))


_INTERRUPTS: Final = {
    **_from(0, "WWDG", "PVD", "TAMP_STAMP", "RTC_WKUP", "FLASH", "RCC"),
    **_from(6, "EXTI0", "EXTI1", "EXTI2", "EXTI3", "EXTI4"),
    **_from(11, *(f"DMA1_Stream{stream}" for stream in range(7)), "ADC"),
    **_from(23, "EXTI9_5", "TIM1_BRK_TIM9", "TIM1_UP_TIM10", "TIM1_TRG_COM_TIM11", "TIM1_CC"),
    **_from(28, "TIM2", "TIM3", "TIM4", "I2C1_EV", "I2C1_ER", "I2C2_EV", "I2C2_ER"),
    **_from(35, "SPI1", "SPI2", "USART1", "USART2"),
    **_from(40, "EXTI15_10", "RTC_Alarm", "OTG_FS_WKUP"),
    **_from(47, "DMA1_Stream7"),
    **_from(49, "SDIO", "TIM5", "SPI3"),
    **_from(56, *(f"DMA2_Stream{stream}" for stream in range(5))),
    **_from(67, "OTG_FS", *(f"DMA2_Stream{stream}" for stream in range(5, 8))),
    **_from(71, "USART6", "I2C3_EV", "I2C3_ER"),
    **_from(81, "FPU"),
    **_from(84, "SPI4"),
}


def exception_name(number: int) -> str:
    """``SysTick``, ``TIM3``; by its number where the manual has no name."""
    interrupt = number - FIRST_INTERRUPT
    return _SYSTEM.get(number) or _INTERRUPTS.get(interrupt) or f"interrupt {interrupt}"


def handler_name(number: int) -> str:
    """What ST's start-up files call its handler."""
    return f"{exception_name(number)}_{'Handler' if number < FIRST_INTERRUPT else 'IRQHandler'}"
