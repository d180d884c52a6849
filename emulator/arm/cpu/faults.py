"""Faults of the core: which exception each is, and its bits in CFSR (ARMv7-M ARM B1.5.14 and B3.2.15)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from emulator.arm.cpu.nvic import BUS_FAULT, HARD_FAULT, MEM_MANAGE, USAGE_FAULT
from emulator.arm.cpu.stop import Stop

IACCVIOL, MSTKERR, MUNSTKERR, MMARVALID = 1 << 0, 1 << 4, 1 << 3, 1 << 7
IBUSERR, PRECISERR, UNSTKERR, STKERR, BFARVALID = 1 << 8, 1 << 9, 1 << 11, 1 << 12, 1 << 15
UNDEFINSTR, INVSTATE, INVPC, NOCP = 1 << 16, 1 << 17, 1 << 18, 1 << 19
UNALIGNED, DIVBYZERO = 1 << 24, 1 << 25

VECTTBL, FORCED, DEBUGEVT = 1 << 1, 1 << 30, 1 << 31
"""Bits of HFSR."""


@dataclass(frozen=True, slots=True)
class Fault:
    """``status`` are its bits in CFSR, ``hard`` those in HFSR; ``address`` goes to BFAR where it is known."""

    exception: int
    status: int = 0
    hard: int = 0
    address: int | None = None


NO_VECTOR: Final = Fault(HARD_FAULT, hard=VECTTBL)
BREAKPOINT: Final = Fault(HARD_FAULT, hard=DEBUGEVT)
STACKING: Final = Fault(BUS_FAULT, STKERR)
UNSTACKING: Final = Fault(BUS_FAULT, UNSTKERR)
INVALID_RETURN: Final = Fault(USAGE_FAULT, INVPC)

_OF_INSTRUCTIONS: Final = {
    Stop.UNDEFINED: Fault(USAGE_FAULT, UNDEFINSTR),
    Stop.INVALID_STATE: Fault(USAGE_FAULT, INVSTATE),
    Stop.NO_COPROCESSOR: Fault(USAGE_FAULT, NOCP),
    Stop.UNALIGNED: Fault(USAGE_FAULT, UNALIGNED),
    Stop.DIVIDE_BY_ZERO: Fault(USAGE_FAULT, DIVBYZERO),
    Stop.EXECUTE_NEVER: Fault(MEM_MANAGE, IACCVIOL),
    Stop.FETCH: Fault(BUS_FAULT, IBUSERR),
    Stop.BKPT: BREAKPOINT,
}


def fault_of(stop: Stop, address: int) -> Fault | None:
    """The fault that the engine has met, ``address`` being that of a refused access; None if it is none."""
    if stop in (Stop.READ, Stop.WRITE):
        return Fault(BUS_FAULT, PRECISERR | BFARVALID, address=address)
    return _OF_INSTRUCTIONS.get(stop)
