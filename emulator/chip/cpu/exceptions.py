"""Exceptions by number, as in the vector table (ARMv7-M ARM table B1-4, RM0368 table 38), and faults: which
exception each is, and its bits in CFSR and HFSR (ARMv7-M ARM B1.5.14, B3.2.15, B3.2.16).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

NMI, HARD_FAULT, MEM_MANAGE, BUS_FAULT, USAGE_FAULT = 2, 3, 4, 5, 6
SV_CALL, PEND_SV, SYS_TICK = 11, 14, 15
FIRST_INTERRUPT: Final = 16
INTERRUPTS: Final = 85
"""Inputs of the STM32F401's NVIC."""


def bits(mask: int) -> Iterator[int]:
    """The numbers of the bits that are set, from the lowest."""
    while mask:
        lowest = mask & -mask
        yield lowest.bit_length() - 1
        mask ^= lowest


# -- faults -------------------------------------------------------------------------------------------------

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
