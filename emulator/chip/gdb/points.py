"""Breakpoints and watchpoints: set in the core when it goes on, and if they have changed.

A debugger takes all of its points away at each stop and brings them back before it goes on.

Decision: watchpoints listen to every load and store in one range that covers all of them, registers included:
one way for memory and peripherals, and nothing in the path of an access while there is none. The bit-band
alias of the range is listened to as well. What does not pass through the core's instructions is not seen:
DMA, and frames saved at exceptions.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator

from emulator.chip.cpu import memory_map
from emulator.chip.cpu.core import Core
from emulator.chip.cpu.memory_map import RAM, RAM_SIZE
from emulator.chip.gdb.target import Point, PointKind

_WIDEST = 8  # bytes of an access
_ALIASES = (
    (RAM, RAM_SIZE, memory_map.RAM_BITS),
    (memory_map.PERIPHERALS, memory_map.PERIPHERALS_SIZE, memory_map.PERIPHERAL_BITS),
)
_WATCHED = {
    PointKind.WRITE: (True,),
    PointKind.READ: (False,),
    PointKind.ACCESS: (False, True),
}
_Range = tuple[Point, int, int, int]
"""A watchpoint, its first address, the address after its last one, bytes there for each of the point's."""


class Points:
    """The points that are wanted. ``accessed(point, address)`` is called while an access is made that
    ``point`` watches.
    """

    def __init__(self, core: Core, accessed: Callable[[Point, int], None]) -> None:
        self._core = core
        self._accessed = accessed
        self._wanted: set[Point] = set()
        self._set: set[Point] = set()
        self._ranges: list[_Range] = []
        core.on_access = self._on_access

    def add(self, point: Point) -> None:
        """Stop there from the next ``set()`` on."""
        self._wanted.add(point)

    def remove(self, point: Point) -> None:
        """Likewise, no more."""
        self._wanted.discard(point)

    def clear(self) -> None:
        """Take all of them away at once."""
        self._wanted.clear()
        self.set()

    def set(self) -> None:
        """Bring the core up to date; it must not be running."""
        if self._set == self._wanted:
            return
        breaks = {point.address for point in self._wanted if point.kind.is_break}
        for address in {point.address for point in self._set if point.kind.is_break} ^ breaks:
            self._core.set_breakpoint(address, address in breaks)
        self._set = set(self._wanted)
        self._ranges = [one for point in self._wanted if not point.kind.is_break for one in _ranges(point)]
        if self._ranges:
            begin = min(begin for _, begin, _, _ in self._ranges)
            self._core.watch_memory(
                max(begin - _WIDEST + 1, 0), max(end for _, _, end, _ in self._ranges) - 1
            )
        else:
            self._core.unwatch_memory()

    def breakpoint_at(self, address: int) -> Point | None:
        """The breakpoint on an instruction, if there is one."""
        found = (Point(kind, address, 2) for kind in (PointKind.SOFTWARE_BREAK, PointKind.HARDWARE_BREAK))
        return next((point for point in found if point in self._wanted), None)

    def _on_access(self, address: int, size: int, written: bool) -> None:
        for point, begin, end, scale in self._ranges:
            if begin < address + size and address < end and written in _WATCHED[point.kind]:
                self._accessed(point, point.address + max(address - begin, 0) // scale)


def _ranges(point: Point) -> Iterator[_Range]:
    yield point, point.address, point.address + point.size, 1
    for base, size, alias in _ALIASES:
        if base <= point.address < base + size:
            begin = alias + 32 * (point.address - base)
            yield point, begin, begin + 32 * point.size, 32
