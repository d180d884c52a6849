"""How a timer's update interrupt did: ticks, late ones, lost ones; the same account as
:mod:`emulator.timer`'s.

A tick is an update while its interrupt is enabled. It is lost when the flag of the one before had not been
cleared yet, and late when its handler cleared the flag more than ``PROMPT_PS`` after it: on ARM the handler
never comes at once, and entering it and finding out which flag it was takes ST's HAL about a hundred
instructions.
"""

from __future__ import annotations

from emulator.clock import PS_PER_US
from emulator.trace import TickLate, TickLost, Trace

PROMPT_PS = 10 * PS_PER_US


class TickAccount:
    """Counts of one timer."""

    def __init__(self, name: str, trace: Trace) -> None:
        self.ticks = 0
        self.late = 0
        self.lost = 0
        self.longest_wait_ps = 0
        self.waiting = False  # a tick's handler has not come yet
        self._name = name
        self._trace = trace
        self._due_ps = 0
        self._missed = 0

    def due(self, now_ps: int) -> None:
        """The flag has become set: a handler is wanted."""
        self.ticks += 1
        self.waiting = True
        self._due_ps = now_ps

    def missed(self, count: int) -> None:
        """Updates while the flag was still set."""
        self._missed += count

    def acknowledged(self, now_ps: int) -> None:
        """The handler has cleared the flag."""
        self.waiting = False
        waited_ps = now_ps - self._due_ps
        if waited_ps > PROMPT_PS:
            self.late += 1
            self.longest_wait_ps = max(self.longest_wait_ps, waited_ps)
            self._trace.add(TickLate(now_ps, self._name, waited_ps))
        if self._missed:
            count, self._missed = self._missed, 0
            self.ticks += count
            self.lost += count
            self._trace.add(TickLost(now_ps, self._name, count))

    def forget(self) -> None:
        """The interrupt was switched off, or the block reset: what waited is no tick any more."""
        self.waiting, self._missed = False, 0
