"""ELF files: what is loaded where, and what is refused before it can do harm (ELF specification 1.2)."""

from __future__ import annotations

import struct
from pathlib import Path

import pytest
from elftools.elf.elffile import ELFFile

from fcu_emulator.emulator.chip.image import parse_firmware
from fcu_emulator.emulator.errors import FirmwareFileError
from tests.support.arm.elf_builder import FLASH, RAM, Load, Section, code, debug_elf, elf, patched

PREBUILT = sorted((Path(__file__).parents[2] / "firmware_model/arm/prebuilt").glob("*.elf"))
E_TYPE, E_PHOFF, E_SHOFF, E_PHENTSIZE, E_PHNUM, E_SHNUM = 16, 28, 32, 42, 44, 48
P_OFFSET, P_VADDR, P_PADDR, P_FILESZ, P_MEMSZ = (52 + place for place in (4, 8, 12, 16, 20))


def refusal(data: bytes) -> str:
    with pytest.raises(FirmwareFileError) as caught:
        parse_firmware(data, "lab3.elf")
    assert "\n" not in str(caught.value)
    return str(caught.value)


def test_initial_values_are_loaded_at_their_physical_address() -> None:
    """.data lies in flash (its load address) until the start-up code copies it; .bss loads nothing."""
    values, bss = b"\1\2\3\4" * 4, Load(FLASH + 0x300, b"", virtual=RAM + 16, memory_size=0x800)

    image = parse_firmware(elf([Load(FLASH, code()), Load(FLASH + 0x200, values, virtual=RAM), bss]), "a.elf")

    assert image.segments == ((FLASH, code()), (FLASH + 0x200, values))


def test_segments_may_come_in_any_order_and_neighbours_are_joined() -> None:
    image = parse_firmware(elf([Load(FLASH + 0x80, code()[0x80:]), Load(FLASH, code()[:0x80])]), "a.elf")

    assert image.segments == ((FLASH, code()),)


def test_contents_of_ram_are_loaded_there() -> None:
    image = parse_firmware(elf([Load(FLASH, code()), Load(RAM, b"\x70\x47")]), "a.elf")

    assert image.segments[-1] == (RAM, b"\x70\x47")


@pytest.mark.parametrize("path", PREBUILT, ids=lambda path: path.stem)
def test_our_own_firmware_loads_as_pyelftools_reads_it(path: Path) -> None:
    image = parse_firmware(path.read_bytes(), path)
    with path.open("rb") as file:
        loads = [one for one in ELFFile(file).iter_segments("PT_LOAD") if one["p_filesz"]]
        expected = [(one["p_paddr"], one.data()) for one in loads]

    assert list(image.segments) == expected
    assert image.notes == ()
    assert image.symbols is not None


@pytest.mark.parametrize(
    ("data", "what"),
    [
        (elf(machine=62, ident=b"\x7fELF\x02\x01\x01"), "for x86-64,"),
        (elf(machine=183, ident=b"\x7fELF\x02\x01\x01"), "for 64-bit ARM,"),
        (elf(machine=243), "for RISC-V,"),
        (elf(machine=94), "for Xtensa (ESP32),"),
        (elf(machine=0x1234), "for machine 4660,"),
        (elf(machine=8 << 8, ident=b"\x7fELF\x01\x02\x01"), "for MIPS,"),
        (elf(machine=40 << 8, ident=b"\x7fELF\x01\x02\x01"), "no little-endian 32-bit ELF"),
        (elf(ident=b"\x7fELF\x01\x01\x01\x03"), "a program for Linux on ARM"),
        (
            elf([Load(FLASH, code()), Load(FLASH, b"/lib/ld-linux.so", type=3)]),
            "for Linux on ARM (dynamically",
        ),
        (elf(kind=1), "an object file (.o), not linked"),
        (elf(kind=3), "a shared object"),
        (elf(kind=4), "a core dump"),
        (elf(kind=0xFE00), "of ELF type 65024"),
    ],
)
def test_other_programs_are_called_what_they_are(data: bytes, what: str) -> None:
    assert what in refusal(data)


@pytest.mark.parametrize("length", [4, 51, 60, 83, 84, 200, len(elf()) - 1])
def test_a_file_cut_short_is_refused(length: int) -> None:
    assert "cut short" in refusal(elf()[:length])


def test_a_file_whose_end_with_the_section_table_is_missing_is_refused() -> None:
    assert "cut short or damaged: its section header table" in refusal(debug_elf()[:-1])


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
def test_what_lies_outside_the_chips_memories_is_refused(load: Load, what: str) -> None:
    message = refusal(elf([Load(FLASH, code()), load]))

    assert what in message
    assert (
        "this board's STM32F401CC has flash 0x08000000..0x0803FFFF and RAM 0x20000000..0x2000FFFF" in message
    )


def test_segments_that_overlap_are_refused() -> None:
    assert "two contents for address 0x08000080" in refusal(
        elf([Load(FLASH, code()), Load(FLASH + 0x80, b"12")])
    )


def test_thousands_of_overlapping_segments_are_refused_before_they_are_copied() -> None:
    """Each is a legal part of the file; together they would be gigabytes."""
    whole = elf([Load(FLASH, code(size=0x3_0000))])
    header = whole[52:84]
    many = patched(whole, E_PHOFF, "<I", len(whole)) + header * 60_000

    assert "overlap or do not fit" in refusal(patched(many, E_PHNUM, "<H", 60_000))


@pytest.mark.parametrize(
    ("offset", "layout", "value", "what"),
    [
        (E_PHNUM, "<H", 0, "no program headers"),
        (E_PHNUM, "<H", 0xFFFF, "its program header table ends at byte"),
        (E_PHOFF, "<I", 0xFFFF_FFFF, "its program header table ends at byte"),
        (E_PHENTSIZE, "<H", 31, "program headers of 31 bytes"),
        (E_SHOFF, "<I", 0xFFFF_FFF0, "its section header table ends at byte"),
        (E_SHNUM, "<H", 0xFFFF, "its section header table ends at byte"),
        (P_OFFSET, "<I", 0xFFFF_FFFF, "its segment for 0x08000000 ends at byte"),
        (P_FILESZ, "<I", 0xFFFF_FFFF, "a segment of 4294967295 bytes for 256 of memory"),
        (P_MEMSZ, "<I", 0, "a segment of 256 bytes for 0 of memory"),
        (P_MEMSZ, "<I", 0xFFFF_FFFF, "uses memory 0x08000000..0x107FFFFFE"),
        (P_VADDR, "<I", 0xFFFF_FFFF, "uses memory 0xFFFFFFFF"),
        (P_PADDR, "<I", 0x4000_0000, "contents for 0x40000000"),
        (52, "<I", 6, "loads nothing"),
    ],
)
def test_extreme_fields_are_refused(offset: int, layout: str, value: int, what: str) -> None:
    assert what in refusal(patched(debug_elf(), offset, layout, value))


def test_a_program_for_a_boot_loader_is_refused_with_the_remedy() -> None:
    message = refusal(elf([Load(FLASH + 0x4000, code(reset=(FLASH + 0x4040) | 1))]))

    assert "no vector table at 0x08000000" in message
    assert "no boot loader" in message


def test_a_stripped_program_runs_and_says_that_it_has_no_names() -> None:
    image = parse_firmware(elf(), "a.elf")

    assert image.symbols is None
    assert image.notes == (
        "no symbols: it has no symbol table; a stripped ELF runs, but is diagnosed without names",
    )


def test_a_damaged_table_of_section_names_costs_the_symbols_only() -> None:
    whole = elf(sections=[Section(".comment", b"GCC")])
    last_header = len(whole) - 40

    image = parse_firmware(patched(whole, last_header + 16, "<I", 0xFFFF_FFFF), "a.elf")  # sh_offset

    assert image.segments == ((FLASH, code()),)
    assert image.notes == ("no symbols: the table of section names reaches beyond the end of the file",)


def test_the_entry_address_of_the_file_is_not_used() -> None:
    """After reset the core takes the vector table's word 1 (ARMv7-M ARM B1.5.5), whatever e_entry says."""
    image = parse_firmware(patched(elf(), 24, "<I", 0x1234_5678), "a.elf")

    assert image.reset_vector == struct.unpack_from("<I", code(), 4)[0]
