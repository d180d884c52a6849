"""What Python and C both declare is the same: the structures they share, callbacks, and numbers.

The compiler is asked: each law becomes a ``_Static_assert`` behind the C headers.
"""

from __future__ import annotations

import ctypes
import shutil
import subprocess
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

import pytest

from emulator.arm import native
from emulator.arm.cpu import native_bus, native_engine, native_exceptions
from emulator.arm.cpu.engine import RAM, RAM_SIZE
from emulator.arm.peripherals import native_i2c
from emulator.arm.peripherals.i2c_sequence import DATA_LOST, STOP_EARLY
from emulator.clock import NEVER_PS

FOLDER = Path(native.__file__).parent
pytestmark = pytest.mark.skipif(shutil.which("gcc") is None, reason="needs gcc")

C_TYPES = {
    None: "void",
    ctypes.c_bool: "bool",
    ctypes.c_uint8: "uint8_t",
    ctypes.c_int16: "int16_t",
    ctypes.c_int32: "int32_t",
    ctypes.c_uint32: "uint32_t",
    ctypes.c_int64: "int64_t",
    ctypes.c_uint64: "uint64_t",
    ctypes.c_void_p: "void *",
}
IN_C = {
    "kept": "comparing",
    **{
        f"{name}_{half}": f"{name}[{index}]"
        for name in ("pending", "enabled", "active", "lines")
        for index, half in enumerate(("low", "high"))
    },
}
"""Fields that Python has other names for, because it has properties or methods of these."""
BUS_PARTS = native_bus._NativeTimeline, native_bus._NativeSlice, native_bus._NativeWaiting


def c_type(kind: Any) -> str:
    """A type of ctypes as C spells it."""
    if hasattr(kind, "_argtypes_"):
        return f"{c_type(kind._restype_)} (*)({', '.join(map(c_type, kind._argtypes_)) or 'void'})"
    if hasattr(kind, "_length_"):
        return f"{c_type(kind._type_)}[{kind._length_}]"
    return C_TYPES[kind]


def fields(structure: type[ctypes.Structure], name: str, begin: int = 0) -> Iterator[str]:
    """Each field is where C has it, and of its type; ``begin`` is where ``structure`` begins in ``name``."""
    for field, kind, *_ in structure._fields_:
        in_c = IN_C.get(field, field)
        yield f"offsetof({name}, {in_c}) == {begin + getattr(structure, field).offset}"
        yield f"__builtin_types_compatible_p(__typeof__((({name} *)0)->{in_c}), {c_type(kind)})"


def bus_fields() -> Iterator[str]:
    begin = 0
    for part in BUS_PARTS:
        yield from fields(part, "Bus", begin)
        begin += ctypes.sizeof(part)


def callbacks() -> Iterator[str]:
    """These are given to C one by one."""
    for name, kind in (
        ("ReadCallback", native_engine._READ),
        ("WriteCallback", native_engine._WRITE),
        ("CodeHook", native_engine._CODE_HOOK),
        ("MemoryHook", native_engine._MEMORY_HOOK),
    ):
        yield f"__builtin_types_compatible_p({name}, {c_type(kind)})"


def numbers() -> Iterator[str]:
    yield from (f"STOP_{stop.name} == {number}" for number, stop in native_engine._STOPS.items())
    yield f"STOP_FETCH == {native_engine._FETCH}"
    yield f"STOP_REFUSED == {native_engine._REFUSED}"
    yield from (f"ANSWER_{name.upper()} == {number}" for number, name in enumerate(native_i2c._ANSWERS))
    yield f"WRONG_DATA_LOST == {native_i2c._WRONG.index(DATA_LOST)}"
    yield f"WRONG_STOP_EARLY == {native_i2c._WRONG.index(STOP_EARLY)}"
    yield f"NEVER_PS == {NEVER_PS}"
    yield f"RAM_BASE == {RAM}"
    yield f"RAM_SIZE == {RAM_SIZE}"


def register_numbers() -> Iterator[str]:
    """R0 to R15 are their own numbers, S0 to S31 follow one another."""
    numbers = native_engine._NUMBERS
    yield from (
        f"{name.upper()} == {number}" for name, number in numbers.items() if 16 <= number <= numbers["s0"]
    )


def whole(structure: type[ctypes.Structure], name: str) -> Iterator[str]:
    """All of a structure that C is given by value, or whose size Python must know."""
    yield from fields(structure, name)
    yield f"sizeof({name}) == {ctypes.sizeof(structure)}"


def refused(laws: Iterable[str], include: str) -> str:
    """What the compiler says against it; nothing if all laws hold."""
    lines = ["#include <stddef.h>", f'#include "{include}"', *(f'_Static_assert({law}, "");' for law in laws)]
    command = ["gcc", "-std=gnu11", "-fsyntax-only", f"-I{FOLDER}", "-x", "c", "-"]
    done = subprocess.run(command, input="\n".join(lines), capture_output=True, text=True, check=False)
    return done.stderr


@pytest.mark.parametrize(
    ("laws", "include"),
    [
        pytest.param(fields(native_engine._State, "Core"), "core.h", id="Core"),
        pytest.param(bus_fields(), "bus.h", id="Bus"),
        pytest.param(whole(native_exceptions.NativeNvic, "Nvic"), "nvic.h", id="Nvic"),
        pytest.param(fields(native_i2c._I2c, "I2c"), "i2c.h", id="I2c"),
        pytest.param(whole(native_i2c._Wire, "Wire"), "i2c.h", id="Wire"),
        pytest.param(callbacks(), "core.h", id="callbacks"),
        pytest.param(numbers(), "i2c.h", id="numbers"),
        pytest.param(register_numbers(), "state.c", id="registers"),
    ],
)
def test_python_and_c_agree(laws: Iterator[str], include: str) -> None:
    assert not refused(laws, include)


@pytest.mark.parametrize(
    "law",
    ["offsetof(Core, limit) == 0", "__builtin_types_compatible_p(CodeHook, void (*)(void))", "STOP_WFI == 0"],
)
def test_a_disagreement_is_noticed(law: str) -> None:
    assert "static assertion failed" in refused([law], "core.h")
