"""The chip as a debugger's target.

Decision: to resume from a breakpoint, the core first makes a single step, in a separate run.
Therefore a waiting loop with a breakpoint is never skipped.

Decision: with a debugger, BKPT halts the core (ARMv7-M ARM C1.4.1). When the debugger resumes it, the core
continues at the instruction after BKPT.

Decision: one address range covers all watchpoints, including watchpoints on registers; each load
and store in this range is checked. Accesses by DMA and to exception frames are not detected.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import ClassVar

from fcu_emulator.emulator.chip import memory_map
from fcu_emulator.emulator.chip.cpu.core import Core
from fcu_emulator.emulator.chip.cpu.core_registers import EVERYTHING, CoreRegisters
from fcu_emulator.emulator.chip.gdb.reverse import Reverse
from fcu_emulator.emulator.chip.gdb.target import HaltReason, Point, PointKind
from fcu_emulator.emulator.chip.history import History
from fcu_emulator.emulator.chip.memory_map import FLASH, FLASH_SIZE, RAM, RAM_SIZE
from fcu_emulator.emulator.clock import Clock

# -- breakpoints and watchpoints ----------------------------------------------------------------------------

_ALIASES = (
    (RAM, RAM_SIZE, memory_map.RAM_BITS),
    (memory_map.PERIPHERALS, memory_map.PERIPHERALS_SIZE, memory_map.PERIPHERAL_BITS),
)
_WATCHED = {
    PointKind.WRITE: (True,),
    PointKind.READ: (False,),
    PointKind.ACCESS: (False, True),
}
_Range = tuple[Point, int, int, int]
"""A watchpoint, its first address, the address after its last byte, and its contents."""


class Points:
    """Breakpoints and watchpoints, which are set in the core when it resumes.

    ``accessed(point, address)`` is called during watched accesses.
    """

    in_snapshots: ClassVar[bool] = False

    def __init__(self, core: Core, accessed: Callable[[Point, int], None]) -> None:
        self._core = core
        self._accessed = accessed
        self._wanted: set[Point] = set()
        self._set: frozenset[Point] = frozenset()
        self._ranges: list[_Range] = []
        core.on_access = self._on_access

    def add(self, point: Point) -> None:
        self._wanted.add(point)

    def remove(self, point: Point) -> None:
        self._wanted.discard(point)

    def clear(self) -> None:
        self._wanted.clear()
        self.set()

    def set(self) -> None:
        self._set_in_core(frozenset(self._wanted))

    def lift(self) -> None:
        """Remove all points from the core until the next :meth:`set`."""
        self._set_in_core(frozenset())

    def _set_in_core(self, points: frozenset[Point]) -> None:
        if self._set == points:
            return
        breaks = {point.address for point in points if point.kind.is_break}
        for address in {point.address for point in self._set if point.kind.is_break} ^ breaks:
            self._core.set_breakpoint(address, address in breaks)
        self._set = points
        self._ranges = [one for point in points if not point.kind.is_break for one in _watched_ranges(point)]
        if self._ranges:
            begin = min(begin for _, begin, _, _ in self._ranges)
            self._core.watch_memory(begin, max(end for _, _, end, _ in self._ranges) - 1)
        else:
            self._core.unwatch_memory()

    def breakpoint_at(self, address: int) -> Point | None:
        found = (Point(kind, address, 2) for kind in (PointKind.SOFTWARE_BREAK, PointKind.HARDWARE_BREAK))
        return next((point for point in found if point in self._wanted), None)

    def _on_access(self, address: int, size: int, written: bool) -> None:
        for point, begin, end, scale in self._ranges:
            if begin < address + size and address < end and written in _WATCHED[point.kind]:
                self._accessed(point, point.address + max(address - begin, 0) // scale)


def _watched_ranges(point: Point) -> Iterator[_Range]:
    yield point, point.address, point.address + point.size, 1
    for base, size, alias in _ALIASES:
        if base <= point.address < base + size:
            begin = alias + 32 * (point.address - base)
            yield point, begin, begin + 32 * point.size, 32


# -- the target ---------------------------------------------------------------------------------------------

_THUMB = 1 << 24
_EXCEPTION = 0x1FF  # field of xPSR; a debugger cannot change the active exception
_ALIGNMENTS = (4, 2, 1)


class CoreTarget:
    """Implements :class:`fcu_emulator.emulator.chip.gdb.target.Target`.

    ``run(at_ps)``: run the board. ``record()``: begin a history, while a debugger is attached.
    """

    in_snapshots: ClassVar[bool] = False

    def __init__(
        self,
        core: Core,
        clock: Clock,
        run: Callable[[int], None],
        record: Callable[[], History] | None = None,
    ) -> None:
        self._core = core
        self._clock = clock
        self._run = run
        self._record = record
        self._history: History | None = None
        self._reverse: Reverse | None = None
        self._points = Points(core, self._accessed)
        self._everything = CoreRegisters(core, EVERYTHING)
        self._single_step = False  # the debugger has requested one instruction
        self._hit: HaltReason | None = None
        self._on_bkpt = False
        self._lock_up_reported = False
        self._new_code = False

    # -- attaching and releasing ------------------------------------------------------------------------

    def attach(self) -> None:
        self._core.debug(True)
        self.halt()
        if self._record is not None:
            self._history = history = self._record()
            self._reverse = Reverse(
                self._core,
                self._clock,
                history,
                self._resume_until,
                self._points,
            )

    def release(self) -> None:
        if self._history is not None:
            self._history.close()
        self._history = self._reverse = None
        self._core.debug(False)
        self._points.clear()
        self.resume()

    def halt(self) -> None:
        self._core.halt()
        self._single_step = False

    def reset(self) -> None:
        """Reset through NRST and halt."""
        self._core.reset_now("PIN")
        self._on_bkpt = self._lock_up_reported = False
        self._changed()

    # -- registers --------------------------------------------------------------------------------------

    def read_registers(self) -> dict[str, int]:
        values = dict(zip(self._everything.names, self._everything.read(), strict=True))
        xpsr = values["xpsr"] & ~_THUMB | (_THUMB if self._core.thumb else 0)
        return values | {"xpsr": xpsr, "pc": self._core.pc}

    def write_register(self, name: str, value: int) -> None:
        """Change a register; a new PC wakes the core (B1.5.19)."""
        self._write_register(name, value)
        self._changed()

    def _write_register(self, name: str, value: int) -> None:
        if name == "pc":
            self._core.pc = value & ~1
            self._on_bkpt = False
            self._core.wake()
            return
        register = CoreRegisters(self._core, (name,))
        if name == "xpsr":
            self._core.thumb = bool(value & _THUMB)
            value = value & ~_EXCEPTION | register.read()[0] & _EXCEPTION
        register.write(value)

    # -- memory -----------------------------------------------------------------------------------------

    def read_memory(self, address: int, size: int) -> bytes:
        memory = self._core.memory(address, size)
        if memory is not None:
            return bytes(memory)
        self._core.settle()
        data = bytearray()
        while len(data) < size:
            at = address + len(data)
            word = self._core.peek(at & ~3)
            if word is None:
                break
            data += word.to_bytes(4, "little")[at & 3 :]
        return bytes(data[:size])

    def write_memory(self, address: int, data: bytes) -> bool:
        is_written = self._write_memory(address, data)
        if is_written:
            self._changed()
        return is_written

    def _write_memory(self, address: int, data: bytes) -> bool:
        memory = self._core.memory(address, len(data))
        if memory is not None:
            if not _changeable(address):
                return False
            memory[:] = data
            self._core.invalidate_code()
            self._new_code |= not RAM <= address < RAM + RAM_SIZE
            return True
        return self._write_registers(address, data)

    def _write_registers(self, address: int, data: bytes) -> bool:
        core = self._core
        if any(core.peek(place & ~3) is None for place in range(address, address + len(data))):
            return False
        at = 0
        while at < len(data):
            size = next(size for size in _ALIGNMENTS if not (address + at) % size and at + size <= len(data))
            core.poke(address + at, data[at : at + size])
            at += size
        return True

    # -- running ----------------------------------------------------------------------------------------

    def add(self, point: Point) -> None:
        self._points.add(point)

    def remove(self, point: Point) -> None:
        self._points.remove(point)

    def resume(self) -> None:
        self._go(one=False)

    def step(self) -> None:
        self._go(one=True)

    def run_until_ps(self, at_ps: int) -> HaltReason | None:
        run = self._history.run_until_ps if self._history is not None else self._run
        while True:
            run(at_ps)
            if self._core.locked_up and not self._lock_up_reported:
                self._lock_up_reported = True
                self.halt()
                return HaltReason(failure=f"lock-up: {self._core.locked_up}")
            if not self._core.halted:
                return None
            stop = self._reason()
            if stop is not None:
                self._single_step = False
                return stop
            self._continue()

    def _resume_until(self, at_ps: int) -> HaltReason | None:
        self.resume()
        return self.run_until_ps(at_ps)

    def _changed(self) -> None:
        """Add a change by the debugger to the history."""
        if self._history is not None:
            self._history.add_input()

    def take_remark(self) -> str:
        return self._history.take_remark() if self._history is not None else ""

    # -- running backwards ------------------------------------------------------------------------------

    @property
    def can_reverse(self) -> bool:
        return self._reverse is not None

    def reverse_step(self) -> bool:
        if self._reverse is None:
            return False
        has_stepped = self._reverse.step()
        self._returned()
        return has_stepped

    def reverse_continue(self, is_interrupted: Callable[[], bool]) -> HaltReason | None:
        if self._reverse is None:
            return None
        found = self._reverse.search(is_interrupted)
        self._returned()
        return found

    def _returned(self) -> None:
        self._core.halt()
        self._single_step = self._on_bkpt = self._lock_up_reported = False
        self._hit = None

    # -- running forwards -------------------------------------------------------------------------------

    def _go(self, one: bool) -> None:
        if self._new_code:
            self._core.code_changed()
            self._new_code = False
        if self._on_bkpt:
            self._on_bkpt = False
            self._core.pc += 2
        self._single_step = one
        self._points.set()
        self._continue()

    def _continue(self) -> None:
        pc = self._core.pc
        on_point = self._points.breakpoint_at(pc) is not None
        self._core.resume(self._single_step or on_point)

    def _reason(self) -> HaltReason | None:
        """Return why the core halted; None if it has only stepped past a breakpoint."""
        hit, self._hit = self._hit, None
        self._on_bkpt |= self._core.halted_on_bkpt()
        if hit is not None:
            return hit
        point = self._points.breakpoint_at(self._core.pc)
        if point is not None:
            return HaltReason(point, point.address)
        return HaltReason() if self._on_bkpt or self._single_step else None

    def _accessed(self, point: Point, address: int) -> None:
        self._hit = self._hit or HaltReason(point, address)
        self._core.halt()


def _changeable(address: int) -> bool:
    in_ram = RAM <= address < RAM + RAM_SIZE
    return in_ram or address < FLASH_SIZE or FLASH <= address < FLASH + FLASH_SIZE
