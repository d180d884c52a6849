"""Exceptions (ARMv7-M ARM table B1-4, RM0368 table 38) and faults (ARMv7-M ARM B1.5.14, B3.2.15,
B3.2.16).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

from fcu_emulator.emulator.chip.registers import scb
from fcu_emulator.emulator.chip.registers.declaration import masks

NMI, HARD_FAULT, MEM_MANAGE, BUS_FAULT, USAGE_FAULT = 2, 3, 4, 5, 6
SV_CALL, PEND_SV, SYS_TICK = 11, 14, 15
FAULT_HANDLERS: Final = 1 << HARD_FAULT | 1 << MEM_MANAGE | 1 << BUS_FAULT | 1 << USAGE_FAULT
"""A mask of exceptions. Bit n is exception n."""
FIRST_INTERRUPT: Final = 16
INTERRUPTS: Final = 85
"""Number of inputs of the STM32F401's NVIC."""


def bits(mask: int) -> Iterator[int]:
    """Return the numbers of set bits, lowest first."""
    while mask:
        lowest = mask & -mask
        yield lowest.bit_length() - 1
        mask ^= lowest


# -- faults -------------------------------------------------------------------------------------------------

IACCVIOL, IBUSERR, PRECISERR = masks(scb.CFSR.IACCVIOL, scb.CFSR.IBUSERR, scb.CFSR.PRECISERR)
UNSTKERR, STKERR, BFARVALID = masks(scb.CFSR.UNSTKERR, scb.CFSR.STKERR, scb.CFSR.BFARVALID)
UNDEFINSTR, INVSTATE = masks(scb.CFSR.UNDEFINSTR, scb.CFSR.INVSTATE)
INVPC, NOCP = masks(scb.CFSR.INVPC, scb.CFSR.NOCP)
UNALIGNED, DIVBYZERO = masks(scb.CFSR.UNALIGNED, scb.CFSR.DIVBYZERO)
VECTTBL, FORCED, DEBUGEVT = masks(scb.HFSR.VECTTBL, scb.HFSR.FORCED, scb.HFSR.DEBUGEVT)


@dataclass(frozen=True, slots=True)
class CoreFault:
    """A fault with its bits of CFSR and HFSR, and the address in BFAR."""

    exception: int
    cfsr: int = 0
    hfsr: int = 0
    address: int | None = None
