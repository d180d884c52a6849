"""Small ELF files that are built byte by byte, so that tests can choose their exact contents, valid or invalid.

Structures are written here a second time, from the ELF specification 1.2 and DWARF 5 sections 6.2.4, 7.5, so that the
tested reader has an independent counterpart.
"""

from __future__ import annotations

import struct
from collections.abc import Sequence
from typing import NamedTuple

FLASH, RAM, RAM_END = 0x0800_0000, 0x2000_0000, 0x2001_0000
RESET, MAIN = 0x0800_0040, 0x0800_0060
CODE_SIZE = 0x100
ACC, COUNT, BITS = RAM, RAM + 0x40, RAM + 0x50
STATIC_FUNC, GLOBAL_FUNC, WEAK_FUNC = 0x02, 0x12, 0x22
STATIC_OBJECT, GLOBAL_OBJECT, STATIC_NOTYPE, FILE = 0x01, 0x11, 0x00, 0x04


def code(stack: int = RAM_END, reset: int = RESET | 1, size: int = CODE_SIZE) -> bytes:
    """Return contents of flash: a vector table, then NOPs."""
    return (struct.pack("<16I", stack, reset, *[RESET | 1] * 14) + b"\x00\xbf" * size)[:size]


def hex_text(data: bytes) -> bytes:
    """Return contents of flash as Intel HEX, 16 bytes a line; ``data`` must stay in the first 64 KB."""
    records = [b"\x02\0\0\x04\x08\0"]
    for at in range(0, len(data), 16):
        piece = data[at : at + 16]
        records.append(bytes([len(piece)]) + at.to_bytes(2, "big") + b"\0" + piece)
    records.append(b"\0\0\0\1")
    return b"".join(
        f":{(record + bytes([-sum(record) & 0xFF])).hex().upper()}\n".encode() for record in records
    )


class Load(NamedTuple):
    """A PT_LOAD program header and its contents."""

    physical: int
    data: bytes
    virtual: int | None = None
    memory_size: int | None = None
    type: int = 1


class Section(NamedTuple):
    name: str
    data: bytes
    type: int = 1
    flags: int = 0
    link: int = 0


def elf(
    loads: Sequence[Load] = (Load(FLASH, code()),),
    sections: Sequence[Section] = (),
    *,
    machine: int = 40,
    kind: int = 2,
    ident: bytes = b"\x7fELF\x01\x01\x01",
) -> bytes:
    """Return an ELF file. ``sections`` are numbered from 1; the table of their names comes last."""
    body = b""
    start = 52 + 32 * len(loads)
    programs = b""
    for load in loads:
        virtual = load.physical if load.virtual is None else load.virtual
        size = len(load.data) if load.memory_size is None else load.memory_size
        fields = (load.type, start + len(body), virtual, load.physical, len(load.data), size, 5, 4)
        programs += struct.pack("<8I", *fields)
        body += load.data
    headers = b""
    if sections:
        headers, body = _sections(sections, start, body)
    count = len(headers) // 40
    section_table = start + len(body) if sections else 0
    numbers = (kind, machine, 1, FLASH, 52, section_table, 0x0500_0400, 52, 32, len(loads), 40, count)
    header = ident.ljust(16, b"\0") + struct.pack("<2H5I6H", *numbers, max(count - 1, 0))
    return header + programs + body + headers


def _sections(sections: Sequence[Section], start: int, body: bytes) -> tuple[bytes, bytes]:
    names = b"\0"
    headers = bytes(40)
    for section in sections:
        fields = (len(names), section.type, section.flags, 0, start + len(body), len(section.data))
        headers += struct.pack("<10I", *fields, section.link, 0, 1, 0)
        names += section.name.encode() + b"\0"
        body += section.data
    names_at = len(names)
    names += b".shstrtab\0"
    headers += struct.pack("<10I", names_at, 3, 0, 0, start + len(body), len(names), 0, 0, 1, 0)
    return headers, body + names


def symbols(*entries: tuple[str, int, int, int]) -> tuple[Section, Section]:
    """Return sections 1 and 2, a symbol table and its strings, from (name, value, size, binding and type)."""
    strings = b"\0"
    table = bytes(16)
    for name, value, size, info in entries:
        section = 0xFFF1 if info == FILE else 1
        table += struct.pack("<3I2BH", len(strings), value, size, info, 0, section)
        strings += name.encode() + b"\0"
    return Section(".symtab", table, type=2, link=2), Section(".strtab", strings, type=3)


def uleb(value: int) -> bytes:
    out = b""
    while value >= 0x80:
        out += bytes([value & 0x7F | 0x80])
        value >>= 7
    return out + bytes([value])


def abbreviations(*entries: tuple[int, bool, Sequence[tuple[int, int]]]) -> bytes:
    """Return a table of (tag, has children, (attribute, form) pairs); codes count from 1."""
    out = b""
    for number, (tag, has_children, attributes) in enumerate(entries, 1):
        out += uleb(number) + uleb(tag) + bytes([has_children])
        out += b"".join(uleb(attribute) + uleb(form) for attribute, form in attributes) + b"\0\0"
    return out + b"\0"


def unit(entries: bytes, version: int = 4) -> bytes:
    """Return a unit of .debug_info whose abbreviations begin at 0. Entries begin at byte 11 (12 in version 5)."""
    head = struct.pack("<HBBI", 5, 1, 4, 0) if version == 5 else struct.pack("<HIB", version, 0, 4)
    return struct.pack("<I", len(head) + len(entries)) + head + entries


def line_program(code_bytes: bytes, names: bytes, version: int = 4) -> bytes:
    """Return a program of .debug_line; ``names`` are the tables of folders and files in the form of that version.

    line_base -5, line_range 14 and opcode_base 13 are GCC's values: special opcode 0x4B means "4 bytes of code and 1
    line further", with instructions counted in bytes.
    """
    tail = b"\x01" + (b"\x01" if version >= 4 else b"") + b"\x01\xfb\x0e\x0d"
    tail += bytes([0, 1, 1, 1, 1, 0, 0, 0, 1, 0, 0, 1]) + names
    head = struct.pack("<H", version) + (b"\x04\x00" if version == 5 else b"")
    head += struct.pack("<I", len(tail))
    return struct.pack("<I", len(head + tail + code_bytes)) + head + tail + code_bytes


def set_address(address: int) -> bytes:
    return b"\x00\x05\x02" + struct.pack("<I", address)


END_SEQUENCE = b"\x00\x01\x01"
_STRING, _DATA1, _REF4, _BLOCK1, _FLAG = 0x08, 0x0B, 0x13, 0x0A, 0x0C
_NAME, _SIZE, _TYPE, _ENCODING, _PLACE, _LOCATION, _HIGHEST = 0x03, 0x0B, 0x49, 0x3E, 0x38, 0x02, 0x2F
_ABBREVIATIONS = abbreviations(
    (0x11, True, [(_NAME, _STRING)]),  # 1 compile unit
    (0x24, False, [(_NAME, _STRING), (_SIZE, _DATA1), (_ENCODING, _DATA1)]),  # 2 base type
    (0x13, True, [(_SIZE, _DATA1)]),  # 3 structure
    (0x0D, False, [(_NAME, _STRING), (_TYPE, _REF4), (_PLACE, _DATA1)]),  # 4 member
    (0x34, False, [(_NAME, _STRING), (_TYPE, _REF4), (_LOCATION, _BLOCK1)]),  # 5 variable
    (0x01, True, [(_TYPE, _REF4)]),  # 6 array
    (0x21, False, [(_HIGHEST, _DATA1)]),  # 7 range
    (0x16, False, [(_NAME, _STRING), (_TYPE, _REF4)]),  # 8 typedef
)


def _entries(first: int) -> bytes:
    """Return typedef struct {int X; float F;} *at* ACC, as ``acc``; int count[3] at COUNT; starting at ``first``."""
    out = b"\x01main.c\0"

    def place() -> bytes:
        return struct.pack("<I", first + len(out))

    integer = place()
    out += b"\x02int\0\x04\x05"
    number = place()
    out += b"\x02float\0\x04\x04"
    axes = place()
    out += b"\x03\x08" + b"\x04X\0" + integer + b"\x00" + b"\x04F\0" + number + b"\x04" + b"\0"
    alias = place()
    out += b"\x08Axes\0" + axes
    table = place()
    out += b"\x06" + integer + b"\x07\x02" + b"\0"
    out += b"\x05acc\0" + alias + b"\x05\x03" + struct.pack("<I", ACC)
    out += b"\x05count\0" + table + b"\x05\x03" + struct.pack("<I", COUNT)
    return out + b"\0"


def debug_sections(version: int = 4) -> list[Section]:
    """Return symbols, lines and types of a small program: Reset_Handler, main, acc, count; in DWARF 4 or 5."""
    table, strings = symbols(
        ("main.c", 0, 0, FILE),
        ("count.1", COUNT, 12, STATIC_OBJECT),
        ("Reset_Handler", RESET | 1, 0x20, GLOBAL_FUNC),
        ("main", MAIN | 1, 0x10, GLOBAL_FUNC),
        ("acc", ACC, 8, GLOBAL_OBJECT),
    )
    program = set_address(RESET) + b"\x14\x4b" + b"\x02\x10" + END_SEQUENCE  # lines 3 and 4, then 16 bytes
    names = b"src\0\0main.c\0\x01\0\0\0"
    if version == 5:  # path as string; then path as string and directory as udata
        names = b"\x01\x01\x08\x02.\0src\0" + b"\x02\x01\x08\x02\x0f\x02main.c\0\x01main.c\0\x01"
    return [
        table,
        strings,
        Section(".debug_abbrev", _ABBREVIATIONS),
        Section(".debug_info", unit(_entries(12 if version == 5 else 11), version)),
        Section(".debug_line", line_program(program, names, version)),
    ]


def debug_elf(version: int = 4) -> bytes:
    """Return the small program with all information for a debugger."""
    return elf(sections=debug_sections(version))


def patched(data: bytes, offset: int, layout: str, *values: int) -> bytes:
    """Return ``data`` with fields overwritten at ``offset``."""
    out = bytearray(data)
    struct.pack_into(layout, out, offset, *values)
    return bytes(out)
