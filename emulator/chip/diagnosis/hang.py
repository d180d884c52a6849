"""Detection of endless loops, and of the reason why a loop's condition never becomes true.

Decision: a loop in ``main()`` that reads nothing counts as correct if interrupts of peripherals are
enabled. If no such interrupt is enabled, the loop is reported but is not a failure: the loop may be
the intended end.

Decision: a thread on the process stack is stuck only if no other thread can run: no exception can
preempt it, or none has switched threads for ``_PATIENCE_PS``. A thread that reads nothing is an idle
thread as long as an interrupt can wake other threads.
"""

from __future__ import annotations

from collections.abc import Iterable
from itertools import takewhile
from typing import Final

from fcu_emulator.emulator.chip.chip import Chip
from fcu_emulator.emulator.chip.cpu.core import Core, Masks
from fcu_emulator.emulator.chip.cpu.core_registers import MASKS, CoreRegisters
from fcu_emulator.emulator.chip.cpu.exceptions import FIRST_INTERRUPT, SYS_TICK, bits
from fcu_emulator.emulator.chip.cpu.thumb import Flow, decode
from fcu_emulator.emulator.chip.diagnosis.backtrace import NOTE, Backtrace, Call, Places
from fcu_emulator.emulator.chip.diagnosis.evidence import PeripheralNotes, RecentTransfers, why_no_byte
from fcu_emulator.emulator.chip.diagnosis.probe import Loop, Probe
from fcu_emulator.emulator.chip.diagnosis.read_once import read_once
from fcu_emulator.emulator.chip.diagnosis.report import Cause, Diagnosis, at, section
from fcu_emulator.emulator.chip.low_power import LowPower
from fcu_emulator.emulator.chip.peripherals.dma import is_any_stream_on
from fcu_emulator.emulator.chip.peripherals.peripheral import Peripheral
from fcu_emulator.emulator.chip.peripherals.spi import Spi
from fcu_emulator.emulator.chip.registers import address_of, systick
from fcu_emulator.emulator.clock import NEVER_PS, PS_PER_MS, PS_PER_S

# -- names of exceptions (ARMv7-M ARM table B1-4; RM0368 table 38) ------------------------------------------

_EXCEPTION_NAMES: Final = {
    2: "NMI",
    3: "HardFault",
    4: "MemManage",
    5: "BusFault",
    6: "UsageFault",
    11: "SVC",
    12: "DebugMon",
    14: "PendSV",
    15: "SysTick",
}


def _numbered(first: int, *names: str) -> dict[int, str]:
    return dict(enumerate(names, first))


_INTERRUPT_NAMES: Final = {
    **_numbered(0, "WWDG", "PVD", "TAMP_STAMP", "RTC_WKUP", "FLASH", "RCC"),
    **_numbered(6, "EXTI0", "EXTI1", "EXTI2", "EXTI3", "EXTI4"),
    **_numbered(11, *(f"DMA1_Stream{stream}" for stream in range(7)), "ADC"),
    **_numbered(23, "EXTI9_5", "TIM1_BRK_TIM9", "TIM1_UP_TIM10", "TIM1_TRG_COM_TIM11", "TIM1_CC"),
    **_numbered(28, "TIM2", "TIM3", "TIM4", "I2C1_EV", "I2C1_ER", "I2C2_EV", "I2C2_ER"),
    **_numbered(35, "SPI1", "SPI2", "USART1", "USART2"),
    **_numbered(40, "EXTI15_10", "RTC_Alarm", "OTG_FS_WKUP"),
    **_numbered(47, "DMA1_Stream7"),
    **_numbered(49, "SDIO", "TIM5", "SPI3"),
    **_numbered(56, *(f"DMA2_Stream{stream}" for stream in range(5))),
    **_numbered(67, "OTG_FS", *(f"DMA2_Stream{stream}" for stream in range(5, 8))),
    **_numbered(71, "USART6", "I2C3_EV", "I2C3_ER"),
    **_numbered(81, "FPU"),
    **_numbered(84, "SPI4"),
}


def exception_name(number: int) -> str:
    """Return ``SysTick``, ``TIM3``, or the number."""
    interrupt = number - FIRST_INTERRUPT
    return _EXCEPTION_NAMES.get(number) or _INTERRUPT_NAMES.get(interrupt) or f"interrupt {interrupt}"


def handler_name(number: int) -> str:
    """Return the handler's name in ST's start-up files."""
    return f"{exception_name(number)}_{'Handler' if number < FIRST_INTERRUPT else 'IRQHandler'}"


# -- interrupts, and a missing tick (ARMv7-M ARM B1.5.4, B3.3) ----------------------------------------------

_SYST_CSR = address_of("SysTick", systick.SYST_CSR)
_TICKING = systick.SYST_CSR.ENABLE.mask | systick.SYST_CSR.TICKINT.mask


class Interrupts:
    """Interrupts that can be taken now or, if a loop's ``masks`` are given, at some instruction of the loop.

    ``in_thread``: judge as if the active handlers had returned.
    """

    def __init__(self, core: Core, masks: Iterable[Masks] = (), *, in_thread: bool = False) -> None:
        self._core = core
        self._in_thread = in_thread
        *present, _ = CoreRegisters(core, MASKS).read()
        self._masks = list(masks) or [Masks(*present)]

    @property
    def handled(self) -> int:
        return 0 if self._in_thread else self._core.handled

    def preempts(self, number: int) -> bool:
        preempts = self._core.preempts_thread if self._in_thread else self._core.preempts
        return any(preempts(number, masks) for masks in self._masks)

    def from_peripherals(self, *, now: bool = True) -> list[int]:
        """Return the enabled interrupts of peripherals; if ``now`` is set, only interrupts that can be taken."""
        enabled = self._core.enabled >> FIRST_INTERRUPT << FIRST_INTERRUPT
        return [number for number in bits(enabled) if not now or self.preempts(number)]

    @property
    def tick_on(self) -> bool:
        return (self._core.peek(_SYST_CSR) or 0) & _TICKING == _TICKING

    def why_no_tick(self) -> str:
        """Return why SysTick's handler cannot run; "" if it can."""
        if not self.tick_on:
            return "SysTick is off, because HAL_Init() was not called, or HAL_SuspendTick() was called."
        if self.preempts(SYS_TICK):
            return ""
        if all(masks.primask or masks.faultmask for masks in self._masks):
            return "interrupts are off, because __disable_irq() was called without __enable_irq()."
        priority = self._core.priority
        if not self.handled:
            basepri = max(masks.basepri for masks in self._masks)
            return f"BASEPRI is 0x{basepri:02X}, and SysTick's priority is {priority(SYS_TICK) >> 4}."
        running = self.handled
        return (
            f"SysTick (priority {priority(SYS_TICK) >> 4}) cannot interrupt the handler of "
            f"{exception_name(running)} (priority {priority(running) >> 4}): give SysTick a smaller priority number, "
            "or do not wait in interrupts."
        )


# -- the condition of a loop --------------------------------------------------------------------------------

_PATIENCE_PS = 3 * PS_PER_S  # the 32 kHz crystal takes 2 s to start


class Waits:
    """Finds loops whose condition never becomes true. ``quiet_ps`` is the time since the last external event."""

    def __init__(self, chip: Chip, places: Places, quiet_ps: int) -> None:
        self._chip = chip
        self._places = places
        self._quiet_ps = quiet_ps

    def in_vain(self, loop: Loop, *, in_thread: bool = False) -> Cause | None:
        """Return why the loop never ends. ``in_thread``: the loop continues when the active handlers have returned."""
        interrupts = Interrupts(self._chip.core, loop.masks, in_thread=in_thread)
        if loop.in_thread and self._may_switch(interrupts):
            return None
        if any(self._may_change(peripheral, interrupts) for peripheral, _, _ in loop.registers):
            return None
        if not loop.variables:
            return self._registers(loop) if loop.registers else Cause("an endless loop", [])
        if interrupts.from_peripherals() or is_any_stream_on(self._chip.core):
            return None
        return self._variables(loop, interrupts.why_no_tick())

    def _may_switch(self, interrupts: Interrupts) -> bool:
        """Return whether another thread may run soon."""
        core = self._chip.core
        preempted = bool(interrupts.from_peripherals()) or not interrupts.why_no_tick()
        return preempted and core.now_ps - core.switched_ps < _PATIENCE_PS

    def _may_change(self, peripheral: Peripheral, interrupts: Interrupts) -> bool:
        if not peripheral.clocked:
            return False
        if peripheral.next_change_ps() < NEVER_PS:
            return True
        since_ps = peripheral.quiet_since_ps()
        if since_ps is None:
            return self._quiet_ps < _PATIENCE_PS
        return self._chip.core.now_ps - since_ps < _PATIENCE_PS and self._others_act(interrupts)

    def _others_act(self, interrupts: Interrupts) -> bool:
        """Return whether DMA or a handler may access a peripheral."""
        if interrupts.from_peripherals() or is_any_stream_on(self._chip.core):
            return True
        return not interrupts.why_no_tick() and Probe(self._chip.core).handle(SYS_TICK) is None

    def _registers(self, loop: Loop) -> Cause:
        seen = sorted(
            f"{peripheral.name}_{peripheral.NAMES.get(offset, hex(offset))} (0x{value:08X})"
            for peripheral, offset, value in loop.registers
        )
        off = next((peripheral.name for peripheral, _, _ in loop.registers if not peripheral.clocked), "")
        masters = [peripheral for peripheral, _, _ in loop.registers if isinstance(peripheral, Spi)]
        why = f"{off} has no clock and reads as 0." if off else next(map(why_no_byte, masters), "")
        why = why or "No scheduled event can change it."
        return Cause(f"waits forever for {' and '.join(seen)} to change", [why])

    def _variables(self, loop: Loop, why: str) -> Cause | None:
        names = sorted({self._places.variable(address) for address in loop.variables})
        short = f"waits forever for {' or '.join(names)} to change"
        changed = Probe(self._chip.core).handle(SYS_TICK)
        counted = changed is None or any(
            at in changed for address in loop.variables for at in range(address, address + 4)
        )
        if counted and not why:
            return None  # SysTick's handler may end the loop
        if counted and changed is not None:
            return Cause(short, [f"SysTick's handler counts {' or '.join(names)}, but cannot run: {why}"])
        if why:
            return Cause(short, [f"Nothing can change {' or '.join(names)}: {why}"])
        return Cause(
            short,
            [f"No enabled interrupt writes {' or '.join(names)}; enable and start an interrupt that does."],
        )


# -- the loop -----------------------------------------------------------------------------------------------

_HANDLER_AT_WORK_PS = 200 * PS_PER_MS  # longer than any correct handler runs
_WRONG_ENDS = {"Error_Handler", "_Error_Handler", "__assert_func", "assert_failed", "abort", "_exit"}
_SP, _LR = 13, 14
_FRAME_BYTES, _FRAME_LR, _FRAME_PC = 0x20, 0x14, 0x18


class Hang:
    """Finds the loop in which the chip is stuck. ``bus``: a problem of the sensors' bus, if known."""

    def __init__(
        self,
        chip: Chip,
        places: Places,
        transfers: RecentTransfers,
        notes: PeripheralNotes,
        quiet_since_ps: int,
        bus: Cause | None = None,
    ) -> None:
        self._bus = bus
        self._low_power = chip.low_power
        self._core = core = chip.core
        self._places = places
        self._transfers = transfers
        self._notes = notes
        self._interrupts = Interrupts(core)
        self._now_ps = core.now_ps
        self._quiet_since_ps = quiet_since_ps
        self._waits = Waits(chip, places, self._now_ps - quiet_since_ps)
        self._trace = Backtrace(places, core.peek, core.memory)
        self._pc = core.pc
        self._calls = self._trace.calls(core.pc, core.register(_LR), core.register(_SP))
        if core.uses_process_stack:
            self._calls = self._own_calls(core.pc, core.register(_LR), core.register(_SP))
        self._callers = self._calls[1:]

    def diagnosis(self) -> Diagnosis | None:
        if self._core.asleep:
            return self._sleeping()
        if not self._core.active:
            return self._in_thread()
        if self._now_ps - self._core.thread_ps >= _HANDLER_AT_WORK_PS:
            return self._in_handler()
        known = None if self._core.thread_frame else self._interrupted_thread()
        return known or self._below_handler()

    def _own_calls(self, pc: int, lr: int, sp: int) -> list[Call]:
        """Return the calls of a thread on the process stack, without frames of other threads."""
        return list(takewhile(lambda call: not call.interrupted, self._trace.calls(pc, lr, sp)))

    # -- the place of the loop --------------------------------------------------------------------------

    def _sleeping(self) -> Diagnosis | None:
        low_power = self._low_power
        if low_power.in_stop or low_power.in_standby:
            return self._sleeping_deeply(low_power)
        if self._interrupts.tick_on or self._interrupts.from_peripherals(now=False):
            return None
        why = "WFI or WFE waits for an interrupt, but none is enabled."
        return self._report(self._pc, Cause("sleeps forever", [why, self._quiet()]))

    def _sleeping_deeply(self, low_power: LowPower) -> Diagnosis | None:
        if low_power.can_wake():
            return None
        if low_power.in_standby:
            why = "The WKUP pin, and the alarms and the wake-up timer of the RTC are off."
            cause = Cause("stays in Standby until a reset", [why, self._quiet()])
            return Diagnosis("stuck", cause.short, tuple(cause.sentences), fatal=False)
        why = "No EXTI line is enabled. Only EXTI wakes the chip from Stop: SysTick and the timers have no clock."
        return self._report(self._pc, Cause("stays in Stop forever", [why, self._quiet()]))

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
        return self._waiting(loop) if loop else None

    def _waiting(self, loop: Loop) -> Diagnosis | None:
        cause = self._waits.in_vain(loop, in_thread=True)
        if cause is None:
            return None
        if loop.variables or loop.registers:
            cause = self._notes.cause({peripheral.name for peripheral, _, _ in loop.registers}) or cause
            cause.sentences.append(self._quiet())
            return self._report(self._outermost(loop), cause)
        return self._read_once(loop) or self._endless(self._outermost(loop), cause, loop.in_thread)

    def _below_handler(self) -> Diagnosis | None:
        """Check the thread that a handler has interrupted, as if the handler had returned."""
        core, probe = self._core, Probe(self._core)
        touched = probe.leave_handler() if core.active.bit_count() == 1 else None
        if touched is None:
            return None
        loop = probe.loop()
        if loop is None or any(peripheral in touched for peripheral, _, _ in loop.registers):
            return None
        frame = core.thread_frame
        if frame:
            pc, lr = core.peek(frame + _FRAME_PC) or 0, core.peek(frame + _FRAME_LR) or 0
            self._calls = self._own_calls(pc, lr, frame + _FRAME_BYTES)
        else:
            self._calls = self._calls[
                [call.interrupted for call in (*self._calls, Call(0, True))].index(True) :
            ]
        if not self._calls:
            return None
        self._pc = self._calls[0].address
        self._callers = self._calls[1:]
        return self._waiting(loop)

    def _interrupted_thread(self) -> Diagnosis | None:
        below = [call.address for call in self._calls if call.interrupted]
        code = self._core.memory(below[-1], 4) if below else None
        if code is None:
            return None
        once = self._read_once_below(below[-1])
        if once is not None:
            return once
        one = decode(below[-1], code[0] | code[1] << 8, code[2] | code[3] << 8)
        if one.flow is not Flow.JUMP or one.target != below[-1]:
            return None
        self._callers = self._callers[[call.interrupted for call in self._callers].index(True) + 1 :]
        return self._endless(below[-1], Cause("an endless loop", []))

    def _read_once(self, loop: Loop) -> Diagnosis | None:
        once = read_once(self._core, self._places, loop.code)
        return once and self._report(self._outermost(loop), once)

    def _read_once_below(self, address: int) -> Diagnosis | None:
        core = self._core
        words = range(core.register(_SP) & ~3, self._places.stack_top - _FRAME_BYTES + 1, 4)
        frames = [at for at in words if core.peek(at + _FRAME_PC) == address]
        if not frames:
            return None
        probe = Probe(core)
        probe.resume(frames[-1])
        loop = probe.loop()
        if loop is None or loop.variables or loop.registers:
            return None
        once = read_once(core, self._places, loop.code)
        return once and self._report(address, once)

    # -- loops that read nothing ------------------------------------------------------------------------

    def _endless(self, place: int, cause: Cause, in_thread: bool = False) -> Diagnosis | None:
        name = self._places.function_name(place)
        working = bool(self._interrupts.from_peripherals(now=False)) or self._tick_works()
        if in_thread and name not in _WRONG_ENDS and (working or is_any_stream_on(self._core)):
            return None
        if name == "Reset_Handler":
            return self._report(
                place, Cause("main() has returned", ["A program for the chip must not return from main()."])
            )
        if working and name in ("", "main"):
            return None
        why = self._from_outside() or cause
        if name in _WRONG_ENDS:
            why.sentences.append(f"{name}() is called after a failure: find its caller.")
        if not working:
            why.sentences.append(self._quiet())
        if why is cause and name == "main":
            cause.sentences.append("The loop is correct if the program is meant to end there.")
            return self._report(place, cause, fatal=False)
        return self._report(place, why, fatal=not working or name in _WRONG_ENDS)

    def _tick_works(self) -> bool:
        if not self._interrupts.tick_on:
            return False
        changed = Probe(self._core).handle(SYS_TICK)
        return changed is None or len({address & ~3 for address in changed}) > 1

    def _from_outside(self) -> Cause | None:
        transfers = self._transfers
        return transfers.failure() or self._notes.cause() or self._bus or transfers.cause()

    def _unhandled(self, number: int) -> Cause | None:
        if self._places.function_name(self._pc) not in ("Default_Handler", "Infinite_Loop"):
            return None
        name = exception_name(number)
        return Cause(
            f"the interrupt {name} is enabled and has no handler",
            [f"Write a function with exactly this name: void {handler_name(number)}(void)."],
        )

    # -- the text ---------------------------------------------------------------------------------------

    def _quiet(self) -> str:
        return (
            f"The buses, the terminal and the pins have been quiet since {at(self._quiet_since_ps)}; "
            f"the time is now {at(self._now_ps)}."
        )

    def _outermost(self, loop: Loop) -> int:
        """Return the loop's outermost call; without a call, the instruction with the highest address.

        This address does not depend on the instruction at which the run ended.
        """
        calls = [call.address for call in self._calls if call.address != self._pc]
        inside = [address for address in calls if {address, address - 2} & loop.code]
        return inside[-1] if inside else max(loop.code, default=self._pc)

    def _report(self, place: int, cause: Cause, *, fatal: bool = True) -> Diagnosis:
        where = self._places.place(place)
        lines = [self._trace.line(call) for call in self._callers]
        callers = [line for line in lines if not line.endswith(where)]
        caller = f", {callers[0]}" if callers and not where.startswith("main(") else ""
        details = [
            *cause.sentences,
            *section("not allowed", self._notes.lines()),
            *section(f"callers ({NOTE})", callers),
            *section("last transfers", self._transfers.lines()),
            *self._places.help(),
        ]
        return Diagnosis("stuck", f"stuck in {where}{caller}: {cause.short}", tuple(details), fatal)
