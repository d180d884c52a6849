"""A processor without time, exceptions and peripherals."""

from __future__ import annotations

from collections.abc import Callable
from enum import Enum, auto
from typing import Final

from fcu_emulator.emulator.chip.library import FcuChip
from fcu_emulator.emulator.clock import Clock
from fcu_emulator.emulator.trace import Trace


class Stop(Enum):
    """The reason why a run ended. SVC, BKPT and all values from UNDEFINED on cause a core exception."""

    SLICE = auto()  # all instructions were executed, or ``end_run`` was called
    HALT = auto()  # ``pc`` is at the instruction, for a debugger
    BREAKPOINT = auto()  # ``pc`` is at an instruction with a breakpoint
    WFI = auto()  # ``pc`` is after the instruction
    WFE = auto()  # ``pc`` is after the instruction
    SVC = auto()  # ``pc`` is after the instruction
    BKPT = auto()  # ``pc`` is at the instruction
    EXCEPTION_RETURN = auto()  # an EXC_RETURN value has been loaded into PC
    UNDEFINED = auto()  # ``pc`` is at the instruction, as for all values below
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
"""The stops in the order of enum Stop in core.h."""
_EXECUTE_NEVER = 1 << 2 | 1 << 5 | 1 << 6 | 1 << 7  # bit n: region n of 512 MB (ARMv7-M ARM table B3-1)


def fetch_fault(address: int) -> Stop:
    """Return why an address cannot be executed."""
    return Stop.EXECUTE_NEVER if _EXECUTE_NEVER >> (address >> 29) & 1 else Stop.FETCH


class BareCore(FcuChip):
    """A core that runs from ``pc`` on. Set ``thumb`` before a run.

    Register accesses call ``read_python`` and ``write_python``; watched loads and stores call
    ``on_access``.
    """

    def __init__(self) -> None:
        super().__init__(Clock(), Trace())
        self.executed = 0
        """Number of instructions in the latest run, including an instruction that faulted."""
        self.on_access: Callable[[int, int, bool], None] = lambda _address, _size, _written: None

    def run(self, instructions: int, past: bool = False) -> Stop:
        """Execute from ``pc`` on. If ``past`` is set, ignore a breakpoint at ``pc``."""
        stop = _STOPS[self.library.fcu_execute(self.handle, instructions, past)]
        self.raise_error()
        self.executed = self.count()
        return fetch_fault(self.pc) if stop is Stop.FETCH else stop

    def count(self) -> int:
        counted: int = self.library.fcu_executed(self.handle)
        return counted

    def end_run(self) -> None:
        self.library.fcu_end_run(self.handle)

    def enter_exception(self, number: int, vectors: int) -> bool:
        """Save the context and enter a handler.

        Return False if the stack or the vector table is outside memory.
        """
        return bool(self.library.fcu_enter_exception(self.handle, number, vectors))

    @property
    def fault_address(self) -> int:
        """Address of the access that caused READ, WRITE or UNALIGNED."""
        address: int = self.library.fcu_fault_address(self.handle)
        return address

    def watch_memory(self, begin: int, end: int) -> None:
        self.library.fcu_watch_memory(self.handle, True, begin, end)

    def stop_before(self, address: int, on: bool = True) -> None:
        self.library.fcu_set_breakpoint(self.handle, address, on)

    def _accessed(self, address: int, size: int, written: int) -> None:
        self.on_access(address, size, bool(written))
