"""Names, lines and variables of programs that tests generate."""

from __future__ import annotations

import struct

import pytest

from fcu_emulator.emulator.chip.image import parse_firmware
from fcu_emulator.emulator.errors import SymbolError
from tests.support.arm.elf_builder import (
    ACC,
    COUNT,
    END_SEQUENCE,
    FILE,
    FLASH,
    GLOBAL_FUNC,
    GLOBAL_OBJECT,
    MAIN,
    RAM,
    RESET,
    STATIC_FUNC,
    STATIC_NOTYPE,
    STATIC_OBJECT,
    WEAK_FUNC,
    debug_elf,
    debug_sections,
    line_program,
    set_address,
    uleb,
)
from tests.support.arm.symbol_programs import contents, loaded, memory, named, replaced
from tests.support.words import Words

# functions


def test_address_is_found_in_function_with_offset() -> None:
    program = loaded(*debug_sections())

    assert program.function_at(MAIN) == ("main", MAIN, 0x10, 0)
    assert program.function_at(RESET + 0x1E) == ("Reset_Handler", RESET, 0x20, 0x1E)
    assert program.function_at(MAIN + 5) == ("main", MAIN, 0x10, 4)  # bit 0 of a return address is Thumb's


@pytest.mark.parametrize("address", [0, FLASH, RESET - 2, MAIN + 0x10, RAM, 0xFFFF_FFFE])
def test_address_outside_every_function_has_no_function(address: int) -> None:
    assert loaded(*debug_sections()).function_at(address) is None


def test_function_without_size_extends_to_next_function() -> None:
    """Hand-written assembly often has no .size. The last function reaches to the end of flash."""
    program = named(("first", RESET | 1, 0, GLOBAL_FUNC), ("last", MAIN | 1, 0, GLOBAL_FUNC))

    assert program.function_at(MAIN - 2) == ("first", RESET, MAIN - RESET, MAIN - 2 - RESET)
    assert program.function_at(0x0803_FFFE).name == "last"
    assert program.function_at(0x0804_0000) is None


def test_label_is_preferred_to_weak_alias() -> None:
    """ST's start-up files: Default_Handler is a label with a size, the handlers are its weak aliases."""
    program = named(
        ("ADC_IRQHandler", RESET | 1, 2, WEAK_FUNC),
        ("Default_Handler", RESET, 2, STATIC_NOTYPE),
        ("Infinite_Loop", RESET, 0, STATIC_NOTYPE),
        ("helper", MAIN | 1, 4, STATIC_FUNC),
        ("main", MAIN | 1, 4, GLOBAL_FUNC),
    )

    assert program.function_at(RESET).name == "Default_Handler"
    assert program.function_at(MAIN).name == "main"


def test_compiler_clone_has_its_source_name() -> None:
    """GCC: constant propagation, removed parameters, cold parts, link-time optimisation."""
    for suffix in (".constprop.0", ".isra.0.part.1", ".cold", ".lto_priv.2"):
        program = named(("helper" + suffix, MAIN | 1, 4, STATIC_FUNC))

        assert program.function_at(MAIN).name == "helper"
        assert program.address_of("helper") == MAIN


def test_mapping_symbols_are_not_names() -> None:
    """IHI 0044, "Mapping symbols": $t and $d mark code and data."""
    assert named(("$t", RESET, 4, STATIC_FUNC)).function_at(RESET) is None


# variables by hand


@pytest.mark.parametrize("version", [4, 5])
def test_both_versions_of_debug_information_are_read(version: int) -> None:
    program = loaded(*debug_sections(version))

    assert str(program.line_at(RESET)) == "main.c:3"
    assert program.line_at(RESET).path.endswith("src/main.c")
    assert program.read_variable("count", memory) == (1, -2, 3)
    assert program.notes == []


def test_variable_is_found_by_any_byte() -> None:
    program = loaded(*debug_sections())

    assert [program.object_at(ACC + offset).name for offset in (0, 7)] == ["acc", "acc"]
    assert program.object_at(ACC + 8) is None
    assert program.object_at(MAIN) is None


def test_structure_becomes_object_with_its_members() -> None:
    acc = loaded(*debug_sections()).read_variable("acc", memory)

    assert (acc.X, acc.F) == (-44, 1.5)
    with pytest.raises(AttributeError):
        _ = acc.Y


def test_numbered_static_is_found_by_source_name() -> None:
    assert loaded(*debug_sections()).read_variable("count", memory) == (1, -2, 3)
    assert loaded(*debug_sections()).address_of("count") == COUNT


def test_ambiguous_static_is_refused_with_files() -> None:
    program = named(
        ("a.c", 0, 0, FILE),
        ("lit.0", ACC, 4, STATIC_OBJECT),
        ("b.c", 0, 0, FILE),
        ("lit.1", COUNT, 4, STATIC_OBJECT),
    )

    with pytest.raises(SymbolError, match=r"'lit'.* 2 .*\(a.c, b.c\)"):
        program.address_of("lit")


def test_global_name_hides_statics() -> None:
    program = named(("lit", COUNT, 4, STATIC_OBJECT), ("lit", ACC, 4, GLOBAL_OBJECT))

    assert program.address_of("lit") == ACC


def test_name_of_non_variable_raises_key_error(words: Words) -> None:
    program = loaded(*debug_sections())

    with pytest.raises(SymbolError, match="'nothing'"):
        program.read_variable("nothing", memory)
    with pytest.raises(SymbolError) as caught:
        program.read_variable("main", memory)
    assert isinstance(caught.value, KeyError)
    assert caught.value.kind == "not_a_variable"
    words("firmware_file", caught.value.args[0])


def test_variable_without_debug_information_has_only_address(words: Words) -> None:
    program = named(("acc", ACC, 8, GLOBAL_OBJECT))

    assert program.address_of("acc") == ACC
    with pytest.raises(SymbolError) as caught:
        program.read_variable("acc", memory)
    assert caught.value.kind == "unknown_type"
    words("firmware_file", caught.value.args[0])


def test_variable_outside_memories_is_not_read() -> None:
    data = debug_elf().replace(struct.pack("<I", ACC), struct.pack("<I", 0x4000_0000))
    program = parse_firmware(data, "a.elf").symbols

    with pytest.raises(SymbolError, match=r"'acc'.*0x40000000"):
        program.read_variable("acc", memory)


# lines by hand


def test_line_extends_to_next_row_or_sequence_end() -> None:
    """Rows: line 3 at the first byte, line 4 from byte 4 on, end behind byte 20 (elf_builder)."""
    program = loaded(*debug_sections())

    assert [str(program.line_at(RESET + offset)) for offset in (0, 2, 4, 18)] == [
        "main.c:3",
        "main.c:3",
        "main.c:4",
        "main.c:4",
    ]
    assert program.line_at(RESET).path == "src/main.c"
    assert program.line_at(RESET - 2) is None
    assert program.line_at(RESET + 20) is None


def test_lines_of_removed_functions_are_not_shown() -> None:
    """The linker leaves removed functions at address 0 (--gc-sections)."""
    program = replaced(".debug_line", contents(".debug_line").replace(struct.pack("<I", RESET), bytes(4)))

    assert program.line_at(0) is None
    assert program.line_at(4) is None


def v5_names(folders: tuple[bytes, ...], *files: tuple[bytes, int]) -> bytes:
    """Return tables as in DWARF 5 section 6.2.4.1, with the path as a string and the directory number as udata."""
    out = b"\x01\x01\x08" + uleb(len(folders)) + b"".join(folder + b"\0" for folder in folders)
    out += b"\x02\x01\x08\x02\x0f" + uleb(len(files))
    return out + b"".join(name + b"\0" + uleb(folder) for name, folder in files)


@pytest.mark.parametrize(
    ("name", "folder", "path", "short"),
    [
        (b"main.c", 0, "/home/me/lab3/main.c", "main.c:3"),
        (b"main.c", 1, "/home/me/lab3/Core/Src/main.c", "main.c:3"),
        (b"hal.c", 2, "/opt/hal.c", "hal.c:3"),
        (b"/abs/x.c", 1, "/abs/x.c", "x.c:3"),
        (b"C:\\lab\\x.c", 1, "C:\\lab\\x.c", "x.c:3"),
        (b"main.c", 9, "main.c", "main.c:3"),
    ],
)
def test_paths_of_version_5_are_joined(name: bytes, folder: int, path: str, short: str) -> None:
    names = v5_names((b"/home/me/lab3", b"Core/Src", b"/opt"), (b"first.c", 0), (name, folder))
    program = replaced(
        ".debug_line", line_program(set_address(RESET) + b"\x14\x02\x10" + END_SEQUENCE, names, 5)
    )

    line = program.line_at(RESET)

    assert (line.path, str(line)) == (path, short)


@pytest.mark.parametrize("version", [2, 3, 4])
def test_older_dwarf_versions_are_read(version: int) -> None:
    data = line_program(set_address(RESET) + b"\x14\x02\x10" + END_SEQUENCE, b"\0m.c\0\0\0\0\0", version)

    assert str(replaced(".debug_line", data).line_at(RESET)) == "m.c:3"
