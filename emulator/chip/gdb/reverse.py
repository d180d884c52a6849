"""Reverse execution: the previous instruction, and the previous breakpoint or watchpoint.

The board returns to a snapshot of its history and runs forwards again, up to the wanted instruction.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple, Protocol

from fcu_emulator.emulator.chip.cpu.core import Core
from fcu_emulator.emulator.chip.gdb.target import HaltReason, Point
from fcu_emulator.emulator.chip.history import History, Moment
from fcu_emulator.emulator.clock import PS_PER_US, Clock

_STEPPED_PS = 5 * PS_PER_US
"""Time before the wanted instruction, which is repeated in single steps: about 300 instructions."""
_MOST_STOPS = 1_000
"""Maximum number of stops in one search. If there are more, the later half of the remaining time is searched first."""


class PointsOfCore(Protocol):
    """Breakpoints and watchpoints."""

    def lift(self) -> None:
        """Remove all points from the core until it resumes."""
        ...

    def breakpoint_at(self, address: int) -> Point | None: ...


class _Steps(NamedTuple):
    """A state, and the time after each of the single steps from this state. ``inputs``: the history's number of inputs."""

    begin: Moment
    times: list[int]
    inputs: int


class _Stop(NamedTuple):
    """Stop ``number`` after ``begin_ps``; number 0 is the state at ``begin_ps``."""

    moment: Moment
    begin_ps: int
    number: int
    at_ps: int
    reason: HaltReason


class Reverse:
    """Moves a halted core backwards in a history.

    ``resume_until(at_ps)``: run up to the next stop, and return its reason, or None.
    """

    def __init__(
        self,
        core: Core,
        clock: Clock,
        history: History,
        resume_until: Callable[[int], HaltReason | None],
        points: PointsOfCore,
    ) -> None:
        self._core = core
        self._clock = clock
        self._history = history
        self._resume_until = resume_until
        self._points = points
        self._steps: _Steps | None = None

    def step(self) -> bool:
        """Return to the state before the previous instruction. Return False at the start of the history."""
        self._points.lift()
        end_ps = self._clock.now_ps
        steps = self._steps_before(end_ps)
        if steps is None:
            return False
        self._history.return_to(steps.begin)
        count = sum(at_ps < end_ps for at_ps in steps.times)
        for _ in range(count):
            self._single_step(end_ps)
        return True

    def search(self, is_interrupted: Callable[[], bool]) -> HaltReason | None:
        """Return to the previous stop. Return None at the start of the history, or after an interrupt."""
        end_ps = self._clock.now_ps
        for moment in self._history.moments_before(end_ps):
            stop = self._last_stop(moment, moment.at_ps, end_ps)
            if stop is not None:
                self._return_to(stop)
                return stop.reason
            end_ps = moment.at_ps
            self._history.return_to(moment)
            if is_interrupted():
                return None
        return None

    # -- single steps -----------------------------------------------------------------------------------

    def _steps_before(self, end_ps: int) -> _Steps | None:
        """Return single steps that include the last one before ``end_ps``."""
        kept = self._steps
        inputs = self._history.inputs
        if kept is not None and kept.inputs == inputs and kept.begin.at_ps < end_ps <= kept.times[-1]:
            return kept
        for moment in self._history.moments_before(end_ps):
            begin_ps = max(moment.at_ps, end_ps - _STEPPED_PS)
            self._run_to(moment, begin_ps)
            if self._clock.now_ps >= end_ps or self._core.asleep:
                self._history.return_to(moment)  # asleep: the previous instruction is much earlier
            begin = self._history.moment()
            times: list[int] = []
            while not times or times[-1] < end_ps:
                self._single_step(end_ps)
                times.append(self._clock.now_ps)
            self._steps = _Steps(begin, times, inputs)
            return self._steps
        return None

    def _single_step(self, end_ps: int) -> None:
        self._core.resume(step=True)
        self._history.run_until_ps(end_ps)

    # -- breakpoints and watchpoints --------------------------------------------------------------------

    def _last_stop(self, moment: Moment, begin_ps: int, end_ps: int) -> _Stop | None:
        """Return the last stop at or after ``begin_ps`` and before ``end_ps``."""
        self._run_to(moment, begin_ps)
        found = self._stop_here(moment, begin_ps)
        for number in range(1, _MOST_STOPS + 1):
            reason = self._resume_until(end_ps)
            if reason is None or self._clock.now_ps >= end_ps:
                return found
            found = _Stop(moment, begin_ps, number, self._clock.now_ps, reason)
        seen_ps = self._clock.now_ps
        middle_ps = (seen_ps + end_ps) // 2
        if middle_ps == seen_ps:
            return found
        later = self._last_stop(moment, middle_ps, end_ps)
        return later or self._last_stop(moment, seen_ps, middle_ps) or found

    def _stop_here(self, moment: Moment, begin_ps: int) -> _Stop | None:
        """Return a stop at the current instruction, or None."""
        point = None if self._core.asleep else self._points.breakpoint_at(self._core.pc)
        return _Stop(moment, begin_ps, 0, begin_ps, HaltReason(point, point.address)) if point else None

    def _return_to(self, stop: _Stop) -> None:
        """Return to a breakpoint, or to the instruction whose access hits a watchpoint."""
        self._run_to(stop.moment, stop.begin_ps)
        for _ in range(stop.number):
            self._resume_until(stop.at_ps)
        if stop.reason.point is not None and not stop.reason.point.kind.is_break:
            self.step()

    def _run_to(self, moment: Moment, at_ps: int) -> None:
        """Return to a moment, run from there up to ``at_ps``, and halt."""
        self._points.lift()
        self._history.return_to(moment)
        if at_ps > moment.at_ps:
            self._core.resume(step=False)
            self._history.run_until_ps(at_ps)
            self._core.halt()
