"""One instruction, and no more: also inside an IT block, which the engine executes as a whole.

What a block does to an instruction (ARMv7-M ARM A7.3) is done here by hand: its condition is looked at, it is
executed as if there were no block, and flags that it would not have changed are put back. Instructions whose
conditions fail are passed along with the one in front of them; like in the engine they take no time.
"""

from __future__ import annotations

from emulator.arm.cpu.engine import Engine
from emulator.arm.cpu.registers import IT_BITS, Registers
from emulator.arm.cpu.stop import Stop

_FLAGS = 0xF000_0000
_BEHIND = {Stop.SLICE, Stop.SVC, Stop.WFI, Stop.WFE, Stop.EXCEPTION_RETURN}
"""Ends of a run at which the instruction has been executed."""


def size_of(first: int) -> int:
    """Bytes of the instruction whose first half-word this is (A5.1)."""
    return 4 if first >> 11 >= 0b11101 else 2


def block_length(first: int) -> int:
    """How many instructions an IT instruction makes conditional; 0 for any other (A7.7.38)."""
    mask = first & 0xF
    return 4 - (mask & -mask).bit_length() + 1 if first >> 8 == 0xBF and mask else 0


class SingleStep:
    """``run()`` does for one instruction what the engine's does for many."""

    def __init__(self, engine: Engine) -> None:
        self._engine = engine
        self._xpsr = Registers(engine, ("xpsr",))

    def run(self) -> Stop:
        """Execute one: why it ended."""
        state = _state(self._xpsr.read()[0])
        first = self._half_word()
        if state & 0xF:
            stop = self._inside(state, first)
        elif block_length(first) and self._engine.thumb:
            stop = self._enter(first)
        else:
            return self._engine.run(1)
        if stop is Stop.SLICE:
            self._pass_others()
        return stop

    def leave_out(self) -> bool:
        """Pass instructions of an IT block whose conditions fail; whether there are any here."""
        here = self._engine.pc
        self._pass_others()
        return self._engine.pc != here

    def _enter(self, first: int) -> Stop:
        self._engine.pc += 2
        self._engine.executed = 1
        self._set_state(first & 0xFF)
        return Stop.SLICE

    def _inside(self, state: int, first: int) -> Stop:
        before = self._xpsr.read()[0]
        self._xpsr.write(before & ~IT_BITS)
        stop = self._engine.run(1)
        if stop not in _BEHIND:
            self._xpsr.write(before)
            return stop
        after = self._xpsr.read()[0]
        if _keeps_flags(first):
            self._xpsr.write(after & ~_FLAGS | before & _FLAGS)
        self._set_state(_advanced(state))
        return stop

    def _pass_others(self) -> None:
        """Go to the next instruction of the block whose condition holds."""
        xpsr = self._xpsr.read()[0]
        state = _state(xpsr)
        while state & 0xF and not _holds(state >> 4, xpsr):
            self._engine.pc += size_of(self._half_word())
            state = _advanced(state)
        self._set_state(state)

    def _half_word(self) -> int:
        code = self._engine.memory(self._engine.pc, 2)
        return 0 if code is None else code[0] | code[1] << 8

    def _set_state(self, state: int) -> None:
        bits = (state & 0xFC) << 8 | (state & 3) << 25
        self._xpsr.write(self._xpsr.read()[0] & ~IT_BITS | bits)


def _keeps_flags(first: int) -> bool:
    """Whether a 16-bit instruction sets flags outside of a block only; the comparisons set them always."""
    compares = first & 0xF800 == 0x2800 or first & 0xFFC0 in {0x4200, 0x4280, 0x42C0} or first >> 8 == 0x45
    return first < 0x4800 and not compares


def _holds(condition: int, xpsr: int) -> bool:
    """ConditionPassed (A7.3.1)."""
    n, z, c, v = (bool(xpsr >> bit & 1) for bit in (31, 30, 29, 28))
    truths = (z, c, n, v, c and not z, n == v, n == v and not z, True)
    return truths[condition >> 1] is not bool(condition & 1 and condition != 0xF)


def _advanced(state: int) -> int:
    """ITAdvance (A7.3.3)."""
    return state & 0xE0 | state << 1 & 0x1F if state & 7 else 0


def _state(xpsr: int) -> int:
    """ITSTATE, whose bits lie in two places (B1.4.2)."""
    return xpsr >> 8 & 0xFC | xpsr >> 25 & 3
