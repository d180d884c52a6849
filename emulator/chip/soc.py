"""What the blocks of the chip share: time, trace, interrupt lines, clock tree, pins, reset."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Protocol

from emulator.buses.gpio import Gpio
from emulator.time.clock import Clock
from emulator.trace import Trace

CHIP = "STM32F401"
"""What the trace calls it."""


class ClockTree(Protocol):
    """Frequencies as the firmware has set RCC up (RM0368 section 6.2); implemented by the RCC block."""

    sysclk_hz: int
    hclk_hz: int
    pclk1_hz: int
    pclk2_hz: int
    timer1_hz: int
    """Clock of the timers on APB1: twice PCLK1 unless its prescaler is 1."""
    timer2_hz: int
    """Likewise on APB2."""

    def on_change(self, changed: Callable[[], None]) -> None:
        """Call ``changed()`` after any frequency has become another one."""
        ...


class InterruptLines(Protocol):
    """The NVIC's inputs; implemented by the core."""

    def set_line(self, number: int, level: bool) -> None:
        """Input ``number`` (0 is the first one after the system exceptions) is active or not.

        A level that stays active makes the interrupt pending again when its handler returns, as in hardware.
        """
        ...


class DmaRequests(Protocol):
    """The request lines of DMA1 and DMA2; implemented by the DMA blocks."""

    def request(self, line: str) -> bool:
        """``line`` ("I2C2_RX", "USART1_TX" as in RM0368 tables 28, 29) asks for one transfer.

        It is done at once. False: no stream serves the line now.
        """
        ...

    def remaining(self, line: str) -> int:
        """Transfers left (SxNDTR) of the stream that serves ``line``; 0 if none does."""
        ...


class Memory(Protocol):
    """The bus matrix as DMA sees it (RM0368 section 2.1); implemented by the core.

    Accesses to a peripheral reach its block, with side effects. ``size`` and ``len(data)`` are 1, 2 or 4.
    """

    def read(self, address: int, size: int) -> bytes | None:
        """The bytes at ``address``; None where a bus error answers."""
        ...

    def write(self, address: int, data: bytes) -> bool:
        """Write ``data``; False where a bus error answers."""
        ...


@dataclass
class Soc:
    """The chip's inner wiring. The fields that are blocks themselves are set while it is put together."""

    clock: Clock
    trace: Trace
    gpio: Gpio
    reset: Callable[[str], None]
    """Reset the chip, for the reason given ("IWDG", "WWDG", "SYSRESETREQ")."""
    clocks: ClockTree = field(init=False)
    irq: InterruptLines = field(init=False)
    dma: DmaRequests = field(init=False)
    memory: Memory = field(init=False)
