"""The clock tree's arithmetic: from RCC's registers to frequencies (RM0368 section 6.2, figure 12).

Pure functions of register values; what is ready when is :mod:`emulator.chip.peripherals.rcc`'s.
"""

from __future__ import annotations

from dataclasses import dataclass

HSI_HZ = 16_000_000
HSE_HZ = 16_000_000  # the board's crystal (board facts, section 1)
LSI_HZ = 32_000  # STM32F401xB/C datasheet, LSI oscillator: 17 to 47 kHz
LSE_HZ = 32_768

HSI, HSE, PLL = range(3)  # RCC_CFGR.SW and SWS

_AHB_SHIFT = (0, 0, 0, 0, 0, 0, 0, 0, 1, 2, 3, 4, 6, 7, 8, 9)  # there is no division by 32 (6.3.3)
_APB_SHIFT = (0, 0, 0, 0, 1, 2, 3, 4)


@dataclass(frozen=True)
class PllOutput:
    """What RCC_PLLCFGR makes of its source: ``p_hz`` can be SYSCLK, ``q_hz`` is for USB and SDIO."""

    input_hz: int
    vco_hz: int
    p_hz: int
    q_hz: int

    def problem(self) -> str:
        """Why the manual forbids this setting, or "" (RM0368 6.3.2)."""
        if not 950_000 <= self.input_hz <= 2_100_000:  # the datasheet's limits; the manual says 1 to 2 MHz
            return f"PLL input is {self.input_hz / 1e6:g} MHz, M must make it 1 to 2 MHz"
        if not 192_000_000 <= self.vco_hz <= 432_000_000:
            return f"PLL VCO is {self.vco_hz / 1e6:g} MHz, N must make it 192 to 432 MHz"
        if self.p_hz > 84_000_000:
            return f"PLL output is {self.p_hz / 1e6:g} MHz, the chip's limit is 84 MHz"
        return ""


def pll(pllcfgr: int) -> PllOutput:
    """The PLL's frequencies; M = 0 and 1 are not allowed and count as 1."""
    source_hz = HSE_HZ if pllcfgr >> 22 & 1 else HSI_HZ
    m, n = max(pllcfgr & 0x3F, 1), pllcfgr >> 6 & 0x1FF
    p, q = 2 * ((pllcfgr >> 16 & 3) + 1), max(pllcfgr >> 24 & 0xF, 1)
    vco_hz = source_hz * n // m
    return PllOutput(source_hz // m, vco_hz, vco_hz // p, vco_hz // q)


@dataclass(frozen=True)
class Frequencies:
    """All clocks behind SYSCLK, in Hz."""

    sysclk_hz: int
    hclk_hz: int
    pclk1_hz: int
    pclk2_hz: int
    timer1_hz: int
    timer2_hz: int

    def problem(self) -> str:
        """Which limit of the chip is exceeded, or "" (RM0368 6.2: 84, 42 and 84 MHz)."""
        if self.pclk1_hz > 42_000_000:
            return f"APB1 runs at {self.pclk1_hz / 1e6:g} MHz, PPRE1 must make it 42 MHz or less"
        return ""


def frequencies(sysclk_hz: int, cfgr: int, *, timpre: bool = False) -> Frequencies:
    """The clocks that RCC_CFGR's prescalers make of SYSCLK; ``timpre`` is RCC_DCKCFGR.TIMPRE (6.3.23)."""
    hclk_hz = sysclk_hz >> _AHB_SHIFT[cfgr >> 4 & 0xF]
    shift1, shift2 = _APB_SHIFT[cfgr >> 10 & 7], _APB_SHIFT[cfgr >> 13 & 7]
    return Frequencies(
        sysclk_hz,
        hclk_hz,
        hclk_hz >> shift1,
        hclk_hz >> shift2,
        _timer_hz(hclk_hz, shift1, timpre),
        _timer_hz(hclk_hz, shift2, timpre),
    )


def _timer_hz(hclk_hz: int, shift: int, timpre: bool) -> int:
    """Twice the bus clock unless that is undivided; with TIMPRE four times, but never above HCLK."""
    multiple = 2 if timpre else 1
    return hclk_hz >> max(shift - multiple, 0)
