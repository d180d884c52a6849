"""Python and C declare the same functions, callbacks, structures and numbers.

The compiler checks this: each rule becomes a ``_Static_assert`` after the C headers. A structure in Python names its
C struct in the first line of its docstring, so that a new structure is covered without an entry here.
"""

from __future__ import annotations

import ctypes
import importlib
import pkgutil
import re
import shutil
import subprocess
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

import pytest

import fcu_emulator.emulator.chip
from fcu_emulator.emulator.chip import library, native, sensor_registers
from fcu_emulator.emulator.chip.cpu import bare_core, core, exceptions
from fcu_emulator.emulator.chip.memory_map import (
    FLASH,
    FLASH_SIZE,
    RAM,
    RAM_SIZE,
    SYSTEM_MEMORY,
    SYSTEM_MEMORY_SIZE,
)
from fcu_emulator.emulator.chip.peripherals import adc, gpio, i2c, spi
from fcu_emulator.emulator.chip.registers import dma
from fcu_emulator.emulator.clock import NEVER_PS
from fcu_emulator.sensors import shared_registers
from fcu_emulator.sensors.register import ADDRESSES

FOLDER = Path(native.__file__).parent
C_TYPES = {
    None: "void",
    ctypes.c_int8: "int8_t",
    ctypes.c_uint8: "uint8_t",
    ctypes.c_int32: "int32_t",
    ctypes.c_uint32: "uint32_t",
    ctypes.c_int64: "int64_t",
    ctypes.c_uint64: "uint64_t",
    ctypes.c_double: "double",
    ctypes.c_char_p: "const char *",
}
_DECLARATION = re.compile(r"^([\w ]+?[ *])(fcu_\w+)\(([^;]*)\);", re.MULTILINE)
_NAMED = re.compile(r"struct (\w+)( of \w+\.h)?\.")
needs_gcc = pytest.mark.skipif(shutil.which("gcc") is None, reason="needs gcc")


def mirrored() -> dict[type[ctypes.Structure], str]:
    """Yield each structure in Python that C also has, with its name in C."""
    for module in pkgutil.walk_packages(fcu_emulator.emulator.chip.__path__, "fcu_emulator.emulator.chip."):
        if not module.name.endswith(("__main__", ".libfcu")):
            importlib.import_module(module.name)
    found: dict[type[ctypes.Structure], str] = {}
    for one in ctypes.Structure.__subclasses__():
        if one.__module__.startswith("fcu_emulator."):
            named = _NAMED.match(one.__doc__ or "")
            assert named is not None, f"{one} must name its C struct in its docstring"
            found[one] = named[1]
    return found


MIRRORED = mirrored()


def c_type(kind: Any) -> str:
    """Return a type of ctypes in the notation of C. Python only reads through the pointers that it receives."""
    if hasattr(kind, "_argtypes_"):
        return f"{c_type(kind._restype_)} (*)({', '.join(map(c_type, kind._argtypes_)) or 'void'})"
    if hasattr(kind, "_length_"):
        return f"{c_type(kind._type_)}[{kind._length_}]"
    if hasattr(kind, "contents"):
        return f"const {c_type(kind._type_)} *"
    return MIRRORED.get(kind) or C_TYPES[kind]


def fields(structure: type[ctypes.Structure], name: str) -> Iterator[str]:
    """Yield rules: each field has the same position and type as in C."""
    for field, kind, *_ in structure._fields_:
        yield f"offsetof({name}, {field}) == {getattr(structure, field).offset}"
        yield f"__builtin_types_compatible_p(__typeof__((({name} *)0)->{field}), {c_type(kind)})"
    yield f"sizeof({name}) == {ctypes.sizeof(structure)}"


def enumerated(prefix: str, names: Iterable[str]) -> Iterator[str]:
    """Yield rules: the position of each name is its number in C. "" is skipped: this number has no name in C."""
    for number, name in enumerate(names):
        if name:
            yield f"{prefix}{name.upper().replace(' ', '_')} == {number}"


def refused(laws: Iterable[str], include: str = "fcu.h") -> str:
    """Return the compiler's output about rules that do not hold."""
    text = f'#include <stddef.h>\n#include "{include}"\n'
    text += "".join(f'_Static_assert({law}, "");\n' for law in laws)
    command = ["gcc", "-std=gnu11", "-fsyntax-only", f"-I{FOLDER}", "-x", "c", "-"]
    done = subprocess.run(command, input=text, capture_output=True, text=True, check=False)
    return done.stderr


@needs_gcc
@pytest.mark.parametrize(("structure", "name"), MIRRORED.items(), ids=MIRRORED.values())
def test_structure_is_same_in_python_and_c(structure: type[ctypes.Structure], name: str) -> None:
    assert not refused(fields(structure, name))


def test_every_mirrored_structure_is_found() -> None:
    assert set(MIRRORED.values()) >= {
        "Host",
        "Status",
        "I2cMessage",
        "SpiMessage",
        "SpiUnaddressed",
        "TickCounts",
    }


@needs_gcc
def test_constants_are_same_in_python_and_c() -> None:
    laws = (
        f"FLASH_BASE == {FLASH} && FLASH_SIZE == {FLASH_SIZE}",
        f"RAM_BASE == {RAM} && RAM_SIZE == {RAM_SIZE}",
        f"SYSTEM_MEMORY_BASE == {SYSTEM_MEMORY} && SYSTEM_MEMORY_SIZE == {SYSTEM_MEMORY_SIZE}",
        f"NEVER_PS == {NEVER_PS}",
        "STOP_WRITE == 14 && ENDED_HALTED == 1 && RESET_SYSRESETREQ == 1 && WRITE_UNKNOWN == 3",
        "offsetof(Chip, now_ps) == 0 && offsetof(Chip, host_next_ps) == 8 && offsetof(Chip, until_ps) == 16",
        "offsetof(Chip, must_stop) == 24 && offsetof(Chip, detailed) == 32",
        f"TARGETS == {sensor_registers._TARGETS} && offsetof(SensorRegisters, positions) == 0",
        f"POSITION_SYNCED == {sensor_registers._SYNCED} && BANK_REFUSED == {sensor_registers._REFUSED}",
        f"OUTPUTS == {shared_registers.OUTPUTS} && OUTPUT_WIDTH == {shared_registers.WIDTH}",
        f"TRAIN_AHEAD == {shared_registers.AHEAD} && SUBADDRESSES == {ADDRESSES}",
        *enumerated("ACCESS_", ("live", "memory", "status", "output")),
        f"I2C_BYTES == {i2c._BYTES} && I2C_RECENT == {i2c._RECENT} && SPI_RECEIVED == {spi._RECEIVED}",
        f"ADC_CHANNELS == {adc._CHANNELS}",
        f"PORTS == {len(gpio.PORTS)} && INTERRUPTS == {exceptions.INTERRUPTS}",
        f"FIRST_INTERRUPT == {exceptions.FIRST_INTERRUPT}",
    )
    assert not refused(laws)


@needs_gcc
def test_enumerations_have_same_order_in_python_and_c() -> None:
    ignored = (f"{access}_{kind}" for kind, access in core._IGNORED_ACCESSES)
    laws = (
        *enumerated("NOTE_", library.NOTE_KINDS),
        *(law.replace("WRITTEN", "WRITE").replace("CLOCK", "UNCLOCKED") for law in enumerated("", ignored)),
        *enumerated("STOP_", (one.name for one in bare_core._STOPS)),
        *enumerated("RESET_", core._REASONS[:2]),
        f"ENDED_HALTED == {core._HALTED}",
        *enumerated("REQUEST_", ("", *dma.REQUESTS)),
        f"REQUESTS == {len(dma.REQUESTS) + 1}",
        *(
            f"{name} == {getattr(exceptions, name)}"
            for name in ("NMI", "HARD_FAULT", "MEM_MANAGE", "BUS_FAULT", "USAGE_FAULT")
        ),
        *(f"{name} == {getattr(exceptions, name)}" for name in ("SV_CALL", "PEND_SV", "SYS_TICK")),
    )
    assert not refused(laws)
    assert not refused(enumerated("ANSWER_", i2c._ANSWERS), "peripherals/i2c.c")


@needs_gcc
def test_registers_have_same_numbers_in_python_and_c() -> None:
    numbers = library._REGISTER_NUMBERS
    named = ("xpsr", "msp", "psp", "primask", "basepri", "faultmask", "control", "fpscr", "s0")
    assert not refused([f"{name.upper()} == {numbers[name]}" for name in named], "cpu/state.c")
    assert [numbers[f"s{n}"] - numbers["s0"] for n in range(32)] == list(range(32))


@needs_gcc
def test_false_static_assertion_is_refused() -> None:
    assert "static assertion failed" in refused(["sizeof(Status) == 1"])


def _kind(declared: str) -> str:
    """Return the type of an argument or result in C; all pointers have the same kind."""
    words = declared.replace("const", "").split()
    return "pointer" if "*" in declared or "callback" in words else words[0]


def _kind_of(kind: Any) -> str:
    """Return the kind of a type of ctypes."""
    is_pointer = kind is ctypes.c_void_p or hasattr(kind, "_argtypes_") or hasattr(kind, "contents")
    return "pointer" if is_pointer else C_TYPES[kind]


def test_functions_have_same_types_in_python_and_c() -> None:
    text = re.sub(r"/\*.*?\*/", "", (FOLDER / "fcu.h").read_text(encoding="utf-8"), flags=re.DOTALL)
    text = re.sub(r"void \(\*\w+\)\([^)]*\)|int32_t \(\*\w+\)\([^)]*\)", "callback", text)
    in_c = {
        name: [_kind(one) for one in (result, *(arguments.split(",") if arguments != "void" else ()))]
        for result, name, arguments in _DECLARATION.findall(text)
    }
    in_python = {name: [_kind_of(one) for one in kinds] for name, kinds in library._FUNCTIONS.items()}

    assert len(in_c) > 40
    assert in_python == in_c
