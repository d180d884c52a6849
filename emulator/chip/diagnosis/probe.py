"""A test for endless loops, in a copy of the core.

A loop is endless if a state of core and RAM occurs again while the values that the loop reads stay
the same. A loop does not count as endless if it writes to peripherals, or reads with side effects.
"""

from __future__ import annotations

from contextlib import closing
from dataclasses import dataclass

from fcu_emulator.emulator.chip.cpu.bare_core import BareCore, Stop
from fcu_emulator.emulator.chip.cpu.core import Core, Masks
from fcu_emulator.emulator.chip.cpu.core_registers import EVERYTHING, SPSEL, CoreRegisters
from fcu_emulator.emulator.chip.memory_map import RAM, RAM_SIZE
from fcu_emulator.emulator.chip.peripherals.peripheral import WORD, Peripheral
from fcu_emulator.emulator.chip.registers import address_of, scb

_LONGEST = 20_000  # instructions: a tenth of a second of wall time
_LONGEST_HANDLER = 5_000
_BELOW = 0x200  # bytes below SP that a called function may use
_ABOVE = 0x100  # bytes above SP in which a thread's functions keep their local variables
_SP = 13
_PROCESS_STACK, _TO_THREAD, _BASIC_FRAME = (
    1 << 2,
    1 << 3,
    1 << 4,
)  # bits of EXC_RETURN (ARMv7-M ARM table B1-8)
_FRAME_BYTES, _FLOATING_FRAME_BYTES = 0x20, 0x68
_VTOR = address_of("SCB", scb.VTOR)


@dataclass(frozen=True)
class Loop:
    """A loop that only repeats itself.

    ``code``: addresses of its instructions; ``variables``: RAM addresses that it reads;
    ``registers``: (peripheral, offset, value) of each register that it reads; ``masks``: values of
    PRIMASK, BASEPRI and FAULTMASK; ``in_thread``: it runs on the process stack.
    """

    code: frozenset[int]
    variables: frozenset[int]
    registers: frozenset[tuple[Peripheral, int, int]]
    masks: frozenset[Masks]
    in_thread: bool = False


class Probe:
    """A copy of ``core`` for one test."""

    def __init__(self, core: Core) -> None:
        self._core = core
        self._acts = False
        self._in_thread = core.uses_process_stack
        self._touched: set[Peripheral] | None = None
        self._reads: set[int] = set()
        self._registers: set[tuple[Peripheral, int, int]] = set()
        self._copy = copy = BareCore()
        copy.flash[:] = core.flash
        copy.ram[:] = core.ram
        CoreRegisters(copy, EVERYTHING).write(*CoreRegisters(core, EVERYTHING).read())
        copy.pc, copy.thumb = core.pc, core.thumb
        self._copied_masks = CoreRegisters(copy, Masks._fields)
        self._masks: set[Masks] = set()
        copy.read_python, copy.write_python = self._register_read, self._register_written
        copy.on_access = self._memory
        copy.watch_memory(RAM, RAM + RAM_SIZE - 1)

    def resume(self, frame: int) -> None:
        """Restore the registers that exception entry saved at ``frame`` (ARMv7-M ARM B1.5.6).

        R4 to R11 keep the handler's values.
        """
        saved = [self._core.peek(frame + 4 * n) or 0 for n in range(8)]
        names = ("r0", "r1", "r2", "r3", "r12", "lr", "pc", "xpsr")
        CoreRegisters(self._copy, names).write(*saved)

    def leave_handler(self) -> frozenset[Peripheral] | None:
        """Finish the handler without effects on peripherals, and return to the thread (ARMv7-M ARM B1.5.8).

        Return the peripherals that the handler accesses, or None if it does not return to Thread mode.
        """
        copy, touched = self._copy, set[Peripheral]()
        self._touched = touched
        stops = (copy.run(1) for _ in range(_LONGEST_HANDLER))
        stop = next((stop for stop in stops if stop is not Stop.SLICE), None)
        self._touched = None
        exc_return = copy.pc
        if stop is not Stop.EXCEPTION_RETURN or not exc_return & _TO_THREAD:
            return None
        self._in_thread = bool(exc_return & _PROCESS_STACK)
        bank = "psp" if self._in_thread else "msp"
        (frame,) = CoreRegisters(copy, (bank,)).read()
        content = copy.memory(frame, _FRAME_BYTES)
        if content is None:
            return None
        words = memoryview(bytes(content)).cast("I").tolist()
        end = frame + (_FRAME_BYTES if exc_return & _BASIC_FRAME else _FLOATING_FRAME_BYTES)
        end |= words[-1] >> 7 & 4  # bit 9 of xPSR: the frame is padded
        names = ("xpsr", "control", bank, "r0", "r1", "r2", "r3", "r12", "lr", "pc")
        CoreRegisters(copy, names).write(words[-1], SPSEL * self._in_thread, end, *words[:-1])
        copy.thumb = True
        self._reads.clear()
        self._registers.clear()
        return frozenset(touched)

    # -- execution in the copy --------------------------------------------------------------------------

    def loop(self) -> Loop | None:
        with closing(self._copy) as copy:
            return self._loop(copy)

    def _loop(self, copy: BareCore) -> Loop | None:
        state, ram = copy.core_state(), bytes(copy.ram)
        length, compared = 0, 1
        code: set[int] = set()
        for _ in range(_LONGEST):
            code.add(copy.pc)
            self._masks.add(Masks(*self._copied_masks.read()))
            if not self._step():
                return None
            length += 1
            now = copy.core_state()
            if now == state and bytes(copy.ram) == ram:
                return self._described(code)
            if length == compared:  # Brent's algorithm: compare with a newer state, for twice as many steps
                state, ram = now, bytes(copy.ram)
                length, compared = 0, 2 * compared
                code.clear()
                self._reads.clear()
                self._registers.clear()
                self._masks.clear()
        return None

    def handle(self, exception: int) -> frozenset[int] | None:
        """Run an exception handler. Return the changed RAM addresses, or None if the handler had other effects."""
        with closing(self._copy) as copy:
            return self._handle(copy, exception)

    def _handle(self, copy: BareCore, exception: int) -> frozenset[int] | None:
        before = bytes(copy.ram)
        sp = copy.register(_SP)
        (main,) = CoreRegisters(copy, ("msp",)).read()
        handlers = range(main - _BELOW, main)  # the handler's stack
        if not copy.enter_exception(exception, self._core.peek(_VTOR) or 0):
            return None
        for _ in range(_LONGEST_HANDLER):
            stop = copy.run(1)
            if stop is Stop.EXCEPTION_RETURN:
                changed = (at for at in range(RAM_SIZE) if copy.ram[at] != before[at])
                every = (RAM + at for at in changed)
                return frozenset(at for at in every if not self._on_stack(at, sp) and at not in handlers)
            if stop is not Stop.SLICE or self._acts:
                return None
        return None

    def _step(self) -> bool:
        return self._copy.run(1) is Stop.SLICE and not self._acts

    def _described(self, code: set[int]) -> Loop:
        sp = self._copy.register(_SP)
        variables = (at for at in self._reads if not self._on_stack(at, sp))
        registers, masks = frozenset(self._registers), frozenset(self._masks)
        return Loop(frozenset(code), frozenset(variables), registers, masks, self._in_thread)

    def _on_stack(self, address: int, sp: int) -> bool:
        top = int.from_bytes(self._copy.flash[:4], "little")
        if self._in_thread:
            top = min(top, sp + _ABOVE)  # the end of the thread's stack is unknown
        return sp <= top and sp - _BELOW <= address < top

    # -- accesses of the copy ---------------------------------------------------------------------------

    def _memory(self, address: int, _size: int, is_write: bool) -> None:
        if not is_write:
            self._reads.add(address)

    def _register_read(self, address: int, size: int) -> int:
        word = self._register(address & ~3)
        return word >> 8 * (address & 3) & (WORD if size == 4 else (1 << 8 * size) - 1)

    def _register(self, address: int) -> int:
        found = self._core.find(address)
        if found is None:
            self._acts = True
            return 0
        peripheral, offset = found
        if self._touched is not None:
            self._touched.add(peripheral)
            return peripheral.peek(offset) if peripheral.clocked else 0
        if not peripheral.clocked:
            value = 0
        elif peripheral.pure_read(offset):
            value = peripheral.peek(offset)
        else:
            self._acts = True
            return 0
        self._registers.add((peripheral, offset, value))
        return value

    def _register_written(self, address: int, _size: int, _value: int) -> None:
        found = self._core.find(address & ~3)
        if self._touched is not None and found is not None:
            self._touched.add(found[0])
            return
        self._acts |= found is None or found[0].clocked
