"""Where Unicorn counts instructions: exact time needs the number of those executed, at every access.

Decision: read the engine's own counter. ``uc_emu_start(count=N)`` keeps the number of instructions
begun since the start in a 64-bit field of its engine structure, beside the limit N. There is no call to
read it, but it can be found: three runs of known length leave three known pairs, and only one place in
the structure holds all of them. Reading it costs 50 ns; writing the limit ends the run after the
present instruction.

Where the search fails (another build of Unicorn) a hook on every instruction counts instead, with the same
results at a hundredth of the speed. The road not taken, block hooks with the blocks' lengths, is wrong
inside a block, which is where accesses are.
"""

from __future__ import annotations

import ctypes
import struct
from collections.abc import Callable
from typing import Protocol

_SEARCHED = 2048  # bytes; the structure is larger than that
_RUNS = (37, 101, 555)

LONGEST_TRIAL = max(_RUNS) + 1
"""Instructions without effect that must be there to be run."""


class Cell(Protocol):
    """One number, shared with the engine."""

    value: int


class OwnCell:
    """A number of our own, for the engine whose counter was not found."""

    __slots__ = ("value",)

    def __init__(self) -> None:
        self.value = 0


def find(structure: int, run: Callable[[int], None]) -> tuple[Cell, Cell] | None:
    """The cells (instructions begun, limit) of the engine at address ``structure``; None if not found.

    ``run(n)`` must run exactly ``n`` instructions, which leaves the counter at n + 1: the last one
    counted is the one that was not executed any more.
    """
    candidates = set(range(0, _SEARCHED - 16, 8))
    for count in _RUNS:
        run(count)
        memory = ctypes.string_at(structure, _SEARCHED)
        wanted = (count + 1, count)
        candidates = {place for place in candidates if struct.unpack_from("<QQ", memory, place) == wanted}
    if len(candidates) != 1:
        return None
    place = structure + candidates.pop()
    return ctypes.c_uint64.from_address(place), ctypes.c_uint64.from_address(place + 8)
