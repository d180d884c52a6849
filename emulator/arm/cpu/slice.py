"""The run of instructions under way: when the one in flight happens, and when the run has to end.

A run ends before anything happens that the instructions could notice: at the next event of the clock, and
behind an access that schedules an earlier one or makes an interrupt takeable. An IT block cannot be
divided, so a run may end a few instructions late; an event due inside one is fired by the first access
behind its time.
"""

from __future__ import annotations

from emulator.arm.cpu.engine import Engine
from emulator.arm.cpu.nvic import Nvic
from emulator.arm.cpu.timeline import Timeline
from emulator.arm.peripherals.peripheral import ALREADY_PS
from emulator.clock import Clock

_LONGEST = 2_000_000  # instructions; some 10 ms, after which other threads and Ctrl-C get a turn


class Slice:
    """``end_ps`` is the time before which the run under way has to end, ``end`` the last instruction before
    it, counted like ``timeline.count``; ``at_ps`` the time until which the core is to run.
    """

    def __init__(self, engine: Engine, timeline: Timeline, clock: Clock, nvic: Nvic) -> None:
        self.engine = engine
        self.timeline = timeline
        self.clock = clock
        self.nvic = nvic
        self.counter, self.limit = engine.counter, engine.limit
        self.end_ps = self.end = self.at_ps = 0
        self.until_ps: int = ALREADY_PS
        """Until when the register that was last looked at stays as it is."""

    def plan(self, at_ps: int) -> int:
        """How many instructions may be executed until the next event, or until ``at_ps``."""
        self.at_ps = at_ps
        self.end_ps = min(self.clock.next_ps, at_ps)
        instructions = min(self.timeline.until(self.end_ps), _LONGEST)
        self.end = self.timeline.count + instructions
        return instructions

    def arrive(self) -> None:
        """An access is about to happen: it is now, and everything due by now has happened."""
        line = self.timeline
        now_ps = line.origin_ps + ((line.count + self.counter.value - 1) * line.num + line.extra) // line.den
        self.clock.now_ps = now_ps
        if self.clock.next_ps <= now_ps:
            self.clock.advance_to(now_ps)

    def end_in_time(self) -> None:
        """After something has been scheduled or made pending: end the run when it matters."""
        if not self.engine.running:
            return
        if self.nvic.changed:
            self.engine.cut()
        self._end_by_then()

    def _end_by_then(self) -> None:
        self.end_ps = min(self.end_ps, self.clock.next_ps)
        allowed = self.timeline.until(self.end_ps)
        self.limit.value = max(min(self.limit.value, allowed), self.counter.value)
        self.end = min(self.end, self.timeline.count + max(allowed, self.counter.value))

    def set_rate(self, hclk_hz: int) -> None:
        """HCLK has become another one, now."""
        begun = self.counter.value - 1 if self.engine.running else 0
        if self.engine.running:
            self.timeline.set_rate(hclk_hz, self.clock.now_ps, begun)
            self.end = self.timeline.count + self.limit.value
            self.end_in_time()
        else:
            self.timeline.set_rate(hclk_hz, max(self.timeline.now_ps(), self.clock.now_ps), 0)
