"""Names, lines and types of the shipped solution agree with pyelftools and with the lab's text."""

from __future__ import annotations

import struct
from functools import cache
from io import BytesIO
from pathlib import Path

from elftools.elf.elffile import ELFFile

from fcu_emulator.emulator.chip.image import Symbols, load_firmware
from tests.support.arm.elf_builder import (
    debug_sections,
)
from tests.support.arm.symbol_programs import loaded, memory

SOLUTION = Path(__file__).parents[2] / "firmware_model/arm/prebuilt/solution-i2c2.elf"


@cache
def solution() -> Symbols:
    found = load_firmware(SOLUTION).symbols
    assert found is not None
    return found


@cache
def elf_file() -> ELFFile:
    return ELFFile(BytesIO(SOLUTION.read_bytes()))


def test_function_is_found_at_first_and_last_byte() -> None:
    functions = [
        (symbol.name, symbol["st_value"] & ~1, symbol["st_size"])
        for symbol in elf_file().get_section_by_name(".symtab").iter_symbols()
        if symbol["st_info"]["type"] == "STT_FUNC" and symbol["st_size"]
    ]
    aliases: dict[int, set[str]] = {}
    for name, start, _ in functions:
        aliases.setdefault(start, set()).add(name.partition(".")[0])

    assert len(functions) > 100
    for _, start, size in functions:
        first, last = solution().function_at(start), solution().function_at(start + size - 1)
        assert first.name in aliases[start]
        assert last.name in aliases[last.start]
        assert first.start == start
        assert last.start + last.offset == (start + size - 1) & ~1


def test_every_row_of_every_line_program_is_found() -> None:
    wanted = dict(_rows())

    found = {address: solution().line_at(address) for address in wanted}

    assert len(wanted) > 2000
    assert {address: (line.file, line.line) for address, line in found.items()} == wanted
    assert solution().notes == []


def _rows() -> list[tuple[int, tuple[str, int]]]:
    """Return (address, (file, line)) from pyelftools. Of several rows at one address, the last row is valid."""
    rows: dict[int, tuple[str, int]] = {}
    dwarf = elf_file().get_dwarf_info()
    for compilation in dwarf.iter_CUs():
        program = dwarf.line_program_for_CU(compilation)
        sequence: list[tuple[int, str, int]] = []
        for state in (entry.state for entry in program.get_entries() if entry.state):
            if not state.end_sequence:
                file = program["file_entry"][state.file - 1].name.decode()  # counted from 1 before DWARF 5
                sequence.append((state.address, file, state.line))
                continue
            if sequence and sequence[0][0]:
                rows |= {at: (file, line) for at, file, line in sequence if at < state.address}
            sequence = []
    return list(rows.items())


def test_variables_of_solution_have_types_of_lab() -> None:
    """Vectors are int32, pressure, angles and altitude float32."""
    axes, number = struct.pack("<3i", 44, 23, -1008), struct.pack("<f", 977.400024)
    values = {
        name: solution().read_variable(name, lambda _, size: axes if size == 12 else number)
        for name in ("acc", "gyro", "mag", "mag_min", "mag_max", "press", "pitch", "roll", "azimuth", "alt")
    }

    for name in ("acc", "gyro", "mag", "mag_min", "mag_max"):
        assert (values[name].AXIS_X, values[name].AXIS_Y, values[name].AXIS_Z) == (44, 23, -1008)
    for name in ("press", "pitch", "roll", "azimuth", "alt"):
        assert f"{values[name]:f}" == "977.400024"


def test_repeated_variable_read_uses_no_budget() -> None:
    """A scenario may read a variable a million times. The budget is for reading the file, not for the run."""
    program = loaded(*debug_sections())
    program.read_variable("acc", memory)
    before = program.work

    for _ in range(100):
        program.read_variable("acc", memory)

    assert program.work == before
