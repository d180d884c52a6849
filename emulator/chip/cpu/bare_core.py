"""A processor without time, exceptions and peripherals."""

from __future__ import annotations

from collections.abc import Callable
from enum import Enum, auto
from typing import Final

from fcu_emulator.emulator.chip.library import FcuChip
from fcu_emulator.emulator.clock import Clock
from fcu_emulator.emulator.trace import Trace


class Stop(Enum):
    """Why a run ended. All except SLICE, HALT, BREAKPOINT and sleeps raise a core exception."""

    SLICE = auto()  # all instructions, or ``end_run``
    HALT = auto()  # before the instruction, for a debugger
    BREAKPOINT = auto()  # before an instruction with a breakpoint
    WFI = auto()  # after the instruction
    WFE = auto()  # after the instruction
    SVC = auto()  # after the instruction
    BKPT = auto()  # on the instruction
    EXCEPTION_RETURN = auto()  # an EXC_RETURN value has been loaded into PC
    UNDEFINED = auto()  # ``pc`` is on the instruction, as for all values below
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
_EXECUTE_NEVER = 1 << 2 | 1 << 5 | 1 << 6 | 1 << 7  # for each 512 MB: execute-never (ARMv7-M ARM table B3-1)


def fetch_fault(address: int) -> Stop:
    """Return why an address cannot be executed."""
    return Stop.EXECUTE_NEVER if _EXECUTE_NEVER >> (address >> 29) & 1 else Stop.FETCH


class BareCore(FcuChip):
    """A core that runs from ``pc``. Set ``thumb`` first.

    Register accesses call ``read_python`` and ``write_python``; watched loads and stores call
    ``on_access``.
    """

    def __init__(self) -> None:
        super().__init__(Clock(), Trace())
        self.executed = 0
        """Instructions of the latest run, including one with a fault."""
        self.on_access: Callable[[int, int, bool], None] = lambda _address, _size, _written: None

    def run(self, instructions: int, past: bool = False) -> Stop:
        """Execute from ``pc``. ``past``: ignore a breakpoint there."""
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
        """Save the context and enter a handler. Return False if stack or vector table is outside
        memory.
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
