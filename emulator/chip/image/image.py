"""The contents of a firmware file, as they would be written to flash.

The vector table gives the initial stack pointer and program counter (PM0214 2.3.4, ARMv7-M ARM
B1.5.5).

Decision: the kind of a file is determined from its contents, because the suffix is only a name.
"""

from __future__ import annotations

import stat
import struct
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

from fcu_emulator.emulator.chip.image.elf import MAGIC, open_elf
from fcu_emulator.emulator.chip.image.intel_hex import looks_like_hex, read_hex
from fcu_emulator.emulator.chip.image.segments import Segment
from fcu_emulator.emulator.chip.image.symbols import Symbols
from fcu_emulator.emulator.chip.memory_map import CHIP, FLASH_MEMORY, RAM_MEMORY
from fcu_emulator.emulator.errors import FirmwareFileError

_LARGEST_RAM = 512 * 1024  # bytes in the largest chip with the same memory map

Kind = Literal["elf", "hex", "bin"]


@dataclass(frozen=True)
class FirmwareImage:
    """The contents of a firmware file."""

    path: Path
    kind: Kind
    segments: tuple[Segment, ...] = field(repr=False)
    """Sorted by physical address, without overlaps."""
    stack_pointer: int
    """The initial stack pointer, word 0 of the vector table."""
    reset_vector: int
    """Word 1 of the vector table: the reset handler's address, with bit 0 set (Thumb)."""
    symbols: Symbols | None
    """None for HEX, BIN, or a stripped ELF."""
    hard_float: bool = False
    """Whether functions take floating-point numbers in S0 to S15 (EF_ARM_ABI_FLOAT_HARD, IHI 0044)."""
    notes: tuple[str, ...] = ()
    """Notes for the user, one line each."""

    def code(self, address: int, size: int) -> memoryview | None:
        """Return ``size`` bytes of the file's contents; None if they are not all in one segment."""
        for segment in self.segments:
            if segment.address <= address and address + size <= segment.end:
                return memoryview(segment.data)[address - segment.address :][:size]
        return None


def checked(
    path: Path,
    kind: Kind,
    segments: tuple[Segment, ...],
    symbols: Symbols | None = None,
    notes: tuple[str, ...] = (),
    hard_float: bool = False,
) -> FirmwareImage:
    """Return the image. Raises FirmwareFileError for an invalid vector table."""
    file = str(path)
    table = next((one for one in segments if one.address <= FLASH_MEMORY.start < one.end), None)
    if table is None or len(table.data) < 8:
        raise FirmwareFileError(
            file,
            f"must have a vector table at 0x{FLASH_MEMORY.start:08X}, the start address of the core; "
            "link .isr_vector to the start of flash (no boot loader runs here)",
            kind="no_vector_table",
        )
    stack_pointer, reset_vector = struct.unpack_from("<II", table.data)
    if table.data.startswith(b"\x7fELF"):
        raise FirmwareFileError(
            file,
            "has an ELF header where the vector table must be: the linker script puts the file's headers into flash",
            kind="header_in_flash",
        )
    if RAM_MEMORY.end < stack_pointer <= RAM_MEMORY.start + _LARGEST_RAM and not stack_pointer % 1024:
        raise FirmwareFileError(
            file,
            f"is linked for {(stack_pointer - RAM_MEMORY.start) // 1024} KB of RAM: its stack begins at "
            f"0x{stack_pointer:08X}; {CHIP}",
            kind="stack_pointer",
        )
    if not RAM_MEMORY.start < stack_pointer <= RAM_MEMORY.end:
        other = kind == "bin" and path.suffix.lower() not in {"", ".bin"}
        what = "is not a valid ELF, HEX or BIN firmware file" if other else "is not firmware"
        raise FirmwareFileError(
            file,
            f"{what} for this board: its vector table begins with the stack pointer "
            f"0x{stack_pointer:08X}, which must lie in {RAM_MEMORY} (its end is 0x{RAM_MEMORY.end:08X})",
            kind="stack_pointer",
        )
    _check_reset(file, reset_vector, segments)
    return FirmwareImage(path, kind, segments, stack_pointer, reset_vector, symbols, hard_float, notes)


def _check_reset(file: str, vector: int, segments: tuple[Segment, ...]) -> None:
    """Check that the reset vector is odd (ARMv7-M ARM B1.5.3) and points to code in flash."""
    start = vector & ~1
    if not FLASH_MEMORY.holds(start, start + 2):
        raise FirmwareFileError(
            file,
            f"is not firmware for this board: its reset vector 0x{vector:08X} must lie in {FLASH_MEMORY}",
            kind="reset_outside_flash",
        )
    if vector == start:
        raise FirmwareFileError(
            file,
            f"must have a reset vector with bit 0 set, not 0x{vector:08X}; "
            "compile with -mthumb, and declare the handler as a function (.type Reset_Handler, %function)",
            kind="reset_even",
        )
    if not any(segment.address <= start and start + 2 <= segment.end for segment in segments):
        raise FirmwareFileError(
            file,
            f"has no code at its reset vector 0x{vector:08X}; build or copy it again",
            kind="reset_nothing",
        )


# -- from a path to an image --------------------------------------------------------------------------------

LONGEST_FILE = 64 << 20  # bytes; ST's stock firmware with debug information has 4 MB


def load_firmware(path: str | Path) -> FirmwareImage:
    """Return the firmware in an ELF, HEX or binary file. Raises FirmwareFileError."""
    return parse_firmware(_contents(Path(path)), path)


def parse_firmware(data: bytes, path: str | Path) -> FirmwareImage:
    """Return the firmware in ``data``; ``path`` is used in messages."""
    path = Path(path)
    file = str(path)
    if not data:
        raise FirmwareFileError(file, "is empty; give the ELF, HEX or BIN file of the build", kind="empty")
    if len(data) > LONGEST_FILE:
        raise FirmwareFileError(
            file, f"must have at most {LONGEST_FILE} bytes, not {len(data)}", kind="too_long"
        )
    if data.startswith(MAGIC):
        elf = open_elf(file, data)
        symbols = Symbols(elf.sections) if elf.sections else None
        return checked(path, "elf", elf.segments, symbols, (elf.note,) if elf.note else (), elf.hard_float)
    if looks_like_hex(data):
        return checked(path, "hex", read_hex(file, data))
    return checked(path, "bin", read_binary(file, data))


def _contents(path: Path) -> bytes:
    try:
        status = path.stat()
        if stat.S_ISDIR(status.st_mode):
            raise FirmwareFileError(
                str(path), "must be a file, not a folder; give the ELF, HEX or BIN file in it", kind="folder"
            )
        if not stat.S_ISREG(status.st_mode):
            raise FirmwareFileError(
                str(path), "must be a regular file; give an ELF, HEX or BIN file", kind="not_a_file"
            )
        if status.st_size > LONGEST_FILE:
            problem = f"must have at most {LONGEST_FILE} bytes, not {status.st_size}"
            raise FirmwareFileError(str(path), problem, kind="too_long")
        with path.open("rb") as file:
            return file.read(LONGEST_FILE + 1)
    except FileNotFoundError:
        raise FirmwareFileError(
            str(path), "does not exist; give the ELF, HEX or BIN file to run", kind="no_such_file"
        ) from None
    except (OSError, ValueError) as problem:  # ValueError: a zero byte in the path
        reason = getattr(problem, "strerror", None) or problem
        raise FirmwareFileError(str(path), f"cannot read the file: {reason}", kind="unreadable") from None


# -- raw binary files ---------------------------------------------------------------------------------------

_FOREIGN = {
    b"MZ": "a Windows program",
    b"PK\x03\x04": "a ZIP archive; unpack it and give the ELF, HEX or BIN inside",
    b"!<arch>\n": "a static library (.a); link it into an ELF",
    b"UF2\n": "a UF2 file; give the ELF, HEX or BIN of the same build",
    b"\xcf\xfa\xed\xfe": "a macOS program",
    b"\x1f\x8b": "a gzip archive; unpack it and give the ELF, HEX or BIN inside",
}
_S_RECORDS = (b"S0", b"S1", b"S2", b"S3")
_TEXT_BYTES = frozenset(range(0x20, 0x7F)) | frozenset(b"\t\n\r\f")
_TEXT_SAMPLE = 256  # bytes; a vector table contains bytes of value 0, so it never looks like text


def read_binary(file: str, data: bytes) -> tuple[Segment, ...]:
    """Return the bytes of the file as contents of flash. Raises FirmwareFileError."""
    problem = _foreign(data)
    if problem:
        raise FirmwareFileError(file, problem, kind="other_file")
    size = FLASH_MEMORY.end - FLASH_MEMORY.start
    if len(data) > size:
        raise FirmwareFileError(
            file,
            f"must have at most {size} bytes as contents of flash, not {len(data)}",
            kind="too_long",
        )
    return (Segment(FLASH_MEMORY.start, data),)


def _foreign(data: bytes) -> str | None:
    for magic, what in _FOREIGN.items():
        if data.startswith(magic):
            return f"is {what}"
    if data.startswith(_S_RECORDS) and _TEXT_BYTES.issuperset(data[:_TEXT_SAMPLE]):
        return "holds Motorola S-records; convert it: arm-none-eabi-objcopy -I srec -O ihex"
    if _TEXT_BYTES.issuperset(data[:_TEXT_SAMPLE]):
        return "is a text file; give the ELF, HEX or BIN file of the build"
    return None
