"""A firmware as it would be flashed, and the checks of its vector table.

The vector table at the start of flash says where execution begins, as in the chip: after reset the core takes
its stack pointer from the first word and its program counter from the second (PM0214 2.3.4, ARMv7-M ARM
B1.5.5). The entry address that an ELF or HEX file states is meant for debuggers and is not used.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

from emulator.chip.image.memory_map import FLASH, RAM
from emulator.chip.image.segments import Segment
from emulator.chip.image.symbols import Symbols
from emulator.errors import FirmwareFileError

Kind = Literal["elf", "hex", "bin"]


@dataclass(frozen=True)
class FirmwareImage:
    """What a firmware file holds. ``path`` is the file as the user named it."""

    path: Path
    kind: Kind
    segments: tuple[Segment, ...] = field(repr=False)
    """Contents of flash (and RAM, if the file has any) by rising physical address; they do not overlap."""
    stack_pointer: int
    """Word 0 of the vector table."""
    reset_vector: int
    """Word 1: address of the reset handler, bit 0 set (Thumb)."""
    symbols: Symbols | None
    """None if the file has none: HEX, BIN, or a stripped ELF."""
    notes: tuple[str, ...] = ()
    """What a user should know though it is no error, one line each."""


def checked(
    path: Path,
    kind: Kind,
    segments: tuple[Segment, ...],
    symbols: Symbols | None = None,
    notes: tuple[str, ...] = (),
) -> FirmwareImage:
    """The image, if it can start. Raises FirmwareFileError when its vector table cannot be right."""
    file = str(path)
    table = next((one for one in segments if one.address <= FLASH.start < one.end), None)
    if table is None or len(table.data) < 8:
        raise FirmwareFileError(
            file,
            f"has no vector table at 0x{FLASH.start:08X}, where the core starts; "
            "link .isr_vector to the start of flash (no boot loader runs here)",
        )
    stack_pointer, reset_vector = struct.unpack_from("<II", table.data)
    if not RAM.start < stack_pointer <= RAM.end:
        raise FirmwareFileError(
            file,
            f"is not firmware for this board: its vector table begins with the stack pointer "
            f"0x{stack_pointer:08X}, which must lie in {RAM} (its end is 0x{RAM.end:08X})",
        )
    _check_reset(file, reset_vector, segments)
    return FirmwareImage(path, kind, segments, stack_pointer, reset_vector, symbols, notes)


def _check_reset(file: str, vector: int, segments: tuple[Segment, ...]) -> None:
    """A Cortex-M executes Thumb only: an even address in the table faults at once (ARMv7-M ARM B1.5.3)."""
    start = vector & ~1
    if not FLASH.holds(start, start + 2):
        raise FirmwareFileError(
            file, f"is not firmware for this board: its reset vector 0x{vector:08X} must lie in {FLASH}"
        )
    if vector == start:
        raise FirmwareFileError(
            file,
            f"has the even reset vector 0x{vector:08X}; a Cortex-M needs bit 0 set: "
            "compile with -mthumb, declare the handler as a function (.type Reset_Handler, %function)",
        )
    if not any(segment.address <= start and start + 2 <= segment.end for segment in segments):
        raise FirmwareFileError(
            file, f"has nothing at its reset vector 0x{vector:08X}; is it cut short, or the wrong file?"
        )
