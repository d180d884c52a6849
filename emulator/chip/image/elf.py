"""ELF executables (Tool Interface Standard, ELF specification 1.2; ELF for the Arm Architecture, IHI 0044).

What is flashed is taken from the program headers, at their physical addresses: that is where a programmer
puts the initial values of ``.data``, for the start-up code to copy. Sections are wanted for symbols only.
"""

from __future__ import annotations

import struct
from typing import NamedTuple

from emulator.chip.image.memory_map import CAPACITY, CHIP, fits
from emulator.chip.image.sections import Sections
from emulator.chip.image.segments import Segment, check_place, join
from emulator.chip.image.symbols import Symbols
from emulator.errors import FirmwareFileError

MAGIC = b"\x7fELF"
_RIGHT = "give the ELF that arm-none-eabi-gcc links for the STM32F401"
_HEADER = struct.Struct("<16s2H5I6H")
_PROGRAM_HEADER = struct.Struct("<8I")
_SECTION_HEADER_SIZE = 40
_EXECUTABLE, _ARM = 2, 40
_LOAD, _DYNAMIC, _INTERPRETER = 1, 2, 3
_LINUX_ABI = 3
_TYPES = {
    1: "an object file (.o), not linked yet",
    3: "a shared object or position independent program",
    4: "a core dump",
}
_MACHINES = {
    2: "SPARC",
    3: "x86",
    8: "MIPS",
    20: "PowerPC",
    62: "x86-64",
    83: "AVR",
    94: "Xtensa (ESP32)",
    105: "MSP430",
    183: "64-bit ARM",
    243: "RISC-V",
}


class Elf(NamedTuple):
    """What a firmware needs of an ELF file."""

    segments: tuple[Segment, ...]
    symbols: Symbols | None
    notes: tuple[str, ...]


class _Header(NamedTuple):
    ident: bytes
    type: int
    machine: int
    version: int
    entry: int
    program_headers: int  # e_phoff
    section_headers: int  # e_shoff
    flags: int
    size: int
    program_header_size: int
    program_header_count: int
    section_header_size: int
    section_header_count: int
    names_section: int


class _ProgramHeader(NamedTuple):
    type: int
    offset: int
    virtual: int
    physical: int
    file_size: int
    memory_size: int
    flags: int
    align: int


def open_elf(file: str, data: bytes) -> Elf:
    """Contents and symbols of an executable for this chip. Raises FirmwareFileError."""
    header = _header(file, data)
    programs = _program_headers(file, data, header)
    loads = [
        program
        for program in programs
        if program.type == _LOAD and (program.memory_size or program.file_size)
    ]
    for load in loads:
        _check_load(file, data, load)
    if sum(load.file_size for load in loads) > CAPACITY:
        raise FirmwareFileError(file, f"has segments that overlap or do not fit; {CHIP}")
    pieces = [Segment(load.physical, data[load.offset : load.offset + load.file_size]) for load in loads]
    segments = join(file, pieces)
    if not segments:
        raise FirmwareFileError(file, f"loads nothing; {_RIGHT}")
    return _with_symbols(segments, data, header)


def _with_symbols(segments: tuple[Segment, ...], data: bytes, header: _Header) -> Elf:
    sections = Sections(data, header.section_headers, header.section_header_count, header.names_section)
    if ".symtab" in sections:
        return Elf(segments, Symbols(sections), ())
    reason = sections.problem or "it has no symbol table; a stripped ELF runs, but is diagnosed without names"
    return Elf(segments, None, (f"no symbols: {reason}",))


def _header(file: str, data: bytes) -> _Header:
    if len(data) < _HEADER.size:
        raise FirmwareFileError(file, f"is an ELF cut short after {len(data)} bytes; build or copy it again")
    header = _Header(*_HEADER.unpack_from(data))
    bits, order, abi = header.ident[4], header.ident[5], header.ident[7]
    machine = header.machine if order == 1 else int.from_bytes(data[18:20], "big")
    if machine != _ARM:  # the field lies at the same place in 64-bit files
        name = _MACHINES.get(machine, f"machine {machine}")
        raise FirmwareFileError(file, f"is an ELF for {name}, not for a Cortex-M4; {_RIGHT}")
    if bits != 1 or order != 1:
        raise FirmwareFileError(file, f"is no little-endian 32-bit ELF, as a Cortex-M4 needs; {_RIGHT}")
    if abi == _LINUX_ABI:
        raise FirmwareFileError(file, f"is a program for Linux on ARM; {_RIGHT}")
    if header.type != _EXECUTABLE:
        what = _TYPES.get(header.type, f"of ELF type {header.type}")
        raise FirmwareFileError(file, f"is {what}; {_RIGHT}")
    return header


def _program_headers(file: str, data: bytes, header: _Header) -> list[_ProgramHeader]:
    count, start = header.program_header_count, header.program_headers
    if count == 0:
        raise FirmwareFileError(file, f"has no program headers, so nothing to load; {_RIGHT}")
    if header.program_header_size != _PROGRAM_HEADER.size:
        problem = (
            f"has program headers of {header.program_header_size} bytes, 32 would be right; it is damaged"
        )
        raise FirmwareFileError(file, problem)
    _check_inside(file, data, "program header table", start, count * _PROGRAM_HEADER.size)
    if header.section_header_count:
        size = header.section_header_count * _SECTION_HEADER_SIZE
        _check_inside(file, data, "section header table", header.section_headers, size)
    table = data[start : start + count * _PROGRAM_HEADER.size]
    programs = [_ProgramHeader(*fields) for fields in _PROGRAM_HEADER.iter_unpack(table)]
    if any(program.type in {_DYNAMIC, _INTERPRETER} for program in programs):
        raise FirmwareFileError(file, f"is a program for Linux on ARM (dynamically linked); {_RIGHT}")
    return programs


def _check_load(file: str, data: bytes, load: _ProgramHeader) -> None:
    if load.file_size > load.memory_size:
        problem = f"has a segment of {load.file_size} bytes for {load.memory_size} of memory; it is damaged"
        raise FirmwareFileError(file, problem)
    if not fits(load.virtual, load.virtual + load.memory_size):
        last = load.virtual + load.memory_size - 1
        raise FirmwareFileError(
            file,
            f"uses memory 0x{load.virtual:08X}..0x{last:08X}; {CHIP}: is its linker script for another chip?",
        )
    if load.file_size:
        check_place(file, load.physical, load.physical + load.file_size)
        _check_inside(file, data, f"segment for 0x{load.physical:08X}", load.offset, load.file_size)


def _check_inside(file: str, data: bytes, what: str, start: int, size: int) -> None:
    if start + size > len(data):
        raise FirmwareFileError(
            file,
            f"is cut short or damaged: its {what} ends at byte {start + size}, the file at {len(data)}; "
            "build or copy it again",
        )
