"""C headers of registers, memory map and DMA requests.

``CR1`` is an offset, ``CR1_UE`` a field, ``CR2_STOP_SHIFT`` the lowest bit of a field, ``CR1_RESET`` the value after
reset, ``CR1_STORED`` the bits that store values. ``C_PREFIX`` is added to names that C already uses.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from types import ModuleType

from fcu_emulator.emulator.chip import memory_map
from fcu_emulator.emulator.chip.registers import IN_C, dma
from fcu_emulator.emulator.chip.registers.declaration import WORD, Word, peripheral, words

_PER_LINE = 8


def write_headers(folder: Path) -> None:
    """Write all headers to ``folder``. The file of an unchanged header is not written again."""
    folder.mkdir(exist_ok=True)
    texts = headers()
    for path in folder.glob("*.h"):
        if path.name not in texts:
            path.unlink()
    for name, text in texts.items():
        path = folder / name
        if not path.is_file() or path.read_bytes() != text.encode():
            path.write_bytes(text.encode())


def headers() -> dict[str, str]:
    """Return the headers by file name."""
    return {
        "memory_map.h": _memory_map(),
        "dma_requests.h": _requests(),
        **{f"registers_{_kind(module)}.h": _registers(module) for module in IN_C},
    }


# -- memory map and DMA request lines -----------------------------------------------------------------------

_MEMORY = ("FLASH", "RAM", "SYSTEM_MEMORY", "PERIPHERALS", "OTG", "PRIVATE")
_C_NAMES = {"FLASH": "FLASH_R", "ROM table": "ROM_TABLE"}
"""FLASH is called FLASH_R, as in ST's headers, because the name FLASH belongs to the memory."""


def _memory_map() -> str:
    lines = [
        *(f"#define {name}_BASE 0x{getattr(memory_map, name):08X}u" for name in _MEMORY),
        *(f"#define {name}_SIZE 0x{getattr(memory_map, f'{name}_SIZE'):X}u" for name in _MEMORY),
        f"#define RAM_BITS_BASE 0x{memory_map.RAM_BITS:08X}u",
        f"#define PERIPHERAL_BITS_BASE 0x{memory_map.PERIPHERAL_BITS:08X}u",
        "",
    ]
    for name, (base, size) in memory_map.ADDRESSES.items():
        if name not in {"OTG_FS"}:
            c_name = _C_NAMES.get(name, name)
            lines += [f"#define {c_name}_BASE 0x{base:08X}u", f"#define {c_name}_SIZE 0x{size:X}u"]
    return _framed("Memory map (RM0368 section 2.3).", "emulator/chip/memory_map.py", "MEMORY_MAP", lines)


def _requests() -> str:
    lines = [
        "enum Request {",
        "  REQUEST_NONE,",
        *(f"  REQUEST_{name}," for name in dma.REQUESTS),
        "  REQUESTS",
        "};",
    ]
    source = "emulator/chip/registers/dma.py"
    return _framed("DMA request lines (RM0368 tables 28 and 29).", source, "DMA_REQUESTS", lines)


# -- registers ----------------------------------------------------------------------------------------------


def _registers(module: ModuleType) -> str:
    kind = _kind(module)
    title = (module.__doc__ or "").partition("\n")[0]
    prefix: str = getattr(module, "C_PREFIX", "")
    lines = ["#include <stdint.h>", ""]
    lines += [line for register in words(module) for line in (*_register(register, prefix), "")]
    lines += _tables(module, kind.upper())
    return _framed(title, f"emulator/chip/registers/{kind}.py", f"REGISTERS_{kind.upper()}", lines)


def _framed(title: str, source: str, guard: str, lines: list[str]) -> str:
    return "\n".join(
        [
            f"/* {title}",
            " *",
            f" * Generated from {source} by emulator/chip/registers/c_headers.py. */",
            f"#ifndef FCU_{guard}_H",
            f"#define FCU_{guard}_H",
            "",
            *lines,
            "#endif",
            "",
        ]
    )


def _kind(module: ModuleType) -> str:
    return module.__name__.rpartition(".")[2]


def _register(register: type[Word], prefix: str) -> Iterator[str]:
    name = prefix + register.__name__
    yield f"/* {(register.__doc__ or '').strip()} */"
    if register.count == 1:
        yield f"enum {{ {name} = 0x{register.addr:02X} }};"
    else:
        number = _number(register.first)
        yield f"#define {name}(x) (0x{register.addr:02X}u + 0x{register.step:02X}u * {number})"
    if register.reset:
        yield f"#define {name}_RESET 0x{register.reset:08X}u"
    if register.stored_mask not in {0, WORD}:
        yield f"#define {name}_STORED 0x{register.stored_mask:08X}u"
    for bits in register.fields:
        one = (1 << bits.msb + 1) - (1 << bits.lsb)
        if bits.count > 1:
            yield f"#define {name}_{bits.name}(x) (0x{one:08X}u << {bits.step} * {_number(bits.first)})"
            continue
        yield f"#define {name}_{bits.name} 0x{one:08X}u"
        if bits.msb > bits.lsb:
            yield f"#define {name}_{bits.name}_SHIFT {bits.lsb}"


def _number(first: int) -> str:
    return f"((x) - {first})" if first else "(x)"


def _tables(module: ModuleType, kind: str) -> Iterator[str]:
    """Return a table of offsets and, if the peripherals differ, tables of their bits and reset values."""
    peripherals = [peripheral(module, name) for name in module.INSTANCES]
    offsets = sorted({register.offset for one in peripherals for register in one.registers})
    texts = [f"0x{offset:02X}" for offset in offsets]
    yield "/* All of them; -1 ends the list. */"
    yield f"static const int16_t {kind}_OFFSETS[] = {{"
    yield from (f"  {', '.join(texts[at : at + _PER_LINE])}," for at in range(0, len(texts), _PER_LINE))
    yield "  -1,"
    yield "};"
    yield ""
    if hasattr(module, "VARIANTS"):
        size = f"[{len(peripherals)}][{offsets[-1] // 4 + 1}]"
        bits = [{one.offset: one.bits for one in each.registers} for each in peripherals]
        resets = [each.resets for each in peripherals]
        for title, name, values in (
            ("The bits that each peripheral has, by offset / 4.", "EXISTING", bits),
            ("Values after reset, by offset / 4.", "RESETS", resets),
        ):
            yield f"/* {title} */"
            yield f"static const uint32_t {kind}_{name}{size} = {{"
            for each, by_offset in zip(peripherals, values, strict=True):
                numbers = [f"[{at // 4}] = 0x{value:X}" for at, value in by_offset.items() if value]
                lines = [", ".join(numbers[at : at + 5]) for at in range(0, len(numbers), 5)] or ["0"]
                yield f"  {{ /* {each.name} */"
                yield from (f"    {line}," for line in lines)
                yield "  },"
            yield "};"
            yield ""
