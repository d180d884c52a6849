"""Breakpoints and watchpoints in the instruction engine: set when the core goes on, and if they have changed.

A debugger takes all of its points away at each stop and brings them back before it goes on; setting one has
the engine translate all code again.

Decision: a watchpoint listens in the engine to every load and store near its range, registers included: one
way for memory and peripherals, and nothing in the path of an access while there is none. The bit-band alias
of the range is listened to as well. What does not pass through the core's instructions is not seen: DMA, and
frames saved at exceptions.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator

from emulator.arm.cpu import memory_map
from emulator.arm.cpu.engine import RAM, RAM_SIZE, Engine
from emulator.arm.cpu.single_step import block_length, size_of
from emulator.arm.cpu.stop import Stop
from emulator.arm.gdb.target import Point, PointKind

_WIDEST = 8  # bytes of an access
_LONGEST_BLOCK = 2 + 3 * 4 + 2  # bytes from an IT instruction to behind the first half-word of its last one
_ALIASES = (
    (RAM, RAM_SIZE, memory_map.RAM_BITS),
    (memory_map.PERIPHERALS, memory_map.PERIPHERALS_SIZE, memory_map.PERIPHERAL_BITS),
)
_WATCHED = {
    PointKind.WRITE: (True,),
    PointKind.READ: (False,),
    PointKind.ACCESS: (False, True),
}


class Points:
    """The points that are wanted.

    ``accessed(point, address)`` is called while an access that ``point`` watches is made; ``passing()`` says
    whether breakpoints are to be left alone because the core makes a single step.
    """

    def __init__(
        self, engine: Engine, accessed: Callable[[Point, int], None], passing: Callable[[], bool]
    ) -> None:
        self._engine = engine
        self._accessed = accessed
        self._passing = passing
        self._wanted: set[Point] = set()
        self._set: dict[Point, list[int]] = {}
        self._in_blocks: dict[Point, list[int]] = {}  # where the IT blocks around breakpoints begin

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
        """Bring the engine up to date; it must not be running."""
        for point in self._set.keys() - self._wanted:
            self._in_blocks.pop(point, None)
            for handle in self._set.pop(point):
                self._engine.unwatch(handle)
        for point in self._wanted - self._set.keys():
            self._set[point] = list(self._break(point) if point.kind.is_break else self._listen(point))

    def breakpoint_at(self, address: int) -> Point | None:
        """The breakpoint on an instruction, if there is one."""
        found = (Point(kind, address, 2) for kind in (PointKind.SOFTWARE_BREAK, PointKind.HARDWARE_BREAK))
        return next((point for point in found if point in self._wanted), None)

    def in_block(self, address: int) -> bool:
        """Whether a breakpoint lies ahead in the IT block at ``address``.

        The engine executes the block as a whole; in single steps the breakpoint is not missed.
        """
        return any(
            begin <= address < point.address for point, begins in self._in_blocks.items() for begin in begins
        )

    # -- breakpoints ------------------------------------------------------------------------------------

    def _break(self, point: Point) -> Iterator[int]:
        begins = list(self._blocks(point.address))
        if begins:
            self._in_blocks[point] = begins
        for address in (point.address, *begins):
            yield self._engine.watch(address, address, self._reached)

    def _reached(self, address: int) -> None:
        del address
        if not self._passing():
            self._engine.refuse(Stop.HALT)

    def _blocks(self, address: int) -> Iterator[int]:
        """Where an IT instruction may stand whose block has ``address`` inside.

        May: the second half of an instruction can look like one. Nothing is ever executed from there.
        """
        for begin in range(address - 2, address - _LONGEST_BLOCK, -2):
            inside = begin + 2
            for _ in range(block_length(self._half_word(begin))):
                if inside == address:
                    yield begin
                inside += size_of(self._half_word(inside))

    def _half_word(self, address: int) -> int:
        code = self._engine.memory(address, 2)
        return 0 if code is None else code[0] | code[1] << 8

    # -- watchpoints ------------------------------------------------------------------------------------

    def _listen(self, point: Point) -> Iterator[int]:
        yield self._watch(point, point.address, 1)
        for base, size, alias in _ALIASES:
            if base <= point.address < base + size:
                yield self._watch(point, alias + 32 * (point.address - base), 32)

    def _watch(self, point: Point, begin: int, scale: int) -> int:
        """Listen from ``begin`` on, where ``scale`` bytes stand for one of the point's."""
        end = begin + scale * point.size
        wanted = _WATCHED[point.kind]

        def called(address: int, size: int, is_write: bool) -> None:
            if is_write in wanted and address + size > begin:
                self._accessed(point, point.address + max(address - begin, 0) // scale)

        return self._engine.watch_memory(max(begin - _WIDEST + 1, 0), end - 1, called)
