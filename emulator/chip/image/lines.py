"""The source line of an address."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Iterable
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from emulator.chip.image.line_program import Sequence


_LAST_LINE = 0x7FFF_FFFF  # beyond is a negative number: a damaged table


class SourceLine(NamedTuple):
    """A line of a source file, ``path`` as the compiler saw it; printed as ``main.c:12``."""

    path: str
    line: int

    @property
    def file(self) -> str:
        """The path's last part; firmware built on Windows has backslashes."""
        return self.path.replace("\\", "/").rpartition("/")[2]

    def __str__(self) -> str:
        return f"{self.file}:{self.line}"


class LineTable:
    """Finds the line of an address among ``sequences``.

    Sequences that begin at address 0 are left out: they belong to functions that the linker has removed
    (``--gc-sections``), and flash is never run at its alias there.
    """

    def __init__(self, sequences: Iterable[Sequence]) -> None:
        found = [one for one in sequences if one.addresses and one.addresses[0] != 0]
        self._sequences = sorted(found, key=lambda one: one.addresses[0])
        self._starts = [one.addresses[0] for one in self._sequences]

    def line_at(self, address: int) -> SourceLine | None:
        """The line that the instruction at ``address`` (bit 0 is ignored) was made of; None if unknown."""
        address &= ~1
        index = bisect_right(self._starts, address) - 1
        if index < 0 or address >= self._sequences[index].end:
            return None
        sequence = self._sequences[index]
        row = bisect_right(sequence.addresses, address) - 1
        line, file = sequence.lines[row], sequence.files[row] - sequence.first_file
        if not 0 < line <= _LAST_LINE or not 0 <= file < len(sequence.paths):
            return None
        return SourceLine(sequence.paths[file], line)
