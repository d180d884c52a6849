"""Pieces of memory contents with their addresses."""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

from fcu_emulator.emulator.chip.memory_map import CHIP, fits
from fcu_emulator.emulator.errors import FirmwareFileError


class Segment(NamedTuple):
    """Bytes at a physical address."""

    address: int
    data: bytes

    @property
    def end(self) -> int:
        return self.address + len(self.data)


def join(file: str, pieces: Iterable[Segment]) -> tuple[Segment, ...]:
    """Sort pieces by address and join neighbours. Raises FirmwareFileError for overlaps or wrong addresses."""
    runs: list[tuple[int, list[bytes]]] = []
    end = -1
    for piece in sorted(piece for piece in pieces if piece.data):
        check_place(file, piece.address, piece.end)
        if piece.address < end:
            raise FirmwareFileError(
                file,
                f"has different contents for address 0x{piece.address:08X}; build it again, from one linker script",
                kind="overlap",
            )
        if piece.address != end:
            runs.append((piece.address, []))
        runs[-1][1].append(piece.data)
        end = piece.end
    return tuple(Segment(address, b"".join(parts)) for address, parts in runs)


def check_place(file: str, start: int, end: int) -> None:
    """Raise FirmwareFileError unless flash or RAM contains [start, end)."""
    if not fits(start, end):
        raise FirmwareFileError(
            file, f"has contents for 0x{start:08X}..0x{end - 1:08X}; {CHIP}", kind="other_chip"
        )
