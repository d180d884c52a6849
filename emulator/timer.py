"""TIM9 as an interval timer with its update interrupt (reference manual RM0368 section 14)."""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction

from emulator.clock import PS_PER_S, Clock, Periodic
from emulator.trace import TickLate, TickLost, Trace


class IntervalTimer:
    """Counts ``input_hz / (PSC + 1)`` up to ARR and raises the update interrupt.

    ``interrupt()`` is called whenever the update flag becomes set while the interrupt is enabled. A tick that
    comes while the flag is still set is lost, as in hardware; one whose handler starts after its time is
    late.
    """

    def __init__(
        self, name: str, clock: Clock, trace: Trace, input_hz: int, interrupt: Callable[[], None]
    ) -> None:
        self.name = name
        self.ticks = 0
        self.late = 0
        self.lost = 0
        self.longest_wait_ps = 0
        self._clock = clock
        self._trace = trace
        self._input_hz = input_hz
        self._interrupt = interrupt
        self._period_ps = Fraction(PS_PER_S, input_hz)
        self._running: Periodic | None = None
        self._flag = False
        self._due_ps = 0

    @property
    def rate_hz(self) -> float:
        """Update rate as configured."""
        return float(PS_PER_S / self._period_ps)

    def configure(self, prescaler: int, period: int) -> None:
        """Write PSC and ARR and generate an update (EGR.UG), which sets the flag: RM0368 14.4.5."""
        self._period_ps = Fraction(PS_PER_S * (prescaler + 1) * (period + 1), self._input_hz)
        self._flag = True
        self._due_ps = self._clock.now_ps

    def start(self) -> None:
        """Enable the interrupt and count from zero; a flag left by ``configure`` interrupts at once."""
        if self._running is not None:
            self._running.cancel()
        self._running = Periodic(self._clock, self._clock.now_ps, self._period_ps, self._update)
        if self._flag:
            self.ticks += 1
            self._due_ps = self._clock.now_ps
            self._interrupt()

    def acknowledge(self) -> None:
        """The interrupt handler clears the flag; accounts for how late it is."""
        self._flag = False
        waited_ps = self._clock.now_ps - self._due_ps
        if waited_ps > 0:
            self.late += 1
            self.longest_wait_ps = max(self.longest_wait_ps, waited_ps)
            self._trace.add(TickLate(self._clock.now_ps, self.name, waited_ps))

    def _update(self) -> None:
        self.ticks += 1
        if self._flag:
            self.lost += 1
            self._trace.add(TickLost(self._clock.now_ps, self.name))
            return
        self._flag = True
        self._due_ps = self._clock.now_ps
        self._interrupt()
