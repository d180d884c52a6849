"""Description of registers, in the order of their packet numbers, and of memory.

See "Target Descriptions", "Memory Map Format" and "ARM Features".

Decision: floating-point registers are described as d0 to d15, because GDB derives s0 to s31 from
them.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Final, NamedTuple

from fcu_emulator.emulator.chip import memory_map
from fcu_emulator.emulator.chip.memory_map import (
    FLASH,
    FLASH_SIZE,
    RAM,
    RAM_SIZE,
    SYSTEM_MEMORY,
    SYSTEM_MEMORY_SIZE,
)

_MEMORY_MAP_DTD = (
    '"+//IDN gnu.org//DTD GDB Memory Map V1.0//EN" "http://sourceware.org/gdb/gdb-memory-map.dtd"'
)
_SECTOR = 0x4000  # the smallest sector (RM0368 table 5)


class GdbRegister(NamedTuple):
    """A register in a debugger's packets. ``parts`` are its words, the low word first."""

    name: str
    parts: tuple[str, ...]

    @property
    def size(self) -> int:
        return 4 * len(self.parts)


def _words(*names: str) -> tuple[GdbRegister, ...]:
    return tuple(GdbRegister(name, (name,)) for name in names)


_TYPES = {"sp": "data_ptr", "pc": "code_ptr", "msp": "data_ptr", "psp": "data_ptr"}

FEATURES: Final[dict[str, Sequence[GdbRegister]]] = {
    "org.gnu.gdb.arm.m-profile": _words(*(f"r{number}" for number in range(13)), "sp", "lr", "pc", "xpsr"),
    "org.gnu.gdb.arm.vfp": (
        *(GdbRegister(f"d{number}", (f"s{2 * number}", f"s{2 * number + 1}")) for number in range(16)),
        *_words("fpscr"),
    ),
    "org.gnu.gdb.arm.m-system": _words("msp", "psp", "primask", "basepri", "faultmask", "control"),
}

REGISTERS: Final = tuple(register for registers in FEATURES.values() for register in registers)

ADDRESSES: Final = (
    ("rom", 0, FLASH_SIZE),  # the alias of the flash from which the core boots (RM0368 section 2.4)
    ("flash", FLASH, FLASH_SIZE),
    ("rom", SYSTEM_MEMORY, SYSTEM_MEMORY_SIZE),
    ("ram", RAM, RAM_SIZE),
    ("ram", memory_map.RAM_BITS, 32 * RAM_SIZE),
    ("ram", memory_map.PERIPHERALS, memory_map.PERIPHERALS_SIZE),
    ("ram", memory_map.PERIPHERAL_BITS, 32 * memory_map.PERIPHERALS_SIZE),
    ("ram", memory_map.OTG, memory_map.OTG_SIZE),
    ("ram", memory_map.PRIVATE, memory_map.PRIVATE_SIZE),
)
"""Kind, first address and size of each range. Registers of peripherals count as RAM for a debugger."""


def target_xml() -> bytes:
    """Return the description of the registers."""
    lines = [
        '<?xml version="1.0"?>',
        '<!DOCTYPE target SYSTEM "gdb-target.dtd">',
        '<target version="1.0">',
        "<architecture>arm</architecture>",
    ]
    for name, registers in FEATURES.items():
        lines.append(f'<feature name="{name}">')
        lines += [
            f'<reg name="{register.name}" bitsize="{8 * register.size}" type="{_type(register)}"/>'
            for register in registers
        ]
        lines.append("</feature>")
    return "\n".join((*lines, "</target>", "")).encode("ascii")


def memory_map_xml() -> bytes:
    """Return the memory map, which makes GDB use hardware breakpoints in flash."""
    lines = [
        '<?xml version="1.0"?>',
        f"<!DOCTYPE memory-map PUBLIC {_MEMORY_MAP_DTD}>",
        "<memory-map>",
    ]
    for kind, start, size in ADDRESSES:
        begin = f'<memory type="{kind}" start="0x{start:08x}" length="0x{size:x}"'
        if kind == "flash":
            lines.append(f'{begin}><property name="blocksize">0x{_SECTOR:x}</property></memory>')
        else:
            lines.append(f"{begin}/>")
    return "\n".join((*lines, "</memory-map>", "")).encode("ascii")


DOCUMENTS: Final[dict[bytes, Callable[[], bytes]]] = {
    b"features:read:target.xml": target_xml,
    b"memory-map:read:": memory_map_xml,
}
"""Documents by their names in ``qXfer`` packets."""


def _type(register: GdbRegister) -> str:
    return "ieee_double" if register.size == 8 else _TYPES.get(register.name, "uint32")
