"""Loops that wait for a variable: ``HAL_Delay`` on its tick, ``while (!flag)``, ``while (1)``.

They touch no register, so nothing comes by that could be looked at. Instead a run of instructions without any
access is ended after a while, and looked at: is the core in a loop whose iteration is known? Then one
iteration is executed. If it leaves all registers and RAM as they were, it will be repeated until the next
event, and whole iterations are counted instead of being executed.

What is known is found by single steps: from where such a run has ended until the core's state recurs.

Decision: ends of runs. The road not taken, a hook on an instruction of the loop, costs every instruction of
the program a third of its speed.
"""

from __future__ import annotations

from collections.abc import Callable

from emulator.arm.cpu.slice import Slice
from emulator.arm.cpu.stop import Stop
from emulator.arm.cpu.waiting import Waiting

_LOOK = 20_000  # instructions after which a run is ended to look
_LONG = 2_000  # instructions without an access after which a loop is suspected
_LONGEST_LOOP = 256  # instructions of one iteration
_PAUSE = 1_000_000  # instructions between a search in vain and the next; doubled with each
_MOST_DOUBLINGS = 5
_MOST_PLACES = 4_000  # instructions in known loops
_IN_VAIN = 100  # iterations, one after another, that have repeated nothing

_Run = Callable[[int], Stop]


class IdleLoops:
    """Divides what is to be executed into runs, and skips the loops that it knows."""

    def __init__(self, run: Slice, waiting: Waiting, enabled: bool = True) -> None:
        self._slice = run
        self._engine = run.engine
        self._timeline = run.timeline
        self._waiting = waiting
        self._enabled = enabled
        self._periods: dict[int, int] = {}  # instructions of one iteration, by the address of each of them
        self._in_vain: dict[int, int] = {}
        self._suspect = -1
        self._next_look = _LOOK
        self._accesses = 0
        self._not_before = 0
        self._failures = 0

    def execute(self, instructions: int, run: _Run, step: Callable[[], bool]) -> None:
        """Execute or skip up to so many. ``run(n)`` executes n; ``step()`` one, False if it cannot."""
        address = self._engine.pc
        period = self._periods.get(address)
        if not self._enabled:
            run(instructions)
        elif period is not None and instructions >= 2 * period:
            self._iterate(address, period, run)
        elif address == self._suspect and instructions > _LONGEST_LOOP and self._may_search():
            self._search(address, step)
        elif run(min(instructions, self._next_look)) is Stop.SLICE:
            self._look()

    def _look(self) -> None:
        """Suspect a loop where nothing was accessed; look half as often as long as that goes on."""
        idle = self._waiting.accesses == self._accesses and self._engine.executed >= _LONG
        self._accesses = self._waiting.accesses
        self._next_look = 2 * self._next_look if idle else _LOOK
        self._suspect = self._engine.pc if idle else -1

    def _iterate(self, address: int, period: int, run: _Run) -> None:
        accesses, before = self._waiting.accesses, self._engine.whole_state()
        ordinary = run(period) is Stop.SLICE and self._engine.executed == period
        if ordinary and self._waiting.accesses == accesses and before == self._engine.whole_state():
            self._in_vain[address] = 0
            skipped = (self._slice.end - self._timeline.count) // period * period
            self._timeline.count += skipped
            self._waiting.skipped += skipped
            return
        self._in_vain[address] = self._in_vain.get(address, 0) + 1
        if self._in_vain[address] > _IN_VAIN:
            del self._periods[address], self._in_vain[address]
            self._waiting.know_loop([address], 0)

    # -- search -----------------------------------------------------------------------------------------

    def _may_search(self) -> bool:
        return self._timeline.retired >= self._not_before and len(self._periods) < _MOST_PLACES

    def _search(self, address: int, step: Callable[[], bool]) -> None:
        """Make steps until the state recurs."""
        self._suspect = -1
        state, begun = self._engine.whole_state(), self._timeline.retired
        accesses = self._waiting.accesses
        path = [address]
        for _ in range(_LONGEST_LOOP):
            if not step() or self._waiting.accesses != accesses:
                break
            if self._engine.pc == address:
                before, state = state, self._engine.whole_state()
                if state == before:
                    period = self._timeline.retired - begun
                    self._periods.update(dict.fromkeys(path, period))
                    self._waiting.know_loop(path, period)
                    self._failures = 0
                    return
                path, begun = [], self._timeline.retired  # an interrupt may have changed the first state
            path.append(self._engine.pc)
        self._not_before = self._timeline.retired + (_PAUSE << self._failures)
        self._failures = min(self._failures + 1, _MOST_DOUBLINGS)
