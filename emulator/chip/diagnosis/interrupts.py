"""Which interrupts may still come, and why the tick may not (ARMv7-M ARM B1.5.4, B3.3)."""

from __future__ import annotations

from emulator.chip.cpu.core import Core
from emulator.chip.cpu.exceptions import FIRST_INTERRUPT, SYS_TICK, bits
from emulator.chip.cpu.registers import MASKS, Registers
from emulator.chip.diagnosis.vectors import exception_name

_SYST_CSR = 0xE000_E010
_ON = 1 << 0 | 1 << 1  # ENABLE, TICKINT


class Interrupts:
    """As the core is now."""

    def __init__(self, core: Core) -> None:
        self._core = core
        self._primask, self._basepri, self._faultmask, self.control = Registers(core, MASKS).read()

    @property
    def handled(self) -> int:
        """The exception whose handler is running; 0 in Thread mode."""
        return self._core.handled

    def preempts(self, number: int) -> bool:
        """Whether an exception is urgent enough to be taken now."""
        return self._core.preempts(number)

    def from_blocks(self, *, now: bool = True) -> list[int]:
        """Interrupts of the chip's blocks that are enabled; ``now``: and can be taken."""
        enabled = self._core.enabled >> FIRST_INTERRUPT << FIRST_INTERRUPT
        return [number for number in bits(enabled) if not now or self.preempts(number)]

    @property
    def tick_on(self) -> bool:
        """Whether SysTick counts and asks for its handler."""
        return (self._core.peek(_SYST_CSR) or 0) & _ON == _ON

    def why_no_tick(self) -> str:
        """Why SysTick's handler cannot run; empty if it can."""
        if not self.tick_on:
            return "SysTick is off: HAL_Init() was not called, or HAL_SuspendTick() was."
        if self.preempts(SYS_TICK):
            return ""
        if self._primask or self._faultmask:
            return "interrupts are switched off: __disable_irq() without __enable_irq()."
        priority = self._core.priority
        if not self.handled:
            return f"BASEPRI is 0x{self._basepri:02X}, and SysTick's priority {priority(SYS_TICK) >> 4}."
        running = self.handled
        return (
            f"SysTick (priority {priority(SYS_TICK) >> 4}) cannot interrupt the handler of "
            f"{exception_name(running)} (priority {priority(running) >> 4}): give SysTick a smaller number, "
            "or do not wait in interrupts."
        )
