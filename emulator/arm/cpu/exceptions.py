"""Exceptions entered and left, by hand: the engine knows none (ARMv7-M ARM B1.5).

An entry has two steps. The frame is saved; then, the cycles of that later, the most urgent pending
exception is taken, which may be one that has arrived meanwhile (late arrival, B1.5.11). A return looks
for a pending exception first and goes straight into it, the frame still on the stack (tail-chaining,
B1.5.12).

Faults and SVC are pending from the instruction that caused them. One that may not preempt what is
running, or has no handler enabled, becomes a HardFault (B1.5.14); a HardFault inside a HardFault or NMI
locks the core up (B1.5.15): it executes nothing any more until something resets the chip.

Not modelled: an entry does not clear the exclusive monitor (A3.4), so that STREX may succeed behind an
interrupt that has left the value alone; stores are never buffered, so no bus fault is imprecise.
"""

from __future__ import annotations

from collections.abc import Callable

from emulator.arm.cpu import faults, scb
from emulator.arm.cpu.engine import Engine
from emulator.arm.cpu.faults import Fault
from emulator.arm.cpu.frames import (
    BASIC_FRAME_BIT,
    HIGHEST_ADDRESS,
    PROCESS_STACK_BIT,
    THREAD_BIT,
    THUMB,
    Frames,
)
from emulator.arm.cpu.nvic import HARD_FAULT, MEM_MANAGE, NMI, SV_CALL, Nvic
from emulator.arm.cpu.registers import MASKS, Registers
from emulator.arm.cpu.scb import Scb
from emulator.arm.cpu.timeline import Timeline

ENTRY_CYCLES, RETURN_CYCLES, CHAIN_CYCLES = 12, 10, 6

_TO_HANDLER, _TO_THREAD, _TO_PROCESS = 1, THREAD_BIT | 1, THREAD_BIT | PROCESS_STACK_BIT | 1
_IPSR = 0x1FF


class Exceptions:
    """All between the runs of instructions. ``locked_up`` says why, once the core is; "" before."""

    def __init__(
        self, engine: Engine, timeline: Timeline, nvic: Nvic, block: Scb, frames: Frames | None = None
    ) -> None:
        self._engine = engine
        self._timeline = timeline
        self._nvic = nvic
        self._scb = block
        self.frames = frames or Frames(engine)
        self._masks = Registers(engine, MASKS)
        self._faultmask = Registers(engine, ("faultmask",))
        self._lr = Registers(engine, ("lr",))
        self.on_fault: Callable[[Fault], None] = lambda _fault: None
        """Called at each fault, registers and stack still being those of the instruction."""
        self.reset()

    def reset(self) -> None:
        """Nothing under way."""
        self.entering = False
        """The frame has been saved, the handler not been chosen."""
        self.locked_up = ""
        self.thread_ps = self._timeline.now_ps()
        """When Thread mode was last returned to."""
        self.frames.lowest = HIGHEST_ADDRESS
        self._exc_return = 0

    def masked(self) -> bool:
        """Whether PRIMASK, BASEPRI or FAULTMASK holds interrupts off."""
        primask, basepri, faultmask, _ = self._masks.read()
        return bool(primask | basepri | faultmask)

    # -- entry ------------------------------------------------------------------------------------------

    def level(self) -> int:
        """The present execution priority."""
        primask, basepri, faultmask, _ = self._masks.read()
        return self._nvic.execution_priority(primask, basepri, faultmask)

    def wakes(self) -> bool:
        """Whether a pending exception ends WFI: as if PRIMASK were 0 (B1.5.19)."""
        number = self._nvic.most_urgent()
        if not number:
            return False
        _, basepri, faultmask, _ = self._masks.read()
        level = self._nvic.execution_priority(0, basepri, faultmask)
        return self._nvic.group(self._nvic.priority[number]) < level

    def take_pending(self) -> bool:
        """Begin to enter the most urgent pending exception, if it may preempt what is running."""
        if not self.may_preempt():
            return False
        self._save()
        return True

    def may_preempt(self) -> bool:
        """Whether an exception is pending that may be entered now."""
        number = self._nvic.most_urgent()
        return bool(number) and self._nvic.group(self._nvic.priority[number]) < self.level()

    def _save(self) -> None:
        align = self._scb.is_set(scb.CCR, scb.STKALIGN)
        self._exc_return, saved = self.frames.push(self._engine.pc, align)
        if not self._exc_return & BASIC_FRAME_BIT:
            self._scb.registers[scb.FPCAR] = self.frames.floating_area
        self._enter_after(ENTRY_CYCLES)
        if not saved:
            self._pend_fault(faults.STACKING)

    def _enter_after(self, cycles: int) -> None:
        self._timeline.spend(cycles)
        self.entering = True

    def finish_entry(self) -> None:
        """Go to the handler of the most urgent exception."""
        self.entering = False
        number = self._nvic.most_urgent()
        self._nvic.activate(number)
        self._nvic.event = True
        vector = self._engine.memory(self._scb.registers[scb.VTOR] + 4 * number, 4)
        if vector is None:
            self._engine.pc = 0
            self.frames.enter(number, self._exc_return, thumb=True)
            self.fault(faults.NO_VECTOR)
            return
        address = int.from_bytes(vector, "little")
        self._engine.pc, self._engine.thumb = address & ~1, bool(address & 1)
        self.frames.enter(number, self._exc_return, self._engine.thumb)

    # -- faults and SVC ---------------------------------------------------------------------------------

    def supervisor_call(self) -> None:
        """SVC was executed; PC is behind it."""
        if self._nvic.group(self._nvic.priority[SV_CALL]) < self.level():
            self._nvic.pend(SV_CALL)
            self._save()
        else:
            self.fault(Fault(HARD_FAULT, hard=faults.FORCED))

    def fault(self, fault: Fault) -> None:
        """An instruction could not be executed; PC is on it."""
        if self._pend_fault(fault):
            self._save()

    def _pend_fault(self, fault: Fault) -> bool:
        """Make it, or the HardFault that it becomes, pending; False if the core locks up instead."""
        pending = self._escalate(fault)
        self.on_fault(fault)
        return pending

    def _escalate(self, fault: Fault) -> bool:
        self._scb.record(fault)
        level = self.level()
        number = fault.exception
        allowed = self._scb.fault_enabled(number) and self._nvic.group(self._nvic.priority[number]) < level
        if not allowed and number != HARD_FAULT:
            number = HARD_FAULT
            self._scb.registers[scb.HFSR] |= faults.FORCED
        if number == HARD_FAULT and level <= self._nvic.priority[HARD_FAULT]:
            self.entering = False
            self.locked_up = f"fault at 0x{self._engine.pc:08X} while a HardFault or NMI is being handled"
            return False
        self._nvic.pend(number)
        return True

    # -- return -----------------------------------------------------------------------------------------

    def leave(self) -> bool:
        """PC has been loaded with an EXC_RETURN value. True if the core sleeps now (SLEEPONEXIT)."""
        exc_return = self._engine.pc | 1
        number = self.frames.handled()
        if not number:
            self.fault(Fault(MEM_MANAGE, faults.IACCVIOL))  # nothing special about it in Thread mode
            return False
        valid = self._valid(exc_return, number)
        self._nvic.deactivate(number)
        self._nvic.event = True
        if number != NMI:
            self._faultmask.write(0)
        if not valid:
            self._lr.write(0xF000_0000 | exc_return & 0x0FFF_FFFF)
            return self._chain_fault(faults.INVALID_RETURN, exc_return)
        if self.may_preempt():
            self._chain(exc_return)
            return False
        return self._restore(exc_return)

    def _valid(self, exc_return: int, number: int) -> bool:
        """The checks of ExceptionReturn (B1.5.8)."""
        if exc_return >> 5 != 0xFFFF_FFFF >> 5 or not self._nvic.active >> number & 1:
            return False
        outermost = self._nvic.active.bit_count() == 1
        kind = exc_return & 0xF
        if kind == _TO_HANDLER:
            return not outermost
        if kind in (_TO_THREAD, _TO_PROCESS):
            return outermost or self._scb.is_set(scb.CCR, scb.NONBASETHRDENA)
        return False

    def _chain(self, exc_return: int) -> None:
        self._exc_return = exc_return
        self._enter_after(CHAIN_CYCLES)

    def _chain_fault(self, fault: Fault, exc_return: int) -> bool:
        if self._pend_fault(fault):
            self._chain(exc_return)
        return False

    def _restore(self, exc_return: int) -> bool:
        restored = self.frames.pop(exc_return)
        if restored is None:
            return self._chain_fault(faults.UNSTACKING, exc_return)
        address, xpsr = restored
        self._timeline.spend(RETURN_CYCLES)
        self._engine.pc, self._engine.thumb = address & ~1, bool(xpsr & THUMB)
        to_thread = exc_return & 0xF != _TO_HANDLER
        if to_thread is bool(xpsr & _IPSR):
            self.fault(faults.INVALID_RETURN)
            return False
        if to_thread:
            self.thread_ps = self._timeline.now_ps()
        return to_thread and self._scb.is_set(scb.SCR, scb.SLEEPONEXIT)
