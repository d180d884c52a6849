"""The Cortex-M4 with its peripherals in C (emulator/chip/native) and in Python."""

from __future__ import annotations

import ctypes
from collections import deque
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from fractions import Fraction
from functools import partial
from typing import Final, NamedTuple

from fcu_emulator.emulator.chip.cpu.core_registers import MASKS, SPSEL, CoreRegisters
from fcu_emulator.emulator.chip.cpu.exceptions import CoreFault
from fcu_emulator.emulator.chip.cpu.python_peripherals import PythonPeripherals
from fcu_emulator.emulator.chip.library import (
    DEEP_WITH_CLOCKS,
    ChipStatus,
    ClocksTable,
    FcuChip,
    NativePeripheral,
)
from fcu_emulator.emulator.chip.memory_map import CHIP_NAME, FLASH, FLASH_SIZE, RAM
from fcu_emulator.emulator.chip.peripherals.peripheral import ClockTree, Peripheral, Soc
from fcu_emulator.emulator.clock import Clock
from fcu_emulator.emulator.trace import Fault as FaultEvent
from fcu_emulator.emulator.trace import Trace

CYCLES_PER_INSTRUCTION: Final = Fraction(13, 10)
"""The default number; cycle_clock.h gives the reasons for it."""
RESETS_KEPT: Final = 10_000
STANDBY: Final = "STANDBY"
"""The reason of the reset that ends Standby."""
_REASONS: Final = ("", "SYSRESETREQ", "PIN", "IWDG", "WWDG", "power-on", STANDBY)
"""The reasons of enum ResetReason in run_loop.h, and the reasons that come from Python."""
_THREAD_PRIORITY = 256
_HALTED, _BY_WORK = 1, 3
"""Two values of enum Ended in run_loop.h."""
_IGNORED_ACCESSES: Final = (
    ("clock", "read"),
    ("clock", "written"),
    ("unknown", "read"),
    ("unknown", "written"),
)
"""In the order of enum IgnoredAccess in chip.h."""


@dataclass(frozen=True)
class CoreSettings:
    """Settings of the core. ``skip`` skips waiting loops, which changes only the speed."""

    cycles_per_instruction: Fraction = CYCLES_PER_INSTRUCTION
    skip: bool = True


class Masks(NamedTuple):
    """Registers that mask exceptions."""

    primask: int
    basepri: int
    faultmask: int


class Core(FcuChip):
    """The core with firmware. Raises ValueError for bytes outside flash and RAM."""

    def __init__(
        self,
        clock: Clock,
        trace: Trace,
        segments: Iterable[tuple[int, bytes]],
        settings: CoreSettings = CoreSettings(),
        system_memory: Iterable[tuple[int, bytes]] = (),
    ) -> None:
        super().__init__(clock, trace)
        self._settings = settings
        self._on_reset: Callable[[str], None] = lambda _reason: None
        self._status = ChipStatus()
        self._masks = CoreRegisters(self, MASKS)
        self.on_fault: Callable[[CoreFault], None] = lambda _fault: None
        """Called at each fault, before registers and stack change."""
        self.store_to_flash: Callable[[int, int, int], bool] = lambda _offset, _size, _value: False
        """Called to execute a store with offset, size and value; returns False if the flash refuses it."""
        self.on_lost_store: Callable[[int], None] = lambda _address: None
        """Called at each refused store to the flash."""
        self.on_deep_sleep: Callable[[], int] = lambda: DEEP_WITH_CLOCKS
        """Called when the core sleeps with SLEEPDEEP; returns the wake-up time of Stop in ps, or enum DeepSleep."""
        self.on_stop_ended: Callable[[], None] = lambda: None
        self._clocks_stopped = False
        self.is_off = False
        """Whether the core has no power, in Standby."""
        self.on_access: Callable[[int, int, bool], None] = lambda _address, _size, _written: None
        """Called at watched accesses with the address, the size, and whether it is a store."""
        self.resets: deque[tuple[int, str]] = deque(maxlen=RESETS_KEPT)
        """(time in ps, reason) of the latest resets, without power-on and the ends of Standby."""
        self.before_reset = b"", b""
        """R0 to R12, SP, LR, PC, xPSR, and the RAM, before the latest reset."""
        self.code_version = 0
        """A number that changes whenever the contents of the flash change."""
        self.stepping = False
        """Whether only one instruction is being executed."""
        self._load(segments)
        for address, data in system_memory:
            self._bytes(address, data)

    def power_on(
        self, soc: Soc, peripherals: Iterable[Peripheral], on_reset: Callable[[str], None] | None = None
    ) -> None:
        """Start the core, and set ``soc.irq``.

        Each later reset first calls ``on_reset(reason)``.
        """
        self._on_reset = on_reset or self._on_reset
        self._python_peripherals = tuple(peripherals)
        self.python = PythonPeripherals(soc, self._python_peripherals)
        self.all_peripherals: tuple[Peripheral, ...] = (*self.peripherals.values(), *self._python_peripherals)
        soc.irq = self
        cycles = self._settings.cycles_per_instruction
        if not 0 < cycles <= 100:
            raise ValueError(f"cycles per instruction must be from 0 to 100, not {cycles}")
        self.set_clocks(soc.clocks)
        self.library.fcu_configure(self.handle, cycles.numerator, cycles.denominator, self._settings.skip)
        soc.clocks.on_change(lambda: self.set_clocks(soc.clocks))
        self.library.fcu_start(self.handle)

    def _load(self, segments: Iterable[tuple[int, bytes]]) -> None:
        for address, data in segments:
            if not (FLASH <= address < FLASH + FLASH_SIZE or address >= RAM):
                raise ValueError(f"{len(data)} bytes at 0x{address:08X} are neither in flash nor in RAM")
            self._bytes(address, data)

    def _bytes(self, address: int, data: bytes) -> None:
        memory = self.memory(address, len(data))
        if memory is None:
            raise ValueError(f"{len(data)} bytes at 0x{address:08X} are neither in flash nor in RAM")
        memory[:] = data

    # -- running ----------------------------------------------------------------------------------------

    def run_until_ps(self, at_ps: int) -> None:
        """Run up to and including ``at_ps``, or until a debugger halts the core or ``work_limit`` is reached."""
        clock, shared = self.clock, self.shared
        self.enter()
        ended = self.library.fcu_run_until(self.handle, at_ps)
        self.raise_error()
        # if a fault occurs while a frame is saved, the clock has advanced to the end of the exception entry,
        # which is later than the chip's time
        clock.now_ps = shared[0]
        if ended not in (_HALTED, _BY_WORK):
            clock.advance_to(at_ps)

    def set_clocks(self, tree: ClockTree) -> None:
        if self._clocks_stopped:
            self.library.fcu_set_clocks(self.handle, ClocksTable())
            self.raise_error()
        else:
            super().set_clocks(tree)

    def stop_clocks(self, stopped: bool, tree: ClockTree) -> None:
        """Stop all clocks of the peripherals in C, or start them again."""
        self._clocks_stopped = stopped
        self.set_clocks(tree)

    def request_reset(self, reason: str) -> None:
        self.library.fcu_request_reset(self.handle, _REASONS.index(reason))

    def code_changed(self) -> None:
        self.code_version += 1
        self.invalidate_code()

    def flash_programmed(self, offset: int, size: int) -> None:
        self.code_version += 1
        self.library.fcu_flash_programmed(self.handle, offset, size)

    # -- snapshots --------------------------------------------------------------------------------------

    def snapshot(self) -> bytes:
        """Return all state in C. Call this only between runs."""
        buffer = ctypes.create_string_buffer(self.library.fcu_snapshot_size())
        self.library.fcu_save(self.handle, buffer)
        return buffer.raw

    def restore(self, saved: bytes) -> None:
        """Restore a :meth:`snapshot`; breakpoints do not change."""
        self.library.fcu_restore(self.handle, saved)

    # -- the present state ------------------------------------------------------------------------------

    def status(self) -> ChipStatus:
        self.library.fcu_status(self.handle, self._status)
        return self._status

    @property
    def now_ps(self) -> int:
        return self.status().now_ps

    @property
    def retired(self) -> int:
        return self.status().retired

    @property
    def skipped(self) -> int:
        """Number of instructions in skipped loops, which were counted but not executed."""
        return self.status().skipped

    @property
    def work(self) -> int:
        return self.shared[5]

    @property
    def work_limit(self) -> int:
        return self.shared[6]

    @work_limit.setter
    def work_limit(self, work: int) -> None:
        self.shared[6] = work

    @property
    def thread_ps(self) -> int:
        return self.status().thread_ps

    @property
    def switched_ps(self) -> int:
        """The time of the latest exception return to a thread other than the interrupted one."""
        return self.status().switched_ps

    @property
    def thread_frame(self) -> int:
        """Address of the latest interrupted thread's frame on the process stack; 0: it used the main stack."""
        return self.status().thread_frame

    @property
    def lowest_stack(self) -> int:
        return self.status().lowest_msp

    @property
    def locked_up(self) -> str:
        """The reason for the lock-up, or ""."""
        status = self.status()
        return _locked_up(status.locked_up_pc) if status.locked_up else ""

    @property
    def asleep(self) -> bool:
        return bool(self.status().asleep)

    @property
    def handled(self) -> int:
        """The number of the current exception (IPSR); 0 in Thread mode."""
        return self.register(16) & 0x1FF

    @property
    def uses_process_stack(self) -> bool:
        """Whether the core is in Thread mode and uses PSP (ARMv7-M ARM B1.4.1)."""
        *_, control = self._masks.read()
        return bool(control & SPSEL) and not self.handled

    @property
    def pending(self) -> int:
        """Pending exceptions. Bit n is exception n."""
        return _mask(self.status().pending)

    @property
    def enabled(self) -> int:
        """Enabled exceptions. Bit n is exception n."""
        return _mask(self.status().enabled)

    @property
    def active(self) -> int:
        """Active exceptions, including preempted exceptions. Bit n is exception n."""
        return _mask(self.status().active)

    def priority(self, exception: int) -> int:
        """Return an exception's priority; a smaller number is more urgent."""
        priority: int = self.library.fcu_priority(self.handle, exception)
        return priority

    def preempts(self, exception: int, masks: Masks) -> bool:
        """Return whether an exception can preempt the active exceptions (ARMv7-M ARM B1.5.4)."""
        library, handle = self.library, self.handle
        group: int = library.fcu_priority_group(handle, self.priority(exception))
        return bool(group < library.fcu_execution_priority(handle, *masks))

    def preempts_thread(self, exception: int, masks: Masks) -> bool:
        """Return whether an exception can preempt Thread mode (ARMv7-M ARM B1.5.4)."""
        group = partial(self.library.fcu_priority_group, self.handle)
        limit: int = group(masks.basepri) if masks.basepri else _THREAD_PRIORITY
        limit = min(limit, 0) if masks.primask else limit
        return bool(group(self.priority(exception)) < (-1 if masks.faultmask else limit))

    # -- for debuggers ----------------------------------------------------------------------------------

    def halt(self) -> None:
        self.enter()
        self.library.fcu_halt(self.handle)
        self.raise_error()
        self.clock.now_ps = max(self.clock.now_ps, self.shared[0])

    def resume(self, step: bool) -> None:
        """Resume execution. If ``step`` is set, halt after one instruction or exception entry."""
        self.stepping = step
        self.library.fcu_resume(self.handle, step)

    @property
    def halted(self) -> bool:
        return bool(self.library.fcu_is_halted(self.handle))

    def wake(self) -> None:
        """End a sleep, but not Standby."""
        self.library.fcu_wake(self.handle)
        self.raise_error()

    def reset_now(self, reason: str) -> None:
        self.library.fcu_reset_now(self.handle, _REASONS.index(reason))
        self.raise_error()

    def debug(self, on: bool) -> None:
        """Select whether BKPT halts the core or causes a fault."""
        self.library.fcu_debug(self.handle, on)

    def halted_on_bkpt(self) -> bool:
        return bool(self.library.fcu_halted_on_bkpt(self.handle))

    def set_breakpoint(self, address: int, on: bool) -> None:
        self.library.fcu_set_breakpoint(self.handle, address, on)

    def watch_memory(self, begin: int, end: int) -> None:
        self.library.fcu_watch_memory(self.handle, True, begin, end)

    def unwatch_memory(self) -> None:
        self.library.fcu_watch_memory(self.handle, False, 0, 0)

    # -- registers of peripherals -----------------------------------------------------------------------------

    def find(self, address: int) -> tuple[Peripheral, int] | None:
        """Return the peripheral at an address, and the register's offset."""
        peripheral: Peripheral | None
        index = self.library.fcu_peripheral_at(self.handle, address)
        peripheral = self.peripheral_by_index(index) if index >= 0 else self.python.find(address)
        return None if peripheral is None else (peripheral, address - peripheral.base & 0xFFFF_FFFC)

    def peek(self, address: int) -> int | None:
        """Return a word without side effects."""
        data = self.memory(address, 4)
        if data is not None:
            return int.from_bytes(data, "little")
        found = self.find(address)
        if found is not None and isinstance(found[0], NativePeripheral):
            return found[0].peek(found[1])
        return self.python.peek(address)

    def poke(self, address: int, data: bytes) -> bool:
        """Write 1, 2 or 4 aligned bytes with all effects. Return False if no register is there."""
        stored = self.library.fcu_store(self.handle, address, len(data), int.from_bytes(data, "little"))
        self.raise_error()
        return bool(stored)

    def set_line(self, number: int, level: bool) -> None:
        self.set_irq(number, level)

    # -- callbacks --------------------------------------------------------------------------------------

    def _read(self, address: int, size: int) -> int:
        value, self.shared[2] = self.python.read(address, size)
        return value

    def _write(self, address: int, size: int, value: int) -> None:
        if address >= RAM:
            self.shared[2] = self.python.write(address, size, value)
        elif not self.store_to_flash(address & FLASH_SIZE - 1, size, value):
            self.on_lost_store(address)

    def _ignored_access(self, peripheral: int, offset: int, what: int, value: int) -> bool:
        kind, done = _IGNORED_ACCESSES[what]
        one = self.peripheral_by_index(peripheral)
        if kind == "unknown":
            self.python.report_unknown(one, offset, done)
        elif done == "read":
            self.python.report_clock(one, offset, done)
        else:
            return self.python.report_write_without_clock(one, offset, value)
        return True

    def _fault(self, exception: int, cfsr: int, hfsr: int, address: int) -> None:
        self.on_fault(CoreFault(exception, cfsr, hfsr, address if cfsr & 1 << 15 else None))

    def _locked_up(self, pc: int) -> None:
        text = f"lock-up: {_locked_up(pc)}"
        self.trace.add(FaultEvent(self.clock.now_ps, "core", text))

    def _reset(self, reason: int) -> None:
        why = _REASONS[reason]
        self._clocks_stopped = self.is_off = False
        if why == STANDBY:
            self.trace.add(FaultEvent(self.clock.now_ps, CHIP_NAME, "woken from Standby"))
        else:
            self.resets.append((self.clock.now_ps, why))
            self.trace.add(FaultEvent(self.clock.now_ps, CHIP_NAME, f"reset by {why}"))
            self.before_reset = self.core_state(), bytes(self.ram)
        self._on_reset(why)
        for native in self.peripherals.values():
            native.reset()
        for peripheral in reversed(
            self._python_peripherals
        ):  # RCC is reset last, so that no peripheral gets new clocks with old settings
            peripheral.reset()

    def _deep_sleep(self) -> int:
        return self.on_deep_sleep()

    def _stop_ended(self) -> None:
        self.on_stop_ended()

    def _accessed(self, address: int, size: int, written: int) -> None:
        self.on_access(address, size, bool(written))


def _mask(words: ctypes.Array[ctypes.c_uint64]) -> int:
    return int(words[0]) | int(words[1]) << 64


def _locked_up(pc: int) -> str:
    return f"fault at 0x{pc:08X} while a HardFault or NMI is being handled"
