"""An interval timer with update interrupt and without drift (RM0368 section 14: TIM9 to TIM11)."""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction

from fcu_emulator.emulator.clock import PS_PER_S, Clock, Event
from fcu_emulator.emulator.trace import TickLate, TickLost, Trace


class IntervalTimer:
    """A counter that counts at ``input_hz / (PSC + 1)`` up to ARR.

    ``interrupt()`` is called when the enabled update flag becomes set. A tick is lost if the flag
    is still set, and late if its handler starts after the update.
    """

    def __init__(
        self, name: str, clock: Clock, trace: Trace, input_hz: int, interrupt: Callable[[], None]
    ) -> None:
        self.name = name
        self.ticks = 0
        self.late = 0
        self.lost = 0
        self._longest_wait_ps = 0
        self._clock = clock
        self._trace = trace
        self._input_hz = input_hz
        self._interrupt = interrupt
        self._period_ps = Fraction(PS_PER_S, input_hz)
        self._num, self._den = 1, 1
        self._origin_ps = 0
        self._count = 0  # updates since the start
        self._event: Event | None = None
        self._running = False
        self._flag = False
        self._due_ps = 0

    @property
    def rate_hz(self) -> float:
        return float(PS_PER_S / self._period_ps)

    def configure(self, prescaler: int, period: int) -> None:
        """Write PSC and ARR; this sets the flag (EGR.UG, RM0368 14.4.5)."""
        self._period_ps = Fraction(PS_PER_S * (prescaler + 1) * (period + 1), self._input_hz)
        self._flag = True
        self._due_ps = self._clock.now_ps

    def enable_interrupt(self) -> None:
        """Set DIER.UIE. If the flag is set, the interrupt follows immediately."""
        if self._flag:
            self.ticks += 1
            self._due_ps = self._clock.now_ps
            self._interrupt()

    @property
    def longest_wait_s(self) -> float:
        return self._longest_wait_ps / PS_PER_S

    def start(self) -> None:
        """Set CR1.CEN, and count from zero."""
        if self._event is not None:
            self._event.cancel()
            self._event = None
        self._num, self._den = self._period_ps.numerator, self._period_ps.denominator
        self._origin_ps, self._count = self._clock.now_ps, 0
        self._running = True
        self._event = self._clock.schedule(self._origin_ps + self._num // self._den, self._update)

    def acknowledge(self) -> None:
        self._flag = False
        now_ps = self._clock.now_ps
        if now_ps > self._due_ps:
            self._account(now_ps)
        if self._running and self._event is not None:
            at_ps = self._origin_ps + (self._count + 1) * self._num // self._den
            self._clock.repeat(self._event, at_ps)

    def _account(self, now_ps: int) -> None:
        waited_ps = now_ps - self._due_ps
        self.late += 1
        self._longest_wait_ps = max(self._longest_wait_ps, waited_ps)
        self._trace.add(TickLate(now_ps, self.name, waited_ps))
        if not self._running:
            return
        # the largest k whose time, k * num // den, is not after now
        happened = ((now_ps - self._origin_ps + 1) * self._den - 1) // self._num
        lost = happened - self._count
        if lost:
            self._count = happened
            self.ticks += lost
            self.lost += lost
            self._trace.add(TickLost(now_ps, self.name, lost))

    def _update(self) -> None:
        self._count += 1
        self.ticks += 1
        self._flag = True
        self._due_ps = self._clock.now_ps
        self._interrupt()
