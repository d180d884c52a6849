"""ELF executables (ELF specification 1.2; ELF for the Arm Architecture, IHI 0044).

Program headers give the flash contents. Damaged sections raise DebugInfoError.
"""

from __future__ import annotations

import struct
import zlib
from typing import NamedTuple

from fcu_emulator.emulator.chip.image.segments import Segment, check_place, join
from fcu_emulator.emulator.chip.memory_map import CAPACITY, CHIP, fits
from fcu_emulator.emulator.errors import FirmwareFileError

MAGIC = b"\x7fELF"
_RIGHT = "give the ELF that arm-none-eabi-gcc links for the STM32F401"
_HEADER = struct.Struct("<16s2H5I6H")
_PROGRAM_HEADER = struct.Struct("<8I")
_SECTION_HEADER = struct.Struct("<10I")
_COMPRESSION_HEADER = struct.Struct("<3I")
_EXECUTABLE, _ARM = 2, 40
_LOAD, _DYNAMIC, _INTERPRETER = 1, 2, 3
_LINUX_ABI = 3
_HARD_FLOAT = 0x400  # EF_ARM_ABI_FLOAT_HARD
_LARGEST_UNPACKED = 64 << 20  # bytes of all decompressed sections together
_LONGEST_NAME = 64
_NOBITS = 8
_COMPRESSED = 0x800  # SHF_COMPRESSED
_ZLIB = 1
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
    """The parts of an ELF file that firmware needs."""

    segments: tuple[Segment, ...]
    sections: Sections | None
    """None if the file has no symbol table; ``note`` has the reason."""
    note: str = ""
    hard_float: bool = False
    """Whether functions take floating-point numbers in S0 to S15."""


class _ElfHeader(NamedTuple):
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
    """Return an executable for this chip. Raises FirmwareFileError."""
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
        raise FirmwareFileError(file, f"has segments that overlap or do not fit; {CHIP}", kind="overlap")
    pieces = [Segment(load.physical, data[load.offset : load.offset + load.file_size]) for load in loads]
    segments = join(file, pieces)
    if not segments:
        raise FirmwareFileError(file, f"must load code; {_RIGHT}", kind="nothing_loaded")
    sections = Sections(data, header.section_headers, header.section_header_count, header.names_section)
    hard_float = bool(header.flags & _HARD_FLOAT)
    if ".symtab" in sections:
        return Elf(segments, sections, hard_float=hard_float)
    reason = (
        sections.problem
        or "the file has no symbol table; a stripped ELF runs, but messages show addresses instead of names"
    )
    return Elf(segments, None, f"no symbols: {reason}", hard_float)


def _header(file: str, data: bytes) -> _ElfHeader:
    if len(data) < _HEADER.size:
        raise FirmwareFileError(
            file, f"is an ELF cut short after {len(data)} bytes; build or copy it again", kind="cut_short"
        )
    header = _ElfHeader(*_HEADER.unpack_from(data))
    bits, order, abi = header.ident[4], header.ident[5], header.ident[7]
    machine = header.machine if order == 1 else int.from_bytes(data[18:20], "big")
    if machine != _ARM:  # the field has the same offset in 64-bit files
        name = _MACHINES.get(machine, f"machine {machine}")
        raise FirmwareFileError(
            file, f"is an ELF for {name}, not for a Cortex-M4; {_RIGHT}", kind="wrong_machine"
        )
    if bits != 1 or order != 1:
        raise FirmwareFileError(
            file, f"must be a little-endian 32-bit ELF for a Cortex-M4; {_RIGHT}", kind="wrong_format"
        )
    if abi == _LINUX_ABI:
        raise FirmwareFileError(file, f"is a program for Linux on ARM; {_RIGHT}", kind="linux_program")
    if header.type != _EXECUTABLE:
        what = _TYPES.get(header.type, f"of ELF type {header.type}")
        raise FirmwareFileError(file, f"is {what}; {_RIGHT}", kind="wrong_type")
    return header


def _program_headers(file: str, data: bytes, header: _ElfHeader) -> list[_ProgramHeader]:
    count, start = header.program_header_count, header.program_headers
    if count == 0:
        raise FirmwareFileError(file, f"must have program headers; {_RIGHT}", kind="no_program_headers")
    if header.program_header_size != _PROGRAM_HEADER.size:
        problem = f"is damaged: its program headers have {header.program_header_size} bytes, not 32"
        raise FirmwareFileError(file, problem, kind="program_header_size")
    _check_inside(file, data, "program header table", start, count * _PROGRAM_HEADER.size)
    if header.section_header_count:
        size = header.section_header_count * _SECTION_HEADER.size
        _check_inside(file, data, "section header table", header.section_headers, size)
    table = data[start : start + count * _PROGRAM_HEADER.size]
    programs = [_ProgramHeader(*fields) for fields in _PROGRAM_HEADER.iter_unpack(table)]
    if any(program.type in {_DYNAMIC, _INTERPRETER} for program in programs):
        raise FirmwareFileError(
            file, f"is a program for Linux on ARM (dynamically linked); {_RIGHT}", kind="linux_program"
        )
    return programs


def _check_load(file: str, data: bytes, load: _ProgramHeader) -> None:
    if load.file_size > load.memory_size:
        problem = f"is damaged: it has a segment of {load.file_size} bytes in the file, but {load.memory_size} in memory"
        raise FirmwareFileError(file, problem, kind="segment_size")
    if not fits(load.virtual, load.virtual + load.memory_size):
        last = load.virtual + load.memory_size - 1
        raise FirmwareFileError(
            file,
            f"uses memory 0x{load.virtual:08X}..0x{last:08X}; {CHIP}: check its linker script",
            kind="other_chip",
        )
    if load.file_size:
        check_place(file, load.physical, load.physical + load.file_size)
        _check_inside(file, data, f"segment for 0x{load.physical:08X}", load.offset, load.file_size)


def _check_inside(file: str, data: bytes, what: str, start: int, size: int) -> None:
    if start + size > len(data):
        raise FirmwareFileError(
            file,
            f"is cut short or damaged: its {what} ends at byte {start + size}, but the file ends at byte {len(data)}; "
            "build or copy it again",
            kind="cut_short",
        )


# -- sections -----------------------------------------------------------------------------------------------


class DebugInfoError(Exception):
    """Debug information is damaged or unsupported."""


class _SectionHeader(NamedTuple):
    name: int
    type: int
    flags: int
    address: int
    offset: int
    size: int
    link: int
    info: int
    align: int
    entry_size: int


class Sections:
    """Sections of an ELF file. If several sections have the same name, the first is used."""

    def __init__(self, data: bytes, offset: int, count: int, names: int) -> None:
        self.problem: str | None = None
        self._data = data
        self._unpacked = 0
        self._headers: list[_SectionHeader] = []
        self._by_name: dict[bytes, _SectionHeader] = {}
        table = data[offset : offset + count * _SECTION_HEADER.size]
        if len(table) == count * _SECTION_HEADER.size:
            self._headers = [_SectionHeader(*fields) for fields in _SECTION_HEADER.iter_unpack(table)]
        if names < len(self._headers):
            self._name_all(self._headers[names])
        elif count:
            self.problem = "the table of section names is missing"

    def __contains__(self, name: str) -> bool:
        return name.encode() in self._by_name

    def get(self, name: str) -> bytes:
        """Return a section's contents, decompressed; b"" if it is missing. Raises DebugInfoError."""
        header = self._by_name.get(name.encode())
        if header is not None:
            raw = self._contents(header, name)
            return self._unpack(raw, name) if header.flags & _COMPRESSED else raw
        old_style = ".z" + name.removeprefix(".")  # GNU's older compression format
        header = self._by_name.get(old_style.encode())
        return b"" if header is None else self._unpack_old(self._contents(header, old_style), old_style)

    def linked(self, name: str) -> bytes:
        """Return the section to which section ``name`` links, such as a symbol table's strings."""
        header = self._by_name[name.encode()]
        if header.link >= len(self._headers):
            raise DebugInfoError(f"{name} links to section {header.link}, which does not exist")
        return self._contents(self._headers[header.link], f"the strings of {name}")

    def _name_all(self, names: _SectionHeader) -> None:
        try:
            strings = self._contents(names, "the table of section names")
        except DebugInfoError as problem:
            self.problem = str(problem)
            return
        for header in self._headers:
            self._by_name.setdefault(string_at(strings, header.name, _LONGEST_NAME), header)

    def _contents(self, header: _SectionHeader, name: str) -> bytes:
        if header.type == _NOBITS:
            return b""
        if header.offset + header.size > len(self._data):
            raise DebugInfoError(f"{name} reaches beyond the end of the file")
        return self._data[header.offset : header.offset + header.size]

    def _unpack(self, raw: bytes, name: str) -> bytes:
        """Decompress a section (ELF generic ABI, "Section Compression")."""
        if len(raw) < _COMPRESSION_HEADER.size:
            raise DebugInfoError(f"{name} is cut short")
        method, size, _ = _COMPRESSION_HEADER.unpack_from(raw)
        if method != _ZLIB:
            raise DebugInfoError(
                f"{name} is packed with method {method}; link with --compress-debug-sections=none"
            )
        return self._inflate(raw[_COMPRESSION_HEADER.size :], size, name)

    def _unpack_old(self, raw: bytes, name: str) -> bytes:
        if raw[:4] != b"ZLIB" or len(raw) < 12:
            raise DebugInfoError(f"{name} does not begin with ZLIB and its size")
        return self._inflate(raw[12:], int.from_bytes(raw[4:12], "big"), name)

    def _inflate(self, packed: bytes, size: int, name: str) -> bytes:
        self._unpacked += size
        if self._unpacked > _LARGEST_UNPACKED:
            raise DebugInfoError(
                f"{name} unpacks to {size} bytes; all sections together may have at most {_LARGEST_UNPACKED}"
            )
        try:
            data = zlib.decompressobj().decompress(packed, max(size, 1))
        except zlib.error:
            raise DebugInfoError(f"{name} cannot be unpacked") from None
        if len(data) != size:
            raise DebugInfoError(f"{name} unpacks to a size other than its announced size")
        return data


def string_at(strings: bytes, offset: int, longest: int) -> bytes:
    """Return the zero-terminated string, cut after ``longest`` bytes."""
    end = strings.find(b"\0", offset, offset + longest)
    return strings[offset : end if end >= 0 else offset + longest]


def printable(raw: bytes) -> str:
    """Return a name without characters that could control the terminal."""
    text = raw.decode("utf-8", "replace")
    return text if text.isprintable() else "".join(sign if sign.isprintable() else "?" for sign in text)
