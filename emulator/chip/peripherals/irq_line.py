"""Interrupt inputs that several blocks share (RM0368 table 38: TIM1_BRK and TIM9 are both number 24)."""

from __future__ import annotations

from emulator.chip.soc import Soc


class IrqLine:
    """One NVIC input, active while any of its sources is: the OR gate in front of the NVIC.

    Blocks that share a number share the object; each gives itself a ``source`` name.
    """

    def __init__(self, soc: Soc, number: int) -> None:
        self.number = number
        self._soc = soc
        self._active: set[str] = set()

    def set(self, source: str, level: bool) -> None:
        """``source`` is active or not; the NVIC hears of changes only."""
        if level == (source in self._active):
            return
        before = bool(self._active)
        if level:
            self._active.add(source)
        else:
            self._active.discard(source)
        if bool(self._active) is not before:
            self._soc.irq.set_line(self.number, not before)
