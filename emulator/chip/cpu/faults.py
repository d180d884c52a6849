"""Faults of the core: which exception each is, and its bits in CFSR (ARMv7-M ARM B1.5.14 and B3.2.15)."""

from __future__ import annotations

from dataclasses import dataclass

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
