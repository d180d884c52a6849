"""The processor for Python firmware. Virtual time passes only while the firmware waits.

Decision: Python firmware runs in a greenlet, not in a thread or a generator. Threads need locks and
switch ten times more slowly. Generators need ``yield from`` before every HAL call.
"""

from __future__ import annotations

import bisect
from collections.abc import Callable
from contextlib import suppress

from greenlet import error as greenlet_error
from greenlet import getcurrent, greenlet

from fcu_emulator.emulator.clock import Clock
from fcu_emulator.emulator.errors import FirmwareError, InputError, NotJudgedError

_THREAD_PRIORITY = 256  # below every interrupt


class Interrupt:
    """An interrupt line: its NVIC priority and its handler."""

    __slots__ = ("_pending", "handler", "priority")

    def __init__(self, cpu: PythonCpu, priority: int, handler: Callable[[], None]) -> None:
        self.priority = priority
        self.handler = handler
        self._pending = cpu.pending

    def set_pending(self) -> None:
        pending = self._pending
        if not pending:
            pending.append(self)
        elif self not in pending:
            bisect.insort(pending, self, key=lambda entry: entry.priority)


class PythonCpu:
    """Runs ``main`` and the interrupt handlers on the board's clock."""

    def __init__(self, clock: Clock) -> None:
        self._clock = clock
        self._active = _THREAD_PRIORITY
        self.pending: list[Interrupt] = []
        self._context: greenlet | None = None
        self._caller: greenlet | None = None
        self._main: Callable[[], None] | None = None

    def boot(self, main: Callable[[], None]) -> None:
        self._main = main

    def run_until_ps(self, at_ps: int) -> None:
        """Run up to and including ``at_ps``. Raises FirmwareError, or InputError if a later call comes from
        another thread.
        """
        if self._context is None:
            self._context = greenlet(self._run_main)
        if self._context.dead:
            self._clock.advance_to(at_ps)
            return
        self._caller = getcurrent()
        try:
            self._context.parent = self._caller
        except ValueError as error:
            raise InputError(
                "firmware in Python must run in the thread in which it started; "
                "run the board in that thread, or use firmware built for the chip",
                kind="other_thread",
            ) from error
        pause = self._clock.schedule(at_ps, self._pause, last=True)
        try:
            self._context.switch()
        finally:
            pause.cancel()
        self._clock.advance_to(at_ps)  # the firmware has returned

    def close(self) -> None:
        """End the greenlet and unwind its stack."""
        if self._context and not self._context.dead:
            with suppress(greenlet_error):  # the greenlet belongs to a thread that has ended
                self._context.parent = (
                    getcurrent()
                )  # control then returns here, even if this code runs inside another firmware
                self._context.throw()

    def snapshot(self) -> None:
        """Raise InputError if Python firmware is loaded."""
        if self._main is not None:
            raise InputError(
                "firmware in Python runs on a stack that cannot be copied, so this board has no snapshots; "
                "use firmware built for the chip, or no firmware",
                kind="not_copied",
            )

    def restore(self, state: None) -> None:
        """Do nothing, because there is no state."""

    def _pause(self) -> None:
        assert self._caller is not None
        self._caller.switch()

    def _run_main(self) -> None:
        assert self._main is not None
        try:
            self._main()
        except (InputError, NotJudgedError, MemoryError):
            raise  # the firmware did not cause this error
        except Exception as error:
            raise FirmwareError(
                f"the firmware failed at {self._clock.now_s:.6f} s: {type(error).__name__}: {error}"
            ) from error

    @property
    def in_interrupt(self) -> bool:
        return self._active != _THREAD_PRIORITY

    # -- functions for the firmware's HAL ---------------------------------------------------------------

    def take_interrupts(self) -> None:
        pending = self.pending
        while pending and pending[0].priority < self._active:
            interrupt = pending.pop(0)
            preempted, self._active = self._active, interrupt.priority
            try:
                interrupt.handler()
            finally:
                self._active = preempted

    def wait_until(self, at_ps: int) -> None:
        """Let time pass until ``at_ps``, or longer if handlers return later."""
        clock, pending = self._clock, self.pending
        while clock.next_ps <= at_ps:
            clock.fire_next()
            if pending:
                self.take_interrupts()
        clock.now_ps = max(clock.now_ps, at_ps)

    def wait_for(self, condition: Callable[[], bool], until_ps: int) -> None:
        clock = self._clock
        while not condition() and clock.now_ps < until_ps:
            self.wait_until(min(clock.next_ps, until_ps))

    def elapse(self, duration_ps: int) -> None:
        """Let a duration pass, plus the time of handlers that preempt the firmware."""
        clock = self._clock
        end_ps = clock.now_ps + duration_ps
        while clock.next_ps <= end_ps:
            clock.fire_next()
            if self.pending:
                before_ps = clock.now_ps
                self.take_interrupts()
                end_ps += clock.now_ps - before_ps
        clock.now_ps = end_ps
