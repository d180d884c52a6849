"""Declared registers of the chip's peripherals agree with the firmware's headers and with the model.

The headers were written separately from the manuals.
"""

from __future__ import annotations

import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from hypothesis import Phase, given, settings
from hypothesis import strategies as st

from fcu_emulator.emulator.chip import memory_map, native
from fcu_emulator.emulator.chip.chip import SystemPeripherals
from fcu_emulator.emulator.chip.library import NativePeripheral
from fcu_emulator.emulator.chip.peripherals.peripheral import Peripheral
from fcu_emulator.emulator.chip.registers import DECLARED, SYSTEM_CONTROL_SPACE, names_of
from fcu_emulator.emulator.chip.registers.c_headers import headers
from fcu_emulator.emulator.chip.registers.declaration import WORD, PeripheralRegister
from fcu_emulator.emulator.clock import PS_PER_MS, PS_PER_US
from fcu_emulator.emulator.trace import DeviceNote
from tests.support.arm.chip_fakes import Chip, NativeChip

ROOT = Path(__file__).parents[2]
SUPPORT = ROOT / "firmware_model" / "arm" / "support"
NATIVE = ROOT / "emulator" / "chip" / "native"
HEADERS = SUPPORT / "stm32f401xc.h", SUPPORT / "cortex_m4.h", ROOT / "tests" / "arm" / "vendor" / "vendor.h"
TEXT = "\n".join(path.read_text(encoding="utf-8") for path in HEADERS)
FIRST = {"GPIO": "GPIOA", "TIM": "TIM1", "USART": "USART1", "I2C": "I2C1", "SPI": "SPI1", "DMA": "DMA1"}
PREFIXES = {"DMA": "S0", "DMA_Stream": "S0", "SysTick": "SYST_", "NVIC": "NVIC_"}
SPELT = {"SysTick": {"CTRL": "CSR", "LOAD": "RVR", "VAL": "CVR"}}
FIELD_SPELT = {"NE": "NF"}
"""Fields for which the headers use the names of CMSIS instead of those of the manual."""
blocks = pytest.mark.parametrize("name", DECLARED)


def find(kind: str, name: str) -> PeripheralRegister | None:
    """Return a register by its name in the headers."""
    block = DECLARED.get(FIRST.get(kind, kind.removesuffix("_Stream") + "1" * (kind == "DMA_Stream")))
    own = SPELT.get(kind, {}).get(name, name)
    return (
        next((one for one in block.registers if one.name in (PREFIXES.get(kind, "") + own, own)), None)
        if block
        else None
    )


def masks() -> Iterator[tuple[PeripheralRegister, str, int]]:
    """Return register, rest of the name, and value of each such number in the headers."""
    number = r"(?:BIT\((?P<bit>\d+)\)|\(?(?P<value>0x[0-9A-F]+|\d+)U(?: << (?P<shift>\d+)\))?)"
    for one in re.finditer(rf"^#define (\w+?)_(\w+?)_(\w+) {number}$", TEXT, re.MULTILINE):
        kind, name, field = one.groups()[:3]
        register = find(kind, name)
        if register is not None:
            bit, value, shift = one["bit"], one["value"], one["shift"]
            yield register, field, 1 << int(bit) if bit else int(value, 0) << int(shift or 0)


MASKS = list(masks())
STRUCTURES = re.findall(r"typedef struct \{\n(.*?)\n\} (\w+)_(?:TypeDef|Type);", TEXT, re.DOTALL)
ADDRESSES = re.findall(r"#define (\w+) \(\(\w+ \*\)(0x[0-9A-F]+)U\)", TEXT)


# -- the firmware's headers as witness ----------------------------------------------------------------------


def test_headers_have_enough_definitions() -> None:
    assert len(MASKS) > 100
    assert len(STRUCTURES) >= 10
    assert len(ADDRESSES) > 10


@pytest.mark.parametrize(
    ("register", "name", "mask"), MASKS, ids=[f"{one[0].name}_{one[1]}" for one in MASKS]
)
def test_masks_in_header_are_from_declared_fields(register: PeripheralRegister, name: str, mask: int) -> None:
    """``CR2_STOP`` is the field, ``CFGR_SWS_Pos`` its lowest bit, ``PLLCFGR_PLLSRC_HSE`` a value in it."""
    if name == "RESET":
        assert register.reset == mask
        return
    own = FIELD_SPELT.get(name, name)
    fields = [
        one
        for one in register.fields()
        if own.startswith(f"{one.name}_") or one.name in (own, *own.split("_"))
    ]
    bits = sum((1 << field.msb + 1) - (1 << field.lsb) for field in fields)

    assert fields
    if name.endswith("_Pos"):
        assert mask == fields[0].lsb
    else:
        assert mask & ~bits == 0


@pytest.mark.parametrize(("members", "kind"), STRUCTURES, ids=[kind for _, kind in STRUCTURES])
def test_header_structures_equal_register_offsets(members: str, kind: str) -> None:
    sizes = {"uint8_t": 1, "uint32_t": 4}
    offset, seen = 0, 0
    base = {"DMA_Stream": 0x10, "SysTick": 0x10, "NVIC": 0x100, "SCB": 0xD00}.get(kind, 0)
    for line in re.sub(r"/\*.*?\*/|volatile|const", "", members).splitlines():
        size, _, rest = line.strip(" ;").partition(" ")
        if size not in sizes:
            break  # DMA's streams have a structure of their own
        for member in rest.split(","):
            name, _, count = member.strip(" ;").partition("[")
            register = find(kind, name) or find(kind, f"{name}0")
            if register is not None:
                assert register.offset == base + offset, register.name
                seen += 1
            offset += sizes[size] * int(count.rstrip("];") or 1)
    assert seen >= 3 or kind in {"PWR", "DMA"}


@pytest.mark.parametrize(("name", "address"), [one for one in ADDRESSES if one[0] in memory_map.ADDRESSES])
def test_peripheral_address_equals_header(name: str, address: str) -> None:
    assert memory_map.ADDRESSES[name][0] == int(address, 0)


# -- laws ---------------------------------------------------------------------------------------------------


@blocks
def test_registers_are_aligned_and_uniquely_named(name: str) -> None:
    block = DECLARED[name]
    offsets = [one.offset for one in block.registers]

    assert len({one.name for one in block.registers}) == len(set(offsets)) == len(offsets) > 0
    assert all(offset % 4 == 0 for offset in offsets)
    assert name in memory_map.ADDRESSES or name in SYSTEM_CONTROL_SPACE


@blocks
def test_fields_do_not_overlap_within_word(name: str) -> None:
    for one in DECLARED[name].registers:
        used = 0
        for field in one.fields():
            bits = (1 << field.msb + 1) - (1 << field.lsb)
            assert 0 <= field.lsb <= field.msb < 32
            assert field.bits.overlay or not used & bits, f"{one.name}.{field.name}"
            used |= bits


@blocks
def test_registers_and_fields_have_descriptions(name: str) -> None:
    block = DECLARED[name]

    assert block.title
    assert block.source
    assert all((one.declared.__doc__ or "").strip().endswith(".") for one in block.registers)
    assert all(field.bits.doc for one in block.registers for field in one.fields())


# -- what the blocks do -------------------------------------------------------------------------------------


def made(name: str) -> Peripheral:
    """Return the peripheral without a core; the peripherals of the core share one."""
    python = {block.name: block for block in SystemPeripherals(Chip().soc)}
    return python.get(name) or NativeChip()["SCS" if name in SYSTEM_CONTROL_SPACE else name]


@blocks
def test_reset_values_and_names_equal_declaration(name: str) -> None:
    """Exceptions are IDR, which shows the levels of the pins, and SSR, which counts."""
    block = made(name)
    registers = [one for one in DECLARED[name].registers if one.name not in {"IDR", "SSR"}]

    assert {one.name: hex(block.peek(one.offset)) for one in registers} == {
        one.name: hex(one.reset) for one in registers
    }
    assert {one.offset: one.name for one in registers}.items() <= block.NAMES.items()
    assert names_of(block.name) == block.NAMES


@blocks
def test_undeclared_bits_cannot_be_set(name: str) -> None:
    block = made(name)
    for one in DECLARED[name].registers:
        block.write(one.offset, WORD)

        assert hex(block.peek(one.offset) & ~one.bits & ~one.reset) == "0x0", one.name


def passes(block: Peripheral, duration_ps: int) -> None:
    """Let time pass for a peripheral from :func:`made`."""
    if isinstance(block, NativePeripheral):
        block._chip.advance_to(block._chip.clock.now_ps + duration_ps)
    else:
        block.soc.clock.advance_to(block.soc.clock.now_ps + duration_ps)


@blocks
@settings(max_examples=20, phases=[Phase.generate])
@given(data=st.data())
def test_debugger_peek_equals_firmware_read(name: str, data: st.DataObject) -> None:
    block, registers = made(name), DECLARED[name].registers
    offsets = st.sampled_from([one.offset for one in registers])
    values = st.sampled_from([0, 1, WORD]) | st.integers(0, WORD)
    for offset, value, pause_ps in data.draw(
        st.lists(st.tuples(offsets, values, st.sampled_from([0, 1_000, PS_PER_US, PS_PER_MS])), max_size=8)
    ):
        block.write(offset, value)
        passes(block, pause_ps)
    seen = {one.name: hex(block.peek(one.offset)) for one in registers}

    assert seen == {one.name: hex(block.peek(one.offset)) for one in registers}
    for one in data.draw(st.permutations(registers)):
        assert (one.name, block.peek(one.offset)) == (one.name, block.read(one.offset))


@blocks
def test_modelled_fields_are_not_noted(name: str) -> None:
    """``fcu registers`` shows the modelled fields. SPE alone makes a slave, which is not modelled; a master is."""
    block = made(name)
    trace = block._chip.trace if isinstance(block, NativePeripheral) else block.soc.trace
    for one in DECLARED[name].registers:
        fields = [field for field in one.fields() if field.bits.modelled and field.name != "SPE"]
        for field in fields if one.declared.modelled else []:
            block.write(one.offset, block.peek(one.offset) | (1 << field.msb + 1) - (1 << field.lsb))

    assert [note.text for note in trace.of(DeviceNote) if note.what == "not modelled"] == []


# -- the C headers ------------------------------------------------------------------------------------------


def test_generated_headers_beside_sources_are_current() -> None:
    """If they are not current: python building/library.py"""
    folder = NATIVE / "generated"
    assert {path.name: path.read_text(encoding="utf-8") for path in folder.glob("*.h")} == headers()


def test_every_generated_header_is_included() -> None:
    sources = "".join(path.read_text(encoding="utf-8") for path in native.sources(NATIVE))

    assert {name for name in headers() if f'#include "generated/{name}"' not in sources} == set()


# -- as a user sees them ------------------------------------------------------------------------------------


def fcu(*arguments: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "fcu_emulator", *arguments]
    return subprocess.run(command, capture_output=True, text=True, check=False, timeout=60)


def test_registers_command_prints_addresses_and_fields() -> None:
    done = fcu("registers", "tim9")

    assert done.returncode == 0
    assert "\n0x4001400C rw    0x00000000 DIER: " in done.stdout
    assert "\n         0 rw               UIE: interrupt on update\n" in done.stdout
    assert "BDTR" not in done.stdout


def test_registers_command_prints_addresses_of_core_peripherals() -> None:
    assert "\n0xE000ED28 rc_w1 0x00000000 CFSR: " in fcu("registers", "SCB").stdout


def test_registers_command_refuses_unknown_name() -> None:
    done = fcu("registers", "TIM6")

    assert done.returncode == 2
    assert done.stderr.startswith("fcu: unknown part 'TIM6'; known: LSM6DSL, ")
    assert done.stderr.count("\n") == 1
    assert all(name in done.stderr for name in DECLARED)
