"""The chip as a debugger's target.

Decision: going on from a breakpoint makes a single step first, in a run of its own. So a breakpoint stops
each time its instruction is reached, and a waiting loop with one inside is never skipped: nothing that was
seen in one run counts in the next.

Decision: with a debugger, BKPT halts (ARMv7-M ARM C1.4.1), and going on from it goes on after it. On the
chip it would be met again for ever.

Decision: watchpoints listen to every load and store in one range that covers all of them, registers included:
one way for memory and peripherals, and nothing in the path of an access while there is none. The bit-band
alias of the range is listened to as well. What does not pass through the core's instructions is not seen:
DMA, and frames saved at exceptions.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator

from fcu_emulator.emulator.chip import memory_map
from fcu_emulator.emulator.chip.cpu.core import Core
from fcu_emulator.emulator.chip.cpu.core_registers import EVERYTHING, CoreRegisters
from fcu_emulator.emulator.chip.gdb.target import HaltReason, Point, PointKind
from fcu_emulator.emulator.chip.memory_map import FLASH, FLASH_SIZE, RAM, RAM_SIZE
from fcu_emulator.emulator.time.clock import Clock

# -- breakpoints and watchpoints ----------------------------------------------------------------------------

_WIDEST_ACCESS = 8  # bytes of an access
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
"""A watchpoint, its first address, the address after its last one, bytes there for each of the point's."""


class Points:
    """The points that are wanted, set in the core when it goes on, and only if they have changed: a debugger
    takes all of its points away at each stop and brings them back before it goes on.

    ``accessed(point, address)`` is called while an access is made that ``point`` watches.
    """

    def __init__(self, core: Core, accessed: Callable[[Point, int], None]) -> None:
        self._core = core
        self._accessed = accessed
        self._wanted: set[Point] = set()
        self._set: set[Point] = set()
        self._ranges: list[_Range] = []
        core.on_access = self._on_access

    def add(self, point: Point) -> None:
        """Stop there from the next ``set()`` on."""
        self._wanted.add(point)

    def remove(self, point: Point) -> None:
        """Remove a breakpoint or a watchpoint."""
        self._wanted.discard(point)

    def clear(self) -> None:
        """Take all of them away at once."""
        self._wanted.clear()
        self.set()

    def set(self) -> None:
        """Bring the core up to date; it must not be running."""
        if self._set == self._wanted:
            return
        breaks = {point.address for point in self._wanted if point.kind.is_break}
        for address in {point.address for point in self._set if point.kind.is_break} ^ breaks:
            self._core.set_breakpoint(address, address in breaks)
        self._set = set(self._wanted)
        self._ranges = [
            one for point in self._wanted if not point.kind.is_break for one in _watched_ranges(point)
        ]
        if self._ranges:
            begin = min(begin for _, begin, _, _ in self._ranges)
            self._core.watch_memory(
                max(begin - _WIDEST_ACCESS + 1, 0), max(end for _, _, end, _ in self._ranges) - 1
            )
        else:
            self._core.unwatch_memory()

    def breakpoint_at(self, address: int) -> Point | None:
        """The breakpoint on an instruction, if there is one."""
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
_EXCEPTION = 0x1FF  # of xPSR; what is being handled cannot be changed
_ALIGNMENTS = (4, 2, 1)


class CoreTarget:
    """Implements :class:`fcu_emulator.emulator.chip.gdb.target.Target`; ``run(at_ps)`` runs the core."""

    def __init__(self, core: Core, clock: Clock, run: Callable[[int], None]) -> None:
        self._core = core
        self._clock = clock
        self._run = run
        self._points = Points(core, self._accessed)
        self._everything = CoreRegisters(core, EVERYTHING)
        self._single_step = False  # the debugger wants one instruction
        self._hit: HaltReason | None = None
        self._on_bkpt = False
        self._lock_up_reported = False
        self._new_code = False

    # -- attaching and releasing ------------------------------------------------------------------------

    def attach(self) -> None:
        """Halt for a debugger that has come."""
        self._core.debug(True)
        self.halt()

    def release(self) -> None:
        """The debugger is gone: take its points away and go on."""
        self._core.debug(False)
        self._points.clear()
        self.resume()

    def halt(self) -> None:
        """Stand still before the next instruction."""
        self._core.halt()
        self._single_step = False

    def reset(self) -> None:
        """Reset the chip as through NRST; it halts before its first instruction."""
        self._core.reset_now("PIN")
        self._on_bkpt = self._lock_up_reported = False

    # -- registers --------------------------------------------------------------------------------------

    def read_registers(self) -> dict[str, int]:
        """Return the values of all registers."""
        values = dict(zip(self._everything.names, self._everything.read(), strict=True))
        xpsr = values["xpsr"] & ~_THUMB | (_THUMB if self._core.thumb else 0)
        return values | {"xpsr": xpsr, "pc": self._core.pc}

    def write_register(self, name: str, value: int) -> None:
        """Change one. A new PC wakes a sleeping core, as entering the debug state does (B1.5.19)."""
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
        """What is there, without side effects, up to where nothing answers any more."""
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
        """Memory, the flash too, or registers with all that writing them does."""
        memory = self._core.memory(address, len(data))
        if memory is not None:
            if not _changeable(address):
                return False
            memory[:] = data
            self._core.forget_code()
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
        """Stop there from now on."""
        self._points.add(point)

    def remove(self, point: Point) -> None:
        """Stop there no more."""
        self._points.remove(point)

    def resume(self) -> None:
        """The next ``run_until_ps`` goes on, past a breakpoint on the very next instruction."""
        self._go(one=False)

    def step(self) -> None:
        """The next ``run_until_ps`` executes one instruction and stops."""
        self._go(one=True)

    def run_until_ps(self, at_ps: int) -> HaltReason | None:
        """Run up to ``at_ps`` of virtual time: why it stopped before, or None."""
        while True:
            self._run(at_ps)
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
        """Why the core has halted; None if only to be stepped past something."""
        hit, self._hit = self._hit, None
        self._on_bkpt |= self._core.met_breakpoint_instruction()
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
