"""A timer's time base: prescaler, counter and updates as functions of virtual time (RM0368 12.3.1 to 12.3.3).

Time is counted in whole ticks of the timer's clock since ``_origin_ps``, never added up, so nothing drifts:
800 Hz is 800 updates a second after an hour too. ``catch_up`` needs a few steps however long nobody looked:
up to the first update, which loads the preloaded registers, and from there, as nothing changes any more,
whole cycles at once.

The one or two ticks of synchronisation between CEN and the first count are not modelled.
"""

from __future__ import annotations

from collections.abc import Callable

from emulator.arm.peripherals.tim_counter import Counter
from emulator.clock import PS_PER_S


class TimeBase:
    """Counts at ``hz`` / ``prescale``. ``prescale`` is the active PSC + 1, ``counter.arr`` the active ARR.

    ``moved(steps)`` is called before the counter advances by ``steps`` at most up to the next update;
    ``updated(count)`` after that many updates, for it to load what was preloaded.
    """

    def __init__(
        self, bits: int, hz: int, moved: Callable[[int], None], updated: Callable[[int], None]
    ) -> None:
        self.counter = Counter(bits)
        self.hz = hz
        self.prescale = 1
        self.repetition = 0  # TIM1's active RCR: overflows that are no update, before each one that is
        self.updates = True  # not CR1.UDIS
        self.one_pulse = False
        self.running = False
        self._moved = moved
        self._updated = updated
        self._left = 0  # of ``repetition``
        self._origin_ps = 0
        self._base = 0  # the tick at which the counter arrived where it is; while stopped, minus the phase

    def start(self, now_ps: int) -> None:
        """CEN = 1: go on from where it stopped."""
        if not self.running:
            self.running, self._origin_ps = True, now_ps

    def stop(self, now_ps: int) -> None:
        """CEN = 0; the prescaler keeps its phase. Call ``catch_up`` first."""
        if self.running:
            self.running = False
            self._base -= self._ticks(now_ps)

    def set_hz(self, now_ps: int, hz: int) -> None:
        """Another clock from now on. Call ``catch_up`` first."""
        if self.running:
            self._base -= self._ticks(now_ps)
            self._origin_ps = now_ps
        self.hz = hz

    def restart(self, now_ps: int) -> None:
        """Counter and prescaler begin anew (EGR.UG)."""
        self.counter.restart()
        self._base = self._ticks(now_ps) if self.running else 0
        self._left = self.repetition

    def steps_to_update(self) -> int | None:
        """Counts until the next update; None while there will be none."""
        if not self.updates or self.counter.blocked:
            return None
        return self.counter.steps_to_event() + self._left * self.counter.event_spacing

    def time_ps(self, steps: int) -> int:
        """When the counter will have counted ``steps`` more, while it runs."""
        return self._origin_ps + (self._base + steps * self.prescale) * PS_PER_S // self.hz

    def catch_up(self, now_ps: int) -> None:
        """Bring the counter to ``now_ps``."""
        if not self.running:
            return
        ticks = self._ticks(now_ps)
        while True:
            if self.counter.blocked:
                self._base = ticks
                return
            steps = (ticks - self._base) // self.prescale
            first = self.steps_to_update()
            if first is None or steps < first:
                self._count(steps)
                return
            self._count(first)
            self._update(1)
            if self.one_pulse:
                self.running, self._base = False, 0
                return
            self._skip_cycles(ticks)

    def _skip_cycles(self, ticks: int) -> None:
        """Right after an update: whole cycles up to ``ticks`` repeat it."""
        if self.counter.blocked:
            return
        cycle = (self.repetition + 1) * self.counter.event_spacing
        whole = (ticks - self._base) // self.prescale // cycle
        if whole:
            self._count(whole * cycle)
            self._update(whole)

    def _update(self, count: int) -> None:
        self._updated(count)
        self._left = self.repetition

    def _count(self, steps: int) -> None:
        if steps:
            self._moved(steps)
            if self.updates:
                self._left -= self.counter.events_in(steps)
            self._base += steps * self.prescale
            self.counter.advance(steps)

    def _ticks(self, now_ps: int) -> int:
        """The largest k whose time, ``_origin_ps + k * PS_PER_S // hz``, is not after now."""
        return ((now_ps - self._origin_ps + 1) * self.hz - 1) // PS_PER_S
