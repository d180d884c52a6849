"""A processor with memory and nothing else: it executes instructions without time, exceptions and peripherals.

For questions of the kind "what would these instructions do?", and for tests of single instructions.
"""

from __future__ import annotations

from collections.abc import Callable
from enum import Enum, auto
from typing import Final

from fcu_emulator.emulator.chip.library import FcuChip
from fcu_emulator.emulator.time.clock import Clock
from fcu_emulator.emulator.trace import Trace


class Stop(Enum):
    """What the engine met. All but SLICE, HALT, BREAKPOINT and the sleeps ask for an exception of the core."""

    SLICE = auto()  # as many instructions as were asked for, or cut short
    HALT = auto()  # before the instruction, for a debugger
    BREAKPOINT = auto()  # before an instruction that was asked for
    WFI = auto()  # after the instruction
    WFE = auto()  # after the instruction
    SVC = auto()  # after the instruction
    BKPT = auto()  # on the instruction
    EXCEPTION_RETURN = auto()  # an EXC_RETURN value has been loaded into PC
    UNDEFINED = auto()  # on the instruction, as all of the following
    INVALID_STATE = auto()
    NO_COPROCESSOR = auto()
    UNALIGNED = auto()
    DIVIDE_BY_ZERO = auto()
    EXECUTE_NEVER = auto()
    FETCH = auto()
    READ = auto()
    WRITE = auto()


_STOPS: Final = (
    *(Stop.SLICE, Stop.BREAKPOINT, Stop.WFI, Stop.WFE, Stop.SVC, Stop.BKPT, Stop.EXCEPTION_RETURN),
    *(Stop.UNDEFINED, Stop.INVALID_STATE, Stop.NO_COPROCESSOR, Stop.UNALIGNED, Stop.DIVIDE_BY_ZERO),
    *(Stop.FETCH, Stop.READ, Stop.WRITE),
)
"""enum Stop of core.h."""
_EXECUTE_NEVER = 1 << 2 | 1 << 5 | 1 << 6 | 1 << 7  # by 512 MB: what ARMv7-M ARM table B3-1 marks XN


def fetch_fault(address: int) -> Stop:
    """Why nothing can be executed at an address without memory."""
    return Stop.EXECUTE_NEVER if _EXECUTE_NEVER >> (address >> 29) & 1 else Stop.FETCH


class BareCore(FcuChip):
    """Set ``pc`` and ``thumb``, then ``run``.

    Accesses to registers call ``read_python(address, size)`` and ``write_python(address, size, value)``;
    loads and stores that are watched call ``on_access``.
    """

    def __init__(self) -> None:
        super().__init__(Clock(), Trace())
        self.executed = 0
        """Instructions of the latest run, one that has met a fault included."""
        self.on_access: Callable[[int, int, bool], None] = lambda _address, _size, _written: None

    def run(self, instructions: int, past: bool = False) -> Stop:
        """Execute up to so many instructions from ``pc`` on: why it ended.

        ``past``: also if runs are to stop before the first one.
        """
        stop = _STOPS[self.library.fcu_execute(self.handle, instructions, past)]
        self.raise_error()
        self.executed = self.count()
        return fetch_fault(self.pc) if stop is Stop.FETCH else stop

    def count(self) -> int:
        """Instructions of this run, the one in flight included; in an access."""
        counted: int = self.library.fcu_executed(self.handle)
        return counted

    def cut(self) -> None:
        """In an access: end the run after the instruction in flight."""
        self.library.fcu_cut(self.handle)

    def enter_exception(self, number: int, vectors: int) -> bool:
        """Save the context, and go to the handler of an exception as the table at ``vectors`` has it.

        False if the stack or the table is no memory.
        """
        return bool(self.library.fcu_enter_exception(self.handle, number, vectors))

    @property
    def fault_address(self) -> int:
        """Where the access was that ended a run with READ, WRITE or UNALIGNED."""
        address: int = self.library.fcu_fault_address(self.handle)
        return address

    def watch_memory(self, begin: int, end: int) -> None:
        """Call ``on_access(address, size, written)`` at loads and stores from ``begin`` to ``end``."""
        self.library.fcu_watch_memory(self.handle, True, begin, end)

    def stop_before(self, address: int, on: bool = True) -> None:
        """Runs end with BREAKPOINT before the instruction at ``address``, or no more."""
        self.library.fcu_set_breakpoint(self.handle, address, on)

    def _accessed(self, address: int, size: int, written: int) -> None:
        self.on_access(address, size, bool(written))
