"""The core's main loop: runs of instructions between events, interrupts, sleep, faults, reset.

Order of things at one point in time: events of the clock, then a debugger's halt, then the reset that an
event may have asked for, then the entry into an exception, then the next instruction. All of it depends on
virtual time alone, so ``run_until`` may be called with any sequence of times: the core does the same.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable

from emulator.arm.cpu import faults
from emulator.arm.cpu.exceptions import Exceptions
from emulator.arm.cpu.idle_loops import IdleLoops
from emulator.arm.cpu.images import Images
from emulator.arm.cpu.nvic import Nvic
from emulator.arm.cpu.single_step import SingleStep
from emulator.arm.cpu.slice import Slice
from emulator.arm.cpu.special import Special, SpecialInstructions
from emulator.arm.cpu.stop import Stop
from emulator.arm.cpu.waiting import Waiting
from emulator.clock import PS_PER_US, Clock
from emulator.trace import Fault, Trace
from emulator.wiring import CHIP

RESET_PULSE_PS = 20 * PS_PER_US
"""How long a reset from inside the chip lasts at least (RM0368 6.1.1)."""

RESETS_KEPT = 10_000


class Machine:
    """Executes. ``start`` puts core and blocks into the state after reset, for the reason given."""

    def __init__(
        self,
        run: Slice,
        exceptions: Exceptions,
        waiting: Waiting,
        idle: IdleLoops,
        special: SpecialInstructions,
        images: Images,
        trace: Trace,
        start: Callable[[str], None],
    ) -> None:
        self._slice = run
        self._engine = run.engine
        self._timeline = run.timeline
        self._clock: Clock = run.clock
        self._nvic: Nvic = run.nvic
        self._exceptions = exceptions
        self._waiting = waiting
        self._idle = idle
        self._special = special
        self._images = images
        self._trace = trace
        self._start = start
        self._reset_reason = ""
        self._asleep: Stop | None = None
        self._told_lock_up = False
        self._single_step = SingleStep(run.engine)
        self._halting = False
        self.stepping = False
        """Whether only one instruction is being executed."""
        self.resets: deque[tuple[int, str]] = deque(maxlen=RESETS_KEPT)
        """(time in ps, reason) of the latest resets, without power-on."""
        self.on_breakpoint: Callable[[], bool] = lambda: False
        """Called when BKPT is met; True if a debugger has dealt with it, else it is a fault."""

    def request_reset(self, reason: str) -> None:
        """Reset the chip behind the instruction in flight."""
        self._reset_reason = self._reset_reason or reason
        if self._engine.running:
            self._engine.cut()

    @property
    def asleep(self) -> bool:
        """Whether the core waits in WFI, WFE or after SLEEPONEXIT."""
        return self._asleep is not None

    # -- for debuggers ----------------------------------------------------------------------------------

    def halt(self) -> None:
        """Stand still in front of the next instruction; an exception being entered is entered first."""
        self._halting = True
        if self._engine.running:
            self._engine.cut()
        elif not self.halted:
            self.run_until(self._timeline.now_ps() + 1)

    def resume(self, step: bool) -> None:
        """Go on; ``step``: for one instruction, or into the exception that comes instead of it."""
        self._halting, self.stepping = False, step
        self._nvic.alone = not step

    def wake(self) -> None:
        """End WFI, WFE or sleep on exit."""
        self._asleep = None

    def reset_now(self, reason: str) -> None:
        """Reset the halted chip."""
        self._reset_reason = reason
        self._reset()

    @property
    def halted(self) -> bool:
        """Whether the core stands still: ``run_until`` returns at once and no time passes."""
        return self._halting and not self._exceptions.entering

    # -- the loop ---------------------------------------------------------------------------------------

    def run_until(self, at_ps: int) -> None:
        """Run up to and including ``at_ps``."""
        clock, timeline = self._clock, self._timeline
        while True:
            core_ps = timeline.now_ps()
            due_ps = min(core_ps, at_ps)
            if clock.next_ps <= due_ps:
                clock.advance_to(due_ps)
            if core_ps >= at_ps:
                clock.advance_to(at_ps)
                return
            clock.now_ps = max(clock.now_ps, core_ps)
            if self._halting and self.halted:
                return
            if not self._between_instructions(at_ps):
                self._execute(at_ps)

    def fire(self, now_ps: int) -> bool:
        """In a run of an engine that goes on by itself: fire what is due; False if the run has to end."""
        try:
            self._engine.running = False
            self._clock.now_ps = max(self._clock.now_ps, now_ps)
            self._clock.advance_to(now_ps)
            self._slice.end_ps = min(self._clock.next_ps, self._slice.at_ps)
        except BaseException as error:
            self._engine.keep_error(error)
            return False
        finally:
            self._engine.running = True
        return not (self._reset_reason or self._halting or self._images.shown or self._special.to_be_set)

    def _between_instructions(self, at_ps: int) -> bool:
        """Do the next thing that is no instruction; False if there is none."""
        if self._reset_reason:
            self._reset()
        elif self._exceptions.entering:
            self._exceptions.finish_entry()
            self._halting |= self.stepping
        elif self._exceptions.locked_up or self._sleeps_on():
            self._tell_lock_up()
            self._timeline.sleep_until(min(self._clock.next_ps, at_ps))
        else:
            self._nvic.changed = False
            if not self._nvic.pending & self._nvic.enabled:
                return False
            self._slice.end_ps = min(self._clock.next_ps, at_ps)
            return self._exceptions.take_pending()
        return True

    def _execute(self, at_ps: int) -> None:
        held_off = bool(self._nvic.pending & self._nvic.enabled) and self._exceptions.masked()
        self._special.switch(Special.UNMASKS, held_off)
        self._special.between_runs()
        self._images.between_runs()
        instructions = self._slice.plan(at_ps)
        if self.stepping:
            self._run(1)
            self._halting = True
            return
        self._idle.execute(instructions, self._run, self._step)

    def _step(self) -> bool:
        """One instruction; False if something is to be done before the next."""
        ordinary = self._run(1) is Stop.SLICE
        due = self._clock.next_ps <= self._timeline.now_ps()
        ready = self._nvic.pending & self._nvic.enabled
        return ordinary and not (due or ready or self._reset_reason or self._halting)

    def _run(self, instructions: int, past: bool = False) -> Stop:
        try:
            if past:
                stop = self._special.run_past()
            else:
                stop = self._single_step.run() if self.stepping else self._engine.run(instructions)
        finally:
            self._timeline.count += self._engine.executed
            self._waiting.forget()
        if stop is not Stop.SLICE:
            self._stopped(stop)
        return stop

    def _stopped(self, stop: Stop) -> None:
        if stop is Stop.EXCEPTION_RETURN:
            if self._exceptions.leave():
                self._asleep = Stop.WFI
        elif stop is Stop.SVC:
            self._exceptions.supervisor_call()
        elif stop in (Stop.WFI, Stop.WFE):
            self._asleep = stop
        elif stop is Stop.HALT:
            self._halting = True
        elif stop is Stop.PLACE:
            self._at_place()
        elif stop is not Stop.BKPT or not self.on_breakpoint():
            fault = faults.fault_of(stop, self._engine.fault_address)
            assert fault is not None
            self._exceptions.fault(fault)

    # -- sleep and reset --------------------------------------------------------------------------------

    def _sleeps_on(self) -> bool:
        if self._asleep is Stop.WFI:
            awake = self._exceptions.wakes()
        elif self._asleep is Stop.WFE:
            awake = self._nvic.event or self._exceptions.may_preempt()
            self._nvic.event = False
        else:
            return False
        if awake:
            self._asleep = None
        return not awake

    def _at_place(self) -> None:
        """The next instruction is a special one; in an IT block it may have to be left out."""
        if self._single_step.leave_out():
            return
        special = self._special.here()
        if special is Special.FLOATING_POINT:
            self._refuse(Stop.NO_COPROCESSOR)
        elif special is Special.DIVIDES and self._divides_by_zero():
            self._refuse(Stop.DIVIDE_BY_ZERO)
        elif special in (Special.WFE, Special.SEV):
            self._engine.pc += 2
            self._timeline.count += 1
            if special is Special.WFE:
                self._asleep = Stop.WFE
            else:
                self._nvic.event = True
        else:
            self._run(1, past=True)

    def _refuse(self, reason: Stop) -> None:
        fault = faults.fault_of(reason, 0)
        assert fault is not None
        self._timeline.count += 1
        self._exceptions.fault(fault)

    def _divides_by_zero(self) -> bool:
        """SDIV and UDIV have the divisor's register in the lowest bits (A7.7.127)."""
        code = self._engine.memory(self._engine.pc, 4)
        return code is not None and self._engine.register(code[2] & 0xF) == 0

    def _tell_lock_up(self) -> None:
        if self._exceptions.locked_up and not self._told_lock_up:
            self._told_lock_up = True
            self._trace.add(Fault(self._clock.now_ps, "core", f"lock-up: {self._exceptions.locked_up}"))

    def _reset(self) -> None:
        reason, self._reset_reason = self._reset_reason, ""
        self._asleep, self._told_lock_up = None, False
        self.resets.append((self._clock.now_ps, reason))
        self._trace.add(Fault(self._clock.now_ps, CHIP, f"reset by {reason}"))
        self._start(reason)
        self._timeline.sleep_until(self._clock.now_ps + RESET_PULSE_PS)
