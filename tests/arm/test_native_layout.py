"""What Python and C both declare is the same: functions, callbacks, structures, numbers.

The compiler is asked: each law becomes a ``_Static_assert`` behind the C headers.
"""

from __future__ import annotations

import ctypes
import re
import shutil
import subprocess
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

import pytest

from emulator.chip import library, native, targets
from emulator.chip.library import ClocksTable, HostTable, Status
from emulator.chip.memory_map import FLASH, FLASH_SIZE, RAM, RAM_SIZE, SYSTEM_MEMORY, SYSTEM_MEMORY_SIZE
from emulator.chip.peripherals import i2c
from emulator.chip.peripherals.i2c import I2cTable
from emulator.chip.targets import TargetTable
from emulator.time.clock import NEVER_PS

FOLDER = Path(native.__file__).parent
C_TYPES = {
    None: "void",
    ctypes.c_uint8: "uint8_t",
    ctypes.c_int32: "int32_t",
    ctypes.c_uint32: "uint32_t",
    ctypes.c_int64: "int64_t",
    ctypes.c_uint64: "uint64_t",
    ctypes.c_char_p: "const char *",
}
_DECLARATION = re.compile(r"^[\w ]+?[ *](fcu_\w+)\(([^;]*)\);", re.MULTILINE)
needs_gcc = pytest.mark.skipif(shutil.which("gcc") is None, reason="needs gcc")


def c_type(kind: Any) -> str:
    """A type of ctypes as C spells it."""
    if hasattr(kind, "_argtypes_"):
        return f"{c_type(kind._restype_)} (*)({', '.join(map(c_type, kind._argtypes_)) or 'void'})"
    if hasattr(kind, "_length_"):
        return f"{c_type(kind._type_)}[{kind._length_}]"
    return C_TYPES[kind]


def fields(structure: type[ctypes.Structure], name: str) -> Iterator[str]:
    """Each field is where C has it, and of its type."""
    for field, kind, *_ in structure._fields_:
        yield f"offsetof({name}, {field}) == {getattr(structure, field).offset}"
        yield f"__builtin_types_compatible_p(__typeof__((({name} *)0)->{field}), {c_type(kind)})"
    yield f"sizeof({name}) == {ctypes.sizeof(structure)}"


def refused(laws: Iterable[str], include: str = "fcu.h") -> str:
    """What the compiler says of laws that do not hold."""
    text = f'#include <stddef.h>\n#include "{include}"\n'
    text += "".join(f'_Static_assert({law}, "");\n' for law in laws)
    command = ["gcc", "-std=gnu11", "-fsyntax-only", f"-I{FOLDER}", "-x", "c", "-"]
    done = subprocess.run(command, input=text, capture_output=True, text=True, check=False)
    return done.stderr


@needs_gcc
@pytest.mark.parametrize(
    ("structure", "name"),
    [
        (HostTable, "Host"),
        (ClocksTable, "Clocks"),
        (Status, "Status"),
        (TargetTable, "TargetCalls"),
        (I2cTable, "I2cCalls"),
        (i2c._Message, "I2cMessage"),
    ],
)
def test_a_structure_is_the_same_on_both_sides(structure: type[ctypes.Structure], name: str) -> None:
    assert not refused(fields(structure, name))


@needs_gcc
def test_numbers_are_the_same_on_both_sides() -> None:
    laws = (
        f"FLASH_BASE == {FLASH} && FLASH_SIZE == {FLASH_SIZE}",
        f"RAM_BASE == {RAM} && RAM_SIZE == {RAM_SIZE}",
        f"SYSTEM_BASE == {SYSTEM_MEMORY} && SYSTEM_SIZE == {SYSTEM_MEMORY_SIZE}",
        f"NEVER_PS == {NEVER_PS}",
        "STOP_WRITE == 14 && ENDED_HALTED == 1 && RESET_SYSRESETREQ == 1 && WRITE_UNKNOWN == 3",
        "offsetof(Chip, now_ps) == 0 && offsetof(Chip, host_next_ps) == 8 && offsetof(Chip, until_ps) == 16",
        "offsetof(Chip, must_stop) == 24 && offsetof(Chip, detailed) == 32",
        f"TARGETS == {targets._TARGETS} && KEPT_BYTES == {targets._BYTES}",
        f"offsetof(Targets, reads) == 8 * {targets._READS}",
        f"offsetof(Targets, positions) == 8 * {targets._POSITIONS}",
        f"offsetof(Targets, answered) == 8 * {targets._ANSWERED}",
        f"offsetof(Targets, prefetched) == {targets._PREFETCHED}",
        f"sizeof(Prefetched) == {targets._PUT.size}",
        *(
            f"offsetof(I2cWire, {name}) == {getattr(i2c._Wire, name).offset}"
            for name, _ in i2c._Wire._fields_
        ),
        f"sizeof(I2cWire) == {ctypes.sizeof(i2c._Wire)} && I2C_RECENT == {i2c._RECENT}",
    )
    assert not refused(laws)


@needs_gcc
def test_a_law_that_does_not_hold_is_refused() -> None:
    assert "static assertion failed" in refused(["sizeof(Status) == 1"])


def test_every_function_of_the_header_is_declared_in_python_with_as_many_arguments() -> None:
    text = re.sub(r"/\*.*?\*/", "", (FOLDER / "fcu.h").read_text(encoding="utf-8"), flags=re.DOTALL)
    text = re.sub(r"void \(\*\w+\)\([^)]*\)|int32_t \(\*\w+\)\([^)]*\)", "callback", text)
    in_c = {
        name: 0 if arguments == "void" else arguments.count(",") + 1
        for name, arguments in _DECLARATION.findall(text)
    }
    in_python = {name: len(kinds) - 1 for name, kinds in library._FUNCTIONS.items()}

    assert len(in_c) > 40
    assert in_python == in_c
