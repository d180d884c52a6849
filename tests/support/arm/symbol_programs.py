"""Small programs with symbols, and with exchanged parts."""

from __future__ import annotations

import struct

from fcu_emulator.emulator.chip.image import Symbols, parse_firmware
from tests.support.arm.elf_builder import (
    ACC,
    COUNT,
    Section,
    debug_sections,
    elf,
    symbols,
)

MEMORY = {ACC: struct.pack("<if", -44, 1.5), COUNT: struct.pack("<3i", 1, -2, 3)}


def memory(address: int, size: int) -> bytes:
    assert len(MEMORY[address]) == size
    return MEMORY[address]


def loaded(*sections: Section) -> Symbols:
    found = parse_firmware(elf(sections=sections), "a.elf").symbols
    assert found is not None
    return found


def named(*entries: tuple[str, int, int, int]) -> Symbols:
    return loaded(*symbols(*entries))


def replaced(name: str, data: bytes, flags: int = 0, new_name: str = "") -> Symbols:
    """Return the small program with one section replaced by another."""
    return loaded(
        *(
            section._replace(data=data, flags=flags, name=new_name or name)
            if section.name == name
            else section
            for section in debug_sections()
        )
    )


def contents(name: str) -> bytes:
    return next(section.data for section in debug_sections() if section.name == name)
