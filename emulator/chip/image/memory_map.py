"""Where firmware may lie in an STM32F401CC: 256 KB of flash, 64 KB of RAM (datasheet DS9716, section 5)."""

from __future__ import annotations

from typing import NamedTuple


class Region(NamedTuple):
    """A block of memory: ``start`` inclusive, ``end`` exclusive."""

    name: str
    start: int
    end: int

    def holds(self, start: int, end: int) -> bool:
        """Whether [start, end) lies inside."""
        return self.start <= start <= end <= self.end

    def __str__(self) -> str:
        return f"{self.name} 0x{self.start:08X}..0x{self.end - 1:08X}"


FLASH = Region("flash", 0x0800_0000, 0x0804_0000)
RAM = Region("RAM", 0x2000_0000, 0x2001_0000)
CAPACITY = (FLASH.end - FLASH.start) + (RAM.end - RAM.start)
CHIP = f"this board's STM32F401CC has {FLASH} and {RAM}"


def fits(start: int, end: int) -> bool:
    """Whether [start, end) lies inside flash or inside RAM."""
    return FLASH.holds(start, end) or RAM.holds(start, end)
