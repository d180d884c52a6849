"""Firmware that goes round in a loop which nothing will end.

Decision: a loop that looks at nothing, in ``main()`` itself, while interrupts of blocks are on, is how many
good programs end: all work is done by the handlers. The same without such interrupts may be meant as the end
of the program, and is told without being called a failure. Tasks of an operating system (on the process
stack) are not judged: its idle task is a loop without end.
"""

from __future__ import annotations

from emulator.chip.chip import Chip
from emulator.chip.cpu.exceptions import SYS_TICK
from emulator.chip.cpu.thumb import Flow, decode
from emulator.chip.diagnosis.backtrace import NOTE, Backtrace
from emulator.chip.diagnosis.blocks import BlockNotes
from emulator.chip.diagnosis.interrupts import Interrupts
from emulator.chip.diagnosis.places import Places
from emulator.chip.diagnosis.probe import Loop, Probe
from emulator.chip.diagnosis.report import Cause, Diagnosis, at, section
from emulator.chip.diagnosis.transfers import Transfers
from emulator.chip.diagnosis.vectors import exception_name, handler_name
from emulator.chip.diagnosis.waits import Waits
from emulator.time.clock import PS_PER_MS

_HANDLER_AT_WORK_PS = 200 * PS_PER_MS  # no handler that works takes so long
_WRONG_ENDS = {"Error_Handler", "_Error_Handler", "__assert_func", "assert_failed", "abort", "_exit"}
_SP, _LR = 13, 14
_SPSEL = 1 << 1  # CONTROL: Thread mode uses the process stack


class Hang:
    """The chip as it is now; ``quiet_since_ps``: when something last happened outside of it."""

    def __init__(
        self, chip: Chip, places: Places, transfers: Transfers, notes: BlockNotes, quiet_since_ps: int
    ) -> None:
        self._core = core = chip.core
        self._places = places
        self._transfers = transfers
        self._notes = notes
        self._interrupts = Interrupts(core)
        self._now_ps = core.now_ps
        self._quiet_since_ps = quiet_since_ps
        self._waits = Waits(chip, self._interrupts, places, self._now_ps - quiet_since_ps)
        trace = Backtrace(places, core.peek, core.memory)
        self._pc = core.pc
        registers = core.pc, core.register(_LR), core.register(_SP)
        self._calls, self._callers = trace.calls(*registers), trace.lines(*registers)

    def diagnosis(self) -> Diagnosis | None:
        """The loop that the firmware is caught in; None if it is in none."""
        if self._core.asleep:
            return self._sleeping()
        if not self._core.active:
            return None if self._interrupts.control & _SPSEL else self._in_thread()
        if self._now_ps - self._core.thread_ps >= _HANDLER_AT_WORK_PS:
            return self._in_handler()
        return self._behind_handler()

    # -- where it may be --------------------------------------------------------------------------------

    def _sleeping(self) -> Diagnosis | None:
        if self._interrupts.tick_on or self._interrupts.from_blocks(now=False):
            return None
        why = "WFI or WFE waits for an interrupt, and none is on."
        return self._report(self._pc, Cause("sleeps for ever", [why, self._quiet()]))

    def _in_handler(self) -> Diagnosis | None:
        loop = Probe(self._core).loop()
        cause = self._waits.in_vain(loop) if loop else None
        if loop is None or cause is None:
            return None
        number = self._interrupts.handled
        unhandled = self._unhandled(number)
        if unhandled and not loop.variables:
            cause = unhandled
        elif not loop.variables:
            cause = self._from_outside() or cause
        since = f"main() has not run since {at(self._core.thread_ps)}"
        cause.sentences.append(f"{since}, because the handler of {exception_name(number)} does not return.")
        return self._report(self._outermost(loop), cause)

    def _in_thread(self) -> Diagnosis | None:
        loop = Probe(self._core).loop()
        cause = self._waits.in_vain(loop) if loop else None
        if loop is None or cause is None:
            return None
        if loop.variables or loop.registers:
            if loop.registers:
                cause = self._notes.cause() or cause
            cause.sentences.append(self._quiet())
            return self._report(self._outermost(loop), cause)
        return self._endless(self._outermost(loop), cause)

    def _behind_handler(self) -> Diagnosis | None:
        """An interrupt is being handled as it should; what did it interrupt?"""
        below = [call.address for call in self._calls if call.interrupted]
        code = self._core.memory(below[-1], 4) if below else None
        if code is None:
            return None
        one = decode(below[-1], code[0] | code[1] << 8, code[2] | code[3] << 8)
        if one.flow is not Flow.JUMP or one.target != below[-1]:
            return None
        self._callers = self._callers[[call.interrupted for call in self._calls[1:]].index(True) + 1 :]
        return self._endless(below[-1], Cause("an endless loop", []))

    # -- loops that look at nothing ---------------------------------------------------------------------

    def _endless(self, place: int, cause: Cause) -> Diagnosis | None:
        name = self._places.function_name(place)
        working = bool(self._interrupts.from_blocks(now=False)) or self._tick_works()
        if name == "Reset_Handler":
            return self._report(place, Cause("main() has returned", ["There is nothing to return to."]))
        if working and name in ("", "main"):
            return None
        why = self._from_outside() or cause
        if name in _WRONG_ENDS:
            why.sentences.append(
                f"{name}() is where a program goes when a call has failed: see who has called it."
            )
        if not working:
            why.sentences.append(self._quiet())
        if why is cause and name == "main":
            cause.sentences.append("If the program is meant to end there, all is well.")
            return self._report(place, cause, fatal=False)
        return self._report(place, why, fatal=not working or name in _WRONG_ENDS)

    def _tick_works(self) -> bool:
        """Whether SysTick's handler does more than count one variable."""
        if not self._interrupts.tick_on:
            return False
        changed = Probe(self._core).handle(SYS_TICK)
        return changed is None or len({address & ~3 for address in changed}) > 1

    def _from_outside(self) -> Cause | None:
        """Why a program may have gone into its own ``while (1)``."""
        return self._notes.cause() or self._transfers.cause()

    def _unhandled(self, number: int) -> Cause | None:
        """Whether an interrupt has only the start-up file's common handler."""
        if self._places.function_name(self._pc) not in ("Default_Handler", "Infinite_Loop"):
            return None
        name = exception_name(number)
        return Cause(
            f"the interrupt {name} is on and has no handler",
            [f"Write a function with exactly this name: void {handler_name(number)}(void)."],
        )

    # -- the text ---------------------------------------------------------------------------------------

    def _quiet(self) -> str:
        return (
            f"The buses, the terminal and the pins have been quiet since {at(self._quiet_since_ps)}; "
            f"it is {at(self._now_ps)} now."
        )

    def _outermost(self, loop: Loop) -> int:
        """Of the functions that the loop goes through the one that the others are called from."""
        inside = [call.address for call in self._calls if {call.address, call.address - 2} & loop.code]
        return inside[-1] if inside else self._pc

    def _report(self, place: int, cause: Cause, *, fatal: bool = True) -> Diagnosis:
        where = self._places.place(place)
        callers = [line for line in self._callers if not line.endswith(where)]
        caller = f", {callers[0]}" if callers and not where.startswith("main(") else ""
        details = [
            *cause.sentences,
            *section("not allowed", self._notes.lines()),
            *section(f"callers ({NOTE})", callers),
            *section("last transfers", self._transfers.lines()),
            *self._places.help(),
        ]
        return Diagnosis("stuck", f"stuck in {where}{caller}: {cause.short}", tuple(details), fatal)
