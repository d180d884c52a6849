"""Which exceptions are enabled, pending and active, with which priority (ARMv7-M ARM B1.5 and B3.4).

System exceptions and interrupts share one numbering, as in the vector table: 2 is NMI, 15 SysTick,
interrupt n is exception 16 + n. The sets are bit masks in Python integers, bit = exception number.

An interrupt line is level sensitive (PM0214 4.3.9): a rising line makes the interrupt pending; one that
is still active when the handler returns, or when software clears the pending bit, is pending again. A
short pulse stays pending.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

INTERRUPTS: Final = 85
"""Inputs of the STM32F401's NVIC (RM0368 table 38)."""

NMI, HARD_FAULT, MEM_MANAGE, BUS_FAULT, USAGE_FAULT = 2, 3, 4, 5, 6
SV_CALL, PEND_SV, SYS_TICK = 11, 14, 15
FIRST_INTERRUPT: Final = 16

LOWEST = 256
"""The priority of code that handles nothing; smaller is more urgent."""

_SYSTEM = (1 << FIRST_INTERRUPT) - 1
_INPUTS = (1 << INTERRUPTS) - 1
_WORDS = -(-INTERRUPTS // 32)
_IMPLEMENTED = 0xF0F0_F0F0  # four bits of priority, 16 levels

ICTR, STIR = 0x004, 0xF00
_ISER, _ICER, _ISPR, _ICPR, _IABR, _IPR = 0x100, 0x180, 0x200, 0x280, 0x300, 0x400


def bits(mask: int) -> Iterator[int]:
    """The numbers of the bits that are set, from the lowest."""
    while mask:
        lowest = mask & -mask
        yield lowest.bit_length() - 1
        mask ^= lowest


class Nvic:
    """State of all exceptions. ``changed`` is set when something may be to be taken that was not before."""

    OFFSETS: Final = (
        ICTR,
        *(base + 4 * word for base in (_ISER, _ICER, _ISPR, _ICPR, _IABR) for word in range(_WORDS)),
        *(_IPR + word for word in range(0, INTERRUPTS, 4)),
        STIR,
    )
    """Its registers in the system control space."""

    def __init__(self) -> None:
        self.priority = [0] * (FIRST_INTERRUPT + INTERRUPTS)
        self.alone = True
        """Whether exceptions may be entered and left within a run: not while a debugger makes steps."""
        self.reset()

    def reset(self) -> None:
        """Nothing enabled, pending or active; lines that are active are seen anew when they rise."""
        self.enabled = _SYSTEM
        self.pending = 0
        self.active = 0
        self.lines = 0
        self.priority[:] = [-4, -3, -2, -1] + [0] * (len(self.priority) - 4)
        self.subpriority_bits = 1  # AIRCR.PRIGROUP 0: seven bits of group; never fewer than one below
        self.changed = False
        self.event = False
        """The event register, which WFE waits for (B1.5.18)."""
        self.event_on_pending = False
        """SCR.SEVONPEND: whatever becomes pending is an event, even if it is not enabled (B3.2.7)."""

    # -- what the chip does -----------------------------------------------------------------------------

    def set_line(self, number: int, level: bool) -> None:
        """Input ``number`` (0 to 84) is active or not."""
        bit = 1 << FIRST_INTERRUPT + number
        if not level:
            self.lines &= ~bit
        elif not self.lines & bit:
            self.lines |= bit
            self._pend(bit)

    def pend(self, number: int) -> None:
        """Make an exception pending."""
        self._pend(1 << number)

    def activate(self, number: int) -> None:
        """The handler begins."""
        bit = 1 << number
        self.pending &= ~bit
        self.active |= bit

    def deactivate(self, number: int) -> None:
        """The handler has returned; a line still active is pending again."""
        bit = 1 << number
        self.active &= ~bit
        self._pend(self.lines & bit)

    def _pend(self, bits: int) -> None:
        if self.event_on_pending and bits & ~self.pending:
            self.event = True
        self.pending |= bits
        self._look()

    def _look(self) -> None:
        if self.pending & self.enabled:
            self.changed = True

    # -- priorities -------------------------------------------------------------------------------------

    def group(self, priority: int) -> int:
        """The part of a priority that decides on preemption (B1.5.4)."""
        return priority if priority < 0 else priority >> self.subpriority_bits << self.subpriority_bits

    def most_urgent(self) -> int:
        """The pending and enabled exception to be taken first; 0 if there is none."""
        best, best_priority = 0, LOWEST
        for number in bits(self.pending & self.enabled):
            if self.priority[number] < best_priority:
                best, best_priority = number, self.priority[number]
        return best

    def execution_priority(self, primask: int, basepri: int, faultmask: int) -> int:
        """How urgent the present code is (B1.5.4, ExecutionPriority)."""
        active = (self.group(self.priority[number]) for number in bits(self.active))
        level = min(active, default=LOWEST)
        basepri &= 0xF0  # the engine keeps all eight bits
        if basepri:
            level = min(level, self.group(basepri))
        if primask:
            level = min(level, 0)
        return min(level, -1) if faultmask else level

    # -- registers --------------------------------------------------------------------------------------

    def read(self, offset: int) -> int:
        """The word at an offset of the system control space (B3.4.3)."""
        if offset >= STIR:
            return 0
        if offset >= _IPR:
            first = FIRST_INTERRUPT + offset - _IPR
            return sum(priority << 8 * n for n, priority in enumerate(self.priority[first : first + 4]))
        if offset == ICTR:
            return _WORDS - 1
        word = offset & 0x7F
        masks = {_ISER: self.enabled, _ICER: self.enabled, _IABR: self.active}
        return masks.get(offset - word, self.pending) >> FIRST_INTERRUPT + 8 * word & 0xFFFF_FFFF

    def write(self, offset: int, value: int, mask: int) -> None:
        """Set-enable, clear-enable, set-pending, clear-pending, priorities, software trigger."""
        value &= mask
        if offset == STIR:
            self._trigger(value & 0x1FF)
        elif offset >= _IPR:
            self._set_priorities(offset - _IPR, value, mask)
        elif offset != ICTR:
            word = offset & 0x7F
            self._set_bits(offset - word, (value << 8 * word & _INPUTS) << FIRST_INTERRUPT)
        self._look()

    def _trigger(self, number: int) -> None:
        if number < INTERRUPTS:
            self._pend(1 << FIRST_INTERRUPT + number)

    def _set_priorities(self, first: int, value: int, mask: int) -> None:
        for byte in range(4):
            number = FIRST_INTERRUPT + first + byte
            if mask >> 8 * byte & 0xFF and number < len(self.priority):
                self.priority[number] = (value & _IMPLEMENTED) >> 8 * byte & 0xFF

    def _set_bits(self, base: int, chosen: int) -> None:
        if base == _ISER:
            self.enabled |= chosen
        elif base == _ICER:
            self.enabled &= ~chosen
        elif base == _ISPR:
            self._pend(chosen)
        elif base == _ICPR:
            self.pending &= ~chosen | self.lines & ~self.active
