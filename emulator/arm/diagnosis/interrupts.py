"""Which interrupts may still come, and why the tick may not (ARMv7-M ARM B1.5.4, B3.3)."""

from __future__ import annotations

from emulator.arm.cpu.core import Core
from emulator.arm.cpu.nvic import FIRST_INTERRUPT, SYS_TICK, bits
from emulator.arm.cpu.registers import MASKS, Registers
from emulator.arm.cpu.systick import CSR, ENABLE, TICKINT
from emulator.arm.diagnosis.vectors import exception_name


class Interrupts:
    """As the core is now."""

    def __init__(self, core: Core) -> None:
        self._core = core
        self._nvic = core.nvic
        self._level = core.exceptions.level()
        self._primask, self._basepri, self._faultmask, self.control = Registers(core.engine, MASKS).read()

    @property
    def handled(self) -> int:
        """The exception whose handler is running; 0 in Thread mode."""
        return self._core.exceptions.frames.handled()

    def preempts(self, number: int) -> bool:
        """Whether an exception is urgent enough to be taken now."""
        return self._nvic.group(self._nvic.priority[number]) < self._level

    def from_blocks(self, *, now: bool = True) -> list[int]:
        """Interrupts of the chip's blocks that are enabled; ``now``: and can be taken."""
        enabled = self._nvic.enabled >> FIRST_INTERRUPT << FIRST_INTERRUPT
        return [number for number in bits(enabled) if not now or self.preempts(number)]

    @property
    def tick_on(self) -> bool:
        """Whether SysTick counts and asks for its handler."""
        return self._core.systick.peek(CSR) & (ENABLE | TICKINT) == ENABLE | TICKINT

    def why_no_tick(self) -> str:
        """Why SysTick's handler cannot run; empty if it can."""
        if not self.tick_on:
            return "SysTick is off: HAL_Init() was not called, or HAL_SuspendTick() was."
        if self.preempts(SYS_TICK):
            return ""
        if self._primask or self._faultmask:
            return "interrupts are switched off: __disable_irq() without __enable_irq()."
        priority = self._nvic.priority
        if not self.handled:
            return f"BASEPRI is 0x{self._basepri:02X}, and SysTick's priority {priority[SYS_TICK] >> 4}."
        running = self.handled
        return (
            f"SysTick (priority {priority[SYS_TICK] >> 4}) cannot interrupt the handler of "
            f"{exception_name(running)} (priority {priority[running] >> 4}): give SysTick a smaller number, "
            "or do not wait in interrupts."
        )
