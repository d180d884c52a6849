"""C headers made of the declared registers: what the blocks in C call offsets, bits and reset values.

Names are the manual's without the block's, as its chapter has them: ``CR1`` is an offset, ``CR1_UE`` the bits
of a field, ``CR2_STOP_SHIFT`` where one of several bits begins, ``CR1_RESET`` and ``CR1_STORED`` the value
after reset and the bits that keep what is written. So a C file includes the header of its own chapter only.
``C_PREFIX`` of a module goes before all of them, where C has a name already.
"""

from __future__ import annotations

from collections.abc import Iterator
from types import ModuleType

from fcu_emulator.emulator.chip.registers.block import WORD, Word, block, words

_PER_LINE = 8


def file_name(module: ModuleType) -> str:
    """``registers_usart.h``."""
    return f"registers_{_kind(module)}.h"


def header(module: ModuleType) -> str:
    """The whole text of the header of a kind of block."""
    kind = _kind(module)
    title = (module.__doc__ or "").partition("\n")[0]
    prefix: str = getattr(module, "C_PREFIX", "")
    guard = f"FCU_REGISTERS_{kind.upper()}_H"
    return "\n".join(
        [
            f"/* {title}",
            " *",
            f" * Made of emulator/chip/registers/{kind}.py, by python -m fcu_emulator.emulator.chip.registers. */",
            f"#ifndef {guard}",
            f"#define {guard}",
            "",
            "#include <stdint.h>",
            "",
            *(line for register in words(module) for line in (*_register(register, prefix), "")),
            *_tables(module, kind.upper()),
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
    """The offsets of all registers; where blocks of a kind differ, what each has, by offset / 4."""
    blocks = [block(module, name) for name in module.INSTANCES]
    offsets = sorted({register.offset for one in blocks for register in one.registers})
    texts = [f"0x{offset:02X}" for offset in offsets]
    yield "/* All of them; -1 ends the list. */"
    yield f"static const int16_t {kind}_OFFSETS[] = {{"
    yield from (f"  {', '.join(texts[at : at + _PER_LINE])}," for at in range(0, len(texts), _PER_LINE))
    yield "  -1,"
    yield "};"
    yield ""
    if hasattr(module, "VARIANTS"):
        size = f"[{len(blocks)}][{offsets[-1] // 4 + 1}]"
        bits = [{one.offset: one.bits for one in each.registers} for each in blocks]
        resets = [each.resets for each in blocks]
        for title, name, values in (
            ("The bits that each block has, by offset / 4.", "EXISTING", bits),
            ("Values after reset, by offset / 4.", "RESETS", resets),
        ):
            yield f"/* {title} */"
            yield f"static const uint32_t {kind}_{name}{size} = {{"
            for each, by_offset in zip(blocks, values, strict=True):
                numbers = [f"[{at // 4}] = 0x{value:X}" for at, value in by_offset.items() if value]
                lines = [", ".join(numbers[at : at + 5]) for at in range(0, len(numbers), 5)] or ["0"]
                yield f"  {{ /* {each.name} */"
                yield from (f"    {line}," for line in lines)
                yield "  },"
            yield "};"
            yield ""
