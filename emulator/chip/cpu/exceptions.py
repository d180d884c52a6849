"""Exceptions by number, as in the vector table (ARMv7-M ARM table B1-4, RM0368 table 38)."""

from __future__ import annotations

from collections.abc import Iterator
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
