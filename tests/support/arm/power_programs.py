"""Programs that enter Stop and Standby on a real board, written for :mod:`tests.support.arm.thumb_assembler`.

Each exception handler counts its runs in a word of RAM, clears EXTI_PR and the RTC's event flags, and returns.
"""

from __future__ import annotations

import struct
from pathlib import Path

from fcu_emulator import Board
from fcu_emulator.emulator.chip.memory_map import FLASH, RAM, RAM_SIZE
from fcu_emulator.emulator.trace import DeviceNote, GpioEdge
from tests.support.arm.thumb_assembler import assemble

CODE, VECTORS = FLASH + 0x200, 102
COUNTS, PLACE = RAM + 0x100, RAM + 0x400
"""The counts of the exceptions, and a word for programs."""
RTC_WKUP, ALARM, EXTI0, SYSTICK = 16 + 3, 16 + 41, 16 + 6, 15
PA0, WAKE_UP_LINE, ALARM_LINE = 1 << 0, 1 << 22, 1 << 17
LPDS, PDDS, CWUF, CSBF, DBP, FPDS = 1 << 0, 1 << 1, 1 << 2, 1 << 3, 1 << 8, 1 << 9
WUF, SBF, EWUP = 1 << 0, 1 << 1, 1 << 8
SLEEPDEEP = 1 << 2
NAMES = {
    "RCC_CR": 0x4002_3800,
    "RCC_CFGR": 0x4002_3808,
    "RCC_AHB1ENR": 0x4002_3830,
    "RCC_APB1ENR": 0x4002_3840,
    "RCC_APB2ENR": 0x4002_3844,
    "RCC_BDCR": 0x4002_3870,
    "RCC_CSR": 0x4002_3874,
    "PWR_CR": 0x4000_7000,
    "PWR_CSR": 0x4000_7004,
    "RTC_CR": 0x4000_2808,
    "RTC_ISR": 0x4000_280C,
    "RTC_WUTR": 0x4000_2814,
    "RTC_WPR": 0x4000_2824,
    "BKP0R": 0x4000_2850,
    "EXTI_IMR": 0x4001_3C00,
    "EXTI_EMR": 0x4001_3C04,
    "EXTI_RTSR": 0x4001_3C08,
    "EXTI_PR": 0x4001_3C14,
    "GPIOB_MODER": 0x4002_0400,
    "GPIOB_BSRR": 0x4002_0418,
    "TIM2_CR1": 0x4000_0000,
    "TIM2_CNT": 0x4000_0024,
    "WWDG_CR": 0x4000_2C00,
    "WWDG_CFR": 0x4000_2C04,
    "IWDG_KR": 0x4000_3000,
    "IWDG_PR": 0x4000_3004,
    "IWDG_RLR": 0x4000_3008,
    "DBGMCU_CR": 0xE004_2004,
    "SCR": 0xE000_ED10,
    "SYST_CSR": 0xE000_E010,
    "SYST_RVR": 0xE000_E014,
    "SYST_CVR": 0xE000_E018,
    "ISER0": 0xE000_E100,
    "ISER1": 0xE000_E104,
    "COUNTS": COUNTS,
    "PLACE": PLACE,
}


def put(register: str, value: int) -> str:
    """Return the instructions that store to a register."""
    return f"mov32 r0, {register}\nmov32 r1, {value}\nstr r1, [r0]\n"


def poll(register: str, bit: int, label: str) -> str:
    """Return a loop that waits until ``bit`` is set."""
    return f"mov32 r0, {register}\nmov32 r1, {bit}\n{label}: ldr r2, [r0]\ntst r2, r1\nbeq {label}\n"


LED_OUT = put("RCC_AHB1ENR", 2) + put("GPIOB_MODER", 1 << 10)
LED_ON, LED_OFF = put("GPIOB_BSRR", 1 << 5), put("GPIOB_BSRR", 1 << 21)
PWR_ON = put("RCC_APB1ENR", 1 << 28) + put("PWR_CR", DBP)
LSI_RTC = (
    put("RCC_CSR", 1)
    + poll("RCC_CSR", 2, "lsi")
    + put("RCC_BDCR", 1 << 15 | 2 << 8)
    + put("RTC_WPR", 0xCA)
    + put("RTC_WPR", 0x53)
)
"""Switch the RTC on with LSI, and unlock its registers. PWR_ON must come first."""
SYSTICK_1_KHZ = put("SYST_RVR", 15_999) + put("SYST_CVR", 0) + put("SYST_CSR", 7)
HSE_ON = (
    put("RCC_CR", 1 << 16 | 0x83)
    + poll("RCC_CR", 1 << 17, "hse")
    + put("RCC_CFGR", 1)
    + poll("RCC_CFGR", 4, "sws")
)


def wake_up_after(counts: int) -> str:
    """Return the set-up of the wake-up timer: ``counts`` of 0.5 ms, with EXTI line 22."""
    return (
        put("RTC_CR", 0)
        + put("RTC_WUTR", counts - 1)
        + put("EXTI_RTSR", WAKE_UP_LINE)
        + put("EXTI_IMR", WAKE_UP_LINE)
        + put("ISER0", 1 << 3)
        + put("RTC_CR", 1 << 10 | 1 << 14)
    )


def sleep(instruction: str = "wfi", control: int = 0) -> str:
    """Return the instructions that enter a deep sleep with these bits of PWR_CR."""
    return put("PWR_CR", DBP | control) + put("SCR", SLEEPDEEP) + instruction + "\n"


_HANDLER = """
interrupt:
    mrs r0, ipsr
    lsls r0, r0, #2
    mov32 r1, COUNTS
    adds r1, r1, r0
    ldr r2, [r1]
    adds r2, #1
    str r2, [r1]
"""


class PowerBoard:
    """A board with a program, and reads of the memory and the registers."""

    def __init__(self, source: str, folder: Path) -> None:
        source += (
            "\nend: b end\n"
            + _HANDLER
            + put("RTC_ISR", 0xFFFF_FB7F)
            + put("EXTI_PR", 0xFFFF_FFFF)
            + "bx lr\n"
        )
        code, labels = assemble(source, CODE, NAMES)
        table = [RAM + RAM_SIZE, labels["reset"] | 1, *[labels["interrupt"] | 1] * (VECTORS - 2)]
        file = folder / "program.bin"
        file.write_bytes(struct.pack(f"<{VECTORS}I", *table).ljust(CODE - FLASH, b"\xff") + code)
        self.board = Board(firmware=file, ideal=True)

    def run_ms(self, duration_ms: float) -> None:
        self.board.run_for(duration_ms / 1000)

    def word(self, name: str) -> int:
        """Return a register or word of memory."""
        assert self.board.chip is not None
        value = self.board.chip.core.peek(NAMES[name])
        assert value is not None
        return value

    def count(self, exception: int) -> int:
        """Return the number of runs of a handler."""
        assert self.board.chip is not None
        value = self.board.chip.core.peek(COUNTS + 4 * exception)
        assert value is not None
        return value

    def current_ua(self) -> float:
        return self.board.supply_current_ua()["STM32F401"]

    def edges_us(self) -> list[float]:
        """Return the times of the LED's edges in microseconds, without the first one, at the pin's set-up."""
        return [edge.t_ps / 1e6 for edge in self.board.trace.of(GpioEdge) if edge.pin == "PB5"][1:]

    def problems(self) -> list[str]:
        """Return the names of the problems that were noted."""
        return [note.problem for note in self.board.trace.of(DeviceNote)]
