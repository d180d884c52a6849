"""What every block of the chip has in common: its place in the memory map, registers, clock and reset.

The core sets ``soc.clock.now_ps`` to the exact time of an access before it calls ``read`` or ``write``, and
fires every event that is due by then. So a block either computes its state from the time when it is looked
at, or schedules an event; an event costs the end of a run of instructions and is for what may raise an
interrupt, move a pin or start a transfer by DMA.

Registers are words. Byte and half-word accesses reach ``write`` with a mask that says which bits are meant;
a block with a side effect for each byte (a data register) looks at the mask, all others merge.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, ClassVar

from emulator.time.clock import NEVER_PS
from emulator.trace import DeviceNote

if TYPE_CHECKING:
    from emulator.chip.soc import Soc

WORD = 0xFFFF_FFFF
ALREADY_PS = -1

RegisterWritten = Callable[[int, int], None]
"""Called with (old value, new value) after a register has changed its stored value or was written again."""


class Peripheral:
    """One block at ``base``; ``size`` bytes of the address space belong to it.

    ``REGISTERS``: reset value by offset; what is not listed reads as 0 and refuses writes, and the core notes
    the access by name. ``WRITABLE``: bits that a write can change, by offset (all where not listed).
    """

    REGISTERS: ClassVar[dict[int, int]] = {}
    NAMES: ClassVar[dict[int, str]] = {}
    """The reference manual's name of each register, by offset: for the trace and for diagnoses."""
    WRITABLE: ClassVar[dict[int, int]] = {}

    def __init__(self, soc: Soc, name: str, base: int, size: int = 0x400) -> None:
        self.soc = soc
        self.name = name
        self.base = base
        self.size = size
        self.clocked = True
        """Set by RCC: a block without clock reads as 0 and forgets writes; the core names such accesses."""
        self.registers = dict(self.REGISTERS)
        self._noted: set[tuple[str, str]] = set()

    def note(self, what: str, text: str) -> None:
        """Tell the trace that firmware touched something "forbidden", "refused" or "not modelled".

        The same is told once only: firmware repeats itself thousands of times a second.
        """
        if (what, text) not in self._noted:
            self._noted.add((what, text))
            self.soc.trace.add(DeviceNote(self.soc.clock.now_ps, self.name, what, text))

    def gate(self, *, clocked: bool) -> None:
        """RCC switches the clock of the block on or off."""
        self.clocked = clocked

    def reset(self) -> None:
        """Back to the state after reset (system reset, or the block's bit in RCC_xxxRSTR)."""
        self.registers = dict(self.REGISTERS)

    def read(self, offset: int) -> int:
        """The word at a word-aligned ``offset``, side effects included."""
        return self.registers.get(offset, 0)

    def peek(self, offset: int) -> int:
        """The word at ``offset`` without any side effect: for debuggers and diagnoses."""
        return self.registers.get(offset, 0)

    def write(self, offset: int, value: int, mask: int = WORD) -> None:
        """Write the bits of ``mask`` of the word at ``offset``."""
        mask &= self.WRITABLE.get(offset, WORD)
        if offset in self.registers:
            self.registers[offset] = self.registers[offset] & ~mask | value & mask

    def changes_nothing(self, offset: int, value: int, mask: int) -> bool:
        """Whether such a ``write`` would leave everything as it is: a loop that repeats it can be skipped."""
        del offset, value, mask
        return False

    def pure_read(self, offset: int) -> bool:
        """Whether reading ``offset`` has no side effect and will give the same until ``next_change_ps()``.

        Only then may a loop that polls it be skipped. False for counters that run with time, and for data
        registers.
        """
        del offset
        return True

    def look(self, offset: int) -> tuple[int, int]:
        """``read``, and until when the value stays so without any access and any event of the clock.

        That is ``ALREADY_PS`` where the read has a side effect. Blocks that are polled much do it in one go.
        """
        pure = self.pure_read(offset)
        value = self.read(offset)
        return value, self.next_change_ps() if pure else ALREADY_PS

    def next_change_ps(self) -> int:
        """When a register may next read differently without any access and without an event of the clock."""
        return NEVER_PS
