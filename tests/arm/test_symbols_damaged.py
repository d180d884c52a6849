"""Symbols and debug information that are compressed, damaged or hostile."""

from __future__ import annotations

import struct
import zlib

import pytest

from fcu_emulator.emulator.chip.image.dwarf import Budget
from tests.support.arm.elf_builder import (
    ACC,
    END_SEQUENCE,
    GLOBAL_FUNC,
    MAIN,
    RESET,
    debug_sections,
    line_program,
    symbols,
    uleb,
    unit,
)
from tests.support.arm.symbol_programs import contents, loaded, memory, named, replaced
from tests.support.words import Words


@pytest.mark.parametrize("name", [".debug_info", ".debug_line", ".debug_abbrev"])
def test_compressed_sections_are_decompressed(name: str) -> None:
    """ELF generic ABI, "Section Compression": SHF_COMPRESSED, type 1 (zlib), size, alignment."""
    data = contents(name)
    header = struct.pack("<3I", 1, len(data), 1)

    new = replaced(name, header + zlib.compress(data), flags=0x800)
    old = replaced(
        name, b"ZLIB" + len(data).to_bytes(8, "big") + zlib.compress(data), new_name=name.replace(".", ".z")
    )

    for program in (new, old):
        assert str(program.line_at(RESET)) == "main.c:3"
        assert program.read_variable("acc", memory).X == -44


BOMB = zlib.compress(bytes(80 << 20), 1)


@pytest.mark.parametrize(
    "packed",
    [
        struct.pack("<3I", 1, 80 << 20, 1) + BOMB,  # more than is allowed
        struct.pack("<3I", 1, 0xFFFF_FFFF, 1) + b"x",
        struct.pack("<3I", 1, 1000, 1) + BOMB,  # cut short
        struct.pack("<3I", 1, 10, 1) + zlib.compress(b"12"),  # another size
        struct.pack("<3I", 1, 10, 1) + b"no zlib",
        struct.pack("<3I", 2, 10, 1) + b"zstd",  # method 2
        b"\1\0",  # no whole header
    ],
)
def test_compressed_section_cannot_exhaust_memory(packed: bytes, words: Words) -> None:
    program = replaced(".debug_line", packed, flags=0x800)

    assert program.line_at(RESET) is None
    (note,) = program.notes
    words("firmware_file", note)


FOREVER = b"\xff" * 9 + b"\x0f"  # 2**64 - 1


@pytest.mark.parametrize(
    "names",
    [
        b"\x00" + FOREVER,
        b"\x01\x01\x19" + FOREVER,  # entries of a flag that takes no bytes
        b"\x01\x01\x08" + FOREVER + b"a\0b\0",
        b"\x01" + b"\x80" * 5000,  # a number without end
        b"\x01\x01\x08\x01" + b"a" * 5000,  # a string without end
        b"\x01\x01\x0e\x01\xff\xff\xff\xff",
    ],
)
def test_endless_file_table_is_refused_at_once(names: bytes, words: Words) -> None:
    program = replaced(".debug_line", line_program(END_SEQUENCE, names, 5))

    assert program.line_at(RESET) is None
    assert program.work < 1000
    words("firmware_file", program.notes[0])


@pytest.mark.parametrize(
    ("name", "data"),
    [
        (".debug_line", b"\xff\xff\xff\xff" + bytes(20)),  # 64-bit format
        (".debug_line", b"\x00"),
        (".debug_line", b"\x10\0\0\0\x09\0" + bytes(14)),  # version 9
        (".debug_info", b"\x10\0\0\0\x09\0" + bytes(14)),
        (".debug_info", b"\x08\0\0\0\x04\0\0\0\0\0\x08\0"),  # addresses of 8 bytes
        (".debug_abbrev", b""),
        (".debug_abbrev", b"\0"),  # code 1 is missing
        (".debug_abbrev", contents(".debug_abbrev").replace(b"\x03\x08", b"\x03\x7f")),  # form 0x7F
    ],
)
def test_damaged_debug_information_is_noted(name: str, data: bytes, words: Words) -> None:
    program = replaced(name, data)

    assert program.function_at(MAIN).name == "main"
    if name == ".debug_line":
        assert program.line_at(RESET) is None
        assert program.read_variable("acc", memory).X == -44
    else:
        assert str(program.line_at(RESET)) == "main.c:3"
        with pytest.raises(KeyError, match="'acc'"):
            program.read_variable("acc", memory)
    (note,) = program.notes
    words("firmware_file", note)


def test_line_range_of_zero_is_noted_as_damage(words: Words) -> None:
    data = contents(".debug_line").replace(b"\xfb\x0e\x0d", b"\xfb\x00\x0d")

    program = replaced(".debug_line", data)

    assert program.line_at(RESET) is None
    (note,) = program.notes
    words("firmware_file", note)


def in_a_circle() -> bytes:
    """Return information in which the alias Axes refers to itself."""
    info = contents(".debug_info")
    at = info.index(b"\x08Axes\0")
    return info[: at + 6] + struct.pack("<I", at) + info[at + 10 :]


def with_member(place: int, offset: int) -> bytes:
    """Return information in which member F has another type, at ``place`` in the unit, or another offset."""
    info = contents(".debug_info")
    at = info.index(b"\x04F\0") + 3
    return info[:at] + struct.pack("<IB", place, offset) + info[at + 5 :]


def place_of(entry: bytes) -> int:
    return contents(".debug_info").index(entry)


@pytest.mark.parametrize(
    "info",
    [
        in_a_circle(),
        with_member(place_of(b"\x03\x08"), 0),  # contains itself
        with_member(place_of(b"\x02float"), 5),  # F does not fit
        with_member(place_of(b"\x02float"), 255),
        with_member(place_of(b"\x06"), 0),
        with_member(0, 0),  # out of the unit
        with_member(0xFFFF_FFFF, 0),
        with_member(place_of(b"\x05acc"), 0),  # a variable as a type
        contents(".debug_info").replace(b"float\0\x04\x04", b"float\0\x05\x04"),  # 5 bytes
        contents(".debug_info").replace(b"int\0\x04\x05", b"int\0\x00\x05"),  # 0 bytes
        contents(".debug_info").replace(b"int\0\x04\x05", b"int\0\x04\x7f"),  # encoding 127
    ],
)
def test_impossible_types_have_no_value(info: bytes, words: Words) -> None:
    with pytest.raises(KeyError) as caught:
        replaced(".debug_info", info).read_variable("acc", memory)
    words("firmware_file", caught.value.args[0])


def test_endlessly_nested_types_are_refused(words: Words) -> None:
    """A thousand aliases each refer to the next, which no C program has. The depth of Python's stack is limited."""
    chain = b"".join(b"\x08\0" + struct.pack("<I", 13 + 6 * (number + 1)) for number in range(1000))
    info = unit(
        b"\x01\0" + chain + b"\x05acc\0" + struct.pack("<I", 13) + b"\x05\x03" + struct.pack("<I", ACC)
    )

    with pytest.raises(KeyError) as caught:
        replaced(".debug_info", info).read_variable("acc", memory)
    words("firmware_file", caught.value.args[0])


def test_too_long_name_is_cut() -> None:
    table, strings = symbols(("a" * 100_000, MAIN | 1, 4, GLOBAL_FUNC))
    program = loaded(table, strings._replace(data=strings.data[:-1]))

    assert program.function_at(MAIN).name == "a" * 256


def test_too_many_symbols_are_not_read(words: Words) -> None:
    table, strings = symbols(("main", MAIN | 1, 4, GLOBAL_FUNC))
    program = loaded(table._replace(data=table.data * 140_000), strings)

    assert program.function_at(MAIN) is None
    (note,) = program.notes
    words("firmware_file", note)


def test_names_have_no_control_characters() -> None:
    program = named(("\x1b[2Jma\nin", MAIN | 1, 4, GLOBAL_FUNC))

    assert program.function_at(MAIN).name == "?[2Jma?in"


@pytest.mark.parametrize("link", [99, 0xFFFF_FFFF])
def test_symbol_table_without_strings_is_noted(link: int, words: Words) -> None:
    table, strings = symbols(("main", MAIN | 1, 4, GLOBAL_FUNC))
    program = loaded(table._replace(link=link), strings)

    assert program.function_at(MAIN) is None
    assert str(link) in program.notes[0]
    words("firmware_file", program.notes[0])


def test_huge_shared_abbreviation_exceeds_budget(monkeypatch: pytest.MonkeyPatch, words: Words) -> None:
    """Each of ten thousand entries of one byte has three thousand attributes that take no bytes."""
    monkeypatch.setattr(Budget, "LIMIT", 100_000)
    attributes = b"\x02\x19" * 3_000
    table = uleb(1) + uleb(0x34) + b"\0" + attributes + b"\0\0\0"
    sections = [
        section._replace(data={".debug_abbrev": table, ".debug_info": unit(b"\x01" * 10_000)}[section.name])
        if section.name in {".debug_abbrev", ".debug_info"}
        else section
        for section in debug_sections()
    ]
    program = loaded(*sections)

    with pytest.raises(KeyError, match="'acc'"):
        program.read_variable("acc", memory)
    assert "100000" in program.notes[0]
    words("firmware_file", program.notes[0])
