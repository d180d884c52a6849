"""ELF files: loaded contents, and refusal of harmful files (ELF specification 1.2)."""

from __future__ import annotations

import struct
from pathlib import Path

import pytest
from elftools.elf.elffile import ELFFile

from fcu_emulator.emulator.chip.image import parse_firmware
from fcu_emulator.emulator.errors import FirmwareFileError
from tests.support.arm.elf_builder import FLASH, RAM, Load, Section, code, debug_elf, elf, patched
from tests.support.words import Words

PREBUILT = sorted((Path(__file__).parents[2] / "firmware_model/arm/prebuilt").glob("*.elf"))
E_TYPE, E_PHOFF, E_SHOFF, E_PHENTSIZE, E_PHNUM, E_SHNUM = 16, 28, 32, 42, 44, 48
P_OFFSET, P_VADDR, P_PADDR, P_FILESZ, P_MEMSZ = (52 + place for place in (4, 8, 12, 16, 20))


def refusal(data: bytes) -> FirmwareFileError:
    with pytest.raises(FirmwareFileError) as caught:
        parse_firmware(data, "lab3.elf")
    assert "\n" not in str(caught.value)
    return caught.value


def test_initial_values_are_loaded_at_their_physical_address() -> None:
    """.data is in flash (its load address) until the start-up code copies it. .bss loads no data."""
    values, bss = b"\1\2\3\4" * 4, Load(FLASH + 0x300, b"", virtual=RAM + 16, memory_size=0x800)

    image = parse_firmware(elf([Load(FLASH, code()), Load(FLASH + 0x200, values, virtual=RAM), bss]), "a.elf")

    assert image.segments == ((FLASH, code()), (FLASH + 0x200, values))


def test_unordered_neighbouring_segments_are_joined() -> None:
    image = parse_firmware(elf([Load(FLASH + 0x80, code()[0x80:]), Load(FLASH, code()[:0x80])]), "a.elf")

    assert image.segments == ((FLASH, code()),)


def test_segment_for_ram_is_loaded_into_ram() -> None:
    image = parse_firmware(elf([Load(FLASH, code()), Load(RAM, b"\x70\x47")]), "a.elf")

    assert image.segments[-1] == (RAM, b"\x70\x47")


@pytest.mark.parametrize("path", PREBUILT, ids=lambda path: path.stem)
def test_segments_equal_those_that_pyelftools_reads(path: Path) -> None:
    image = parse_firmware(path.read_bytes(), path)
    with path.open("rb") as file:
        loads = [one for one in ELFFile(file).iter_segments("PT_LOAD") if one["p_filesz"]]
        expected = [(one["p_paddr"], one.data()) for one in loads]

    assert list(image.segments) == expected
    assert image.notes == ()
    assert image.symbols is not None


@pytest.mark.parametrize(
    ("data", "kind", "what"),
    [
        (elf(machine=62, ident=b"\x7fELF\x02\x01\x01"), "wrong_machine", "x86-64"),
        (elf(machine=183, ident=b"\x7fELF\x02\x01\x01"), "wrong_machine", "64-bit ARM"),
        (elf(machine=243), "wrong_machine", "RISC-V"),
        (elf(machine=94), "wrong_machine", "Xtensa (ESP32)"),
        (elf(machine=0x1234), "wrong_machine", "4660"),
        (elf(machine=8 << 8, ident=b"\x7fELF\x01\x02\x01"), "wrong_machine", "MIPS"),
        (elf(machine=40 << 8, ident=b"\x7fELF\x01\x02\x01"), "wrong_format", "32-bit"),
        (elf(ident=b"\x7fELF\x01\x01\x01\x03"), "linux_program", "Linux"),
        (elf([Load(FLASH, code()), Load(FLASH, b"/lib/ld-linux.so", type=3)]), "linux_program", "Linux"),
        (elf(kind=1), "wrong_type", ".o"),
        (elf(kind=3), "wrong_type", "shared"),
        (elf(kind=4), "wrong_type", "core dump"),
        (elf(kind=0xFE00), "wrong_type", "65024"),
    ],
)
def test_elf_of_wrong_kind_is_refused_with_reason(data: bytes, kind: str, what: str, words: Words) -> None:
    error = refusal(data)

    assert error.kind == kind
    assert what in error.problem
    words("firmware_file", error.problem)


@pytest.mark.parametrize("length", [4, 51, 60, 83, 84, 200, len(elf()) - 1])
def test_file_cut_short_is_refused(length: int, words: Words) -> None:
    error = refusal(elf()[:length])

    assert error.kind == "cut_short"
    words("firmware_file", error.problem)


def test_missing_section_table_is_refused(words: Words) -> None:
    error = refusal(debug_elf()[:-1])

    assert error.kind == "cut_short"
    words("firmware_file", error.problem)


@pytest.mark.parametrize(
    ("load", "what"),
    [
        (Load(0x0804_0000 - 4, b"12345678"), "0x0803FFFC..0x08040003"),
        (Load(0x0000_0000, b"1234"), "0x00000000..0x00000003"),
        (Load(0x1000_0000, b"", memory_size=16), "0x10000000..0x1000000F"),  # CCM RAM of an STM32F407
        (Load(FLASH + 0x400, b"1234", virtual=0x2001_0000 - 2), "0x2000FFFE..0x20010001"),
        (Load(FLASH + 0x400, b"", virtual=RAM, memory_size=0x1_0001), "0x20000000..0x20010000"),
        (Load(0x1FFF_C000, b"12", virtual=FLASH + 0x400), "0x1FFFC000..0x1FFFC001"),  # option bytes
        (Load(0xFFFF_FFFF, b"12", virtual=FLASH + 0x400), "0xFFFFFFFF..0x100000000"),
    ],
)
def test_segment_outside_memories_is_refused(load: Load, what: str) -> None:
    error = refusal(elf([Load(FLASH, code()), load]))

    assert error.kind == "other_chip"
    assert what in error.problem
    for memory in ("STM32F401CC", "0x08000000..0x0803FFFF", "0x20000000..0x2000FFFF"):
        assert memory in error.problem


def test_overlapping_segments_are_refused(words: Words) -> None:
    error = refusal(elf([Load(FLASH, code()), Load(FLASH + 0x80, b"12")]))

    assert error.kind == "overlap"
    assert "0x08000080" in error.problem
    words("firmware_file", error.problem)


def test_overlapping_segments_are_refused_before_copying(words: Words) -> None:
    """Each segment is a valid part of the file; together they would be gigabytes."""
    whole = elf([Load(FLASH, code(size=0x3_0000))])
    header = whole[52:84]
    many = patched(whole, E_PHOFF, "<I", len(whole)) + header * 60_000

    error = refusal(patched(many, E_PHNUM, "<H", 60_000))

    assert error.kind == "overlap"
    words("firmware_file", error.problem)


@pytest.mark.parametrize(
    ("offset", "layout", "value", "kind"),
    [
        (E_PHNUM, "<H", 0, "no_program_headers"),
        (E_PHNUM, "<H", 0xFFFF, "cut_short"),
        (E_PHOFF, "<I", 0xFFFF_FFFF, "cut_short"),
        (E_PHENTSIZE, "<H", 31, "program_header_size"),
        (E_SHOFF, "<I", 0xFFFF_FFF0, "cut_short"),
        (E_SHNUM, "<H", 0xFFFF, "cut_short"),
        (P_OFFSET, "<I", 0xFFFF_FFFF, "cut_short"),
        (P_FILESZ, "<I", 0xFFFF_FFFF, "segment_size"),
        (P_MEMSZ, "<I", 0, "segment_size"),
        (P_MEMSZ, "<I", 0xFFFF_FFFF, "other_chip"),
        (P_VADDR, "<I", 0xFFFF_FFFF, "other_chip"),
        (P_PADDR, "<I", 0x4000_0000, "other_chip"),
        (52, "<I", 6, "nothing_loaded"),
    ],
)
def test_extreme_fields_are_refused(offset: int, layout: str, value: int, kind: str, words: Words) -> None:
    error = refusal(patched(debug_elf(), offset, layout, value))

    assert error.kind == kind
    words("firmware_file", error.problem)


def test_program_for_boot_loader_is_refused_with_remedy(words: Words) -> None:
    error = refusal(elf([Load(FLASH + 0x4000, code(reset=(FLASH + 0x4040) | 1))]))

    assert error.kind == "no_vector_table"
    words("firmware_file", error.problem)


def test_program_without_symbols_is_noted(words: Words) -> None:
    image = parse_firmware(elf(), "a.elf")

    assert image.symbols is None
    (note,) = image.notes
    words("firmware_file", note)


def test_program_with_damaged_section_names_lacks_only_symbols(words: Words) -> None:
    whole = elf(sections=[Section(".comment", b"GCC")])
    last_header = len(whole) - 40

    image = parse_firmware(patched(whole, last_header + 16, "<I", 0xFFFF_FFFF), "a.elf")  # sh_offset

    assert image.segments == ((FLASH, code()),)
    (note,) = image.notes
    words("firmware_file", note)


def test_entry_address_is_not_used() -> None:
    """After reset the core uses word 1 of the vector table (ARMv7-M ARM B1.5.5), for any e_entry."""
    image = parse_firmware(patched(elf(), 24, "<I", 0x1234_5678), "a.elf")

    assert image.reset_vector == struct.unpack_from("<I", code(), 4)[0]
