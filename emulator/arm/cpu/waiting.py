"""Waiting is skipped, exactly: iterations of a loop that can only repeat themselves are counted, not
executed.

A *passage* is a read of a register that has no side effect: a moment at which a loop that polls may come by
again. When all of the core's state and all of RAM are the same at two passages, and nothing in between could
make a difference, everything up to the second one will be repeated until something from outside intervenes:
an event of the clock, or a change of a register that was read. Then as many whole iterations as fit before
that are added to the time line, in the middle of the second passage. If that read is the only one of the
iteration, one more is added, and it gives what the register has become.

What must not be in between: a write that changes something, a read with a side effect, a value that has
changed since it was read (its block says at each read until when it is valid), an exception, an event (the
last two end the run). The exclusive monitor is not compared: a loop that waits with LDREX and STREX opens it
anew in each iteration.

Decision: exact recurrence and nothing cleverer. A loop that counts down a timeout while it polls never
repeats itself; it is executed. The road not taken, to recognise the HAL's loops by their code, would be
faster for one compiler and wrong for the next.
"""

from __future__ import annotations

from collections.abc import Iterable

from emulator.arm.cpu.slice import Slice
from emulator.clock import NEVER_PS

_INTERESTING = 3  # reads of a register after which it is worth comparing states
_TIRED = 50  # passages in vain, one after another, after which it is not
_REST = 2000  # reads without comparing then
_KEPT = 64  # states; a loop has few passages


class Waiting:
    """``enabled`` False executes everything, with the same results."""

    def __init__(self, run: Slice, enabled: bool = True) -> None:
        self.skipped = 0
        """Instructions counted without being executed."""
        self.accesses = 0
        """Of the core to registers."""
        self._enabled = enabled
        self._slice = run
        self._state = run.engine.state_in_callback
        self._timeline = run.timeline
        self._clock = run.clock
        self._interest: dict[int, int] = {}
        self._seen: dict[bytes, tuple[int, int, list[bytes]]] = {}
        """Of each passage its position, the accesses so far, and RAM; by the registers."""
        self._valid_ps = NEVER_PS

    @property
    def comparing(self) -> bool:
        """Whether there are passages that a disturbance would make useless."""
        return bool(self._seen)

    def disturb(self) -> None:
        """An access that is no mere look at a register."""
        self.accesses += 1
        if self._seen:
            self.forget()

    def forget(self) -> None:
        """Something has happened that the next iteration need not repeat."""
        self._seen.clear()
        self._valid_ps = NEVER_PS

    def know_loop(self, addresses: Iterable[int], period: int) -> None:
        """An iteration of the loop at these addresses has so many instructions; 0 forgets it.

        For who can make use of it within a run.
        """

    def polled(self, position: int, register: int, now_ps: int, until_ps: int) -> bool:
        """The instruction at ``position`` has read a register, which will be the same until ``until_ps``.

        True: it is to be read again, because it is later now.
        """
        self.accesses = accesses = self.accesses + 1
        interest = self._interest.get(register, 0)
        if interest < _INTERESTING or not self._enabled:
            self._interest[register] = interest + 1
            if self._seen:
                self.forget()
            return False
        if now_ps >= self._valid_ps:
            self.forget()
        self._valid_ps = min(self._valid_ps, until_ps)
        registers, ram = self._state()
        before = self._seen.get(registers)
        self._seen[registers] = position, accesses, ram
        # LDM and LDRD read several registers at one passage
        if before is not None and before[2] == ram and before[0] != position:
            if interest != _INTERESTING:
                self._interest[register] = _INTERESTING
            skipped, changed = self._skip(position, position - before[0], alone=accesses - before[1] == 1)
            self._seen[registers] = position + skipped, accesses, ram
            return changed
        self._interest[register] = interest + 1 if interest <= _INTERESTING + _TIRED else -_REST
        if len(self._seen) > _KEPT:
            self.forget()
        return False

    def _skip(self, position: int, period: int, alone: bool) -> tuple[int, bool]:
        """Go to the last passage before anything happens; where the read is ``alone`` in its loop, to the
        first one at which the register has changed. Gives the instructions skipped, and whether it has.
        """
        run, line = self._slice, self._timeline
        limit, end = run.limit.value, run.end
        if line.count + limit <= position:
            return 0, False  # the run is to end behind this instruction
        iterations, changed = (end - position) // period, False
        if self._valid_ps < NEVER_PS:
            last = line.position(self._valid_ps)  # at which nothing has changed yet
            needed = (last - position) // period + 1
            changed = alone and needed <= iterations
            iterations = needed if changed else min(needed - 1, iterations)
        if iterations <= 0:
            return 0, False
        skipped = iterations * period
        self.skipped += skipped
        line.count += skipped
        if line.count + limit > end:
            run.limit.value = end - line.count
        return skipped, changed
