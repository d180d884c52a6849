"""The functions of tests/arm/calls: random signatures in GCC's form of the procedure call standard.

``python -m tests.support.arm.call_programs`` writes ``functions.c`` and builds it for hard and soft floating-point
arguments. The ELF files are in the repository, so tests need no compiler. Each function stores its arguments in a
structure and returns one argument.
"""

from __future__ import annotations

import random
import shutil
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

FOLDER = Path(__file__).parents[2] / "arm" / "calls"
ABIS = ("hard", "softfp")
COUNT = 80
_SEED = 20

TYPES: dict[str, str] = {
    "int8_t": "i8", "uint8_t": "u8", "int16_t": "i16", "uint16_t": "u16", "int32_t": "i32", "uint32_t": "u32",
    "int64_t": "i64", "uint64_t": "u64", "bool": "bool", "float": "f32", "double": "f64",
    "Axes": "iii", "Bytes": "bbb", "Pair": "ff", "Triple": "ddd", "Mixed": "bd", "Four": "ffff",
    "Five": "fffff", "Halves": "hh",
}  # fmt: skip
"""C types, and the kinds of their values."""
_LETTERS = {"i": "i32", "b": "u8", "f": "f32", "d": "f64", "h": "i16"}


@dataclass(frozen=True)
class Function:
    """The function ``f<number>``; ``result`` is the index of the argument that it returns."""

    number: int
    parameters: tuple[str, ...]
    result: int

    @property
    def name(self) -> str:
        return f"f{self.number}"


def functions() -> list[Function]:
    """Return the functions, which are always the same."""
    chance = random.Random(_SEED)
    made = []
    for number in range(COUNT):
        parameters = tuple(chance.choice(list(TYPES)) for _ in range(chance.randint(1, 9)))
        made.append(Function(number, parameters, chance.randrange(len(parameters))))
    return made


def value(kind: str, chance: random.Random) -> Any:
    """Return a random value of a C type that does not change when it is stored as this type."""
    code = TYPES[kind]
    if kind[0].isupper():
        return tuple(_number(_LETTERS[letter], chance) for letter in code)
    return _number(code, chance)


def _number(code: str, chance: random.Random) -> Any:
    if code == "bool":
        return chance.random() < 0.5
    if code in {"f32", "f64"}:
        return chance.randint(-(2**20), 2**20) / 8
    bits = int(code[1:])
    return chance.getrandbits(bits) - (2 ** (bits - 1) if code[0] == "i" else 0)


def source() -> str:
    """Return the random functions in C. The other functions are in special.c."""
    return "\n".join(_source()) + "\n"


def _source() -> Iterator[str]:
    yield "/* Written by tests/support/arm/call_programs.py. */"
    yield '#include "types.h"'
    yield ""
    for one in functions():
        members = " ".join(f"{kind} a{index};" for index, kind in enumerate(one.parameters))
        parameters = ", ".join(f"{kind} a{index}" for index, kind in enumerate(one.parameters))
        yield f"struct {{ {members} }} seen{one.number};"
        yield f"CALLED {one.parameters[one.result]} {one.name}({parameters}) {{"
        yield from (f"  seen{one.number}.a{index} = a{index};" for index in range(len(one.parameters)))
        yield f"  return a{one.result};"
        yield "}"
        yield ""


def build(folder: Path) -> None:
    """Write functions.c, and build both programs. Raises CalledProcessError."""
    (folder / "functions.c").write_text(source(), encoding="ascii")
    for abi in ABIS:
        flags = ["-mcpu=cortex-m4", "-mthumb", "-mfpu=fpv4-sp-d16", f"-mfloat-abi={abi}", "-O1", "-g"]
        flags += ["-std=gnu11", "-Wall", "-Werror", "-nostdlib", "-T", "calls.ld", "-Wl,--build-id=none"]
        flags += [f"-ffile-prefix-map={folder}=calls", "-fno-inline-small-functions"]
        name = f"calls-{abi}.elf"
        sources = ["functions.c", "special.c", "-lgcc", "-o", name]
        subprocess.run(["arm-none-eabi-gcc", *flags, *sources], cwd=folder, check=True)
        smaller = ["arm-none-eabi-objcopy", "--compress-debug-sections=zlib", name]
        subprocess.run(smaller, cwd=folder, check=True)


def build_elsewhere(folder: Path) -> None:
    """Build the programs from a copy of the sources."""
    for name in ("special.c", "types.h", "calls.ld"):
        shutil.copy(FOLDER / name, folder)
    build(folder)


if __name__ == "__main__":
    sys.exit(build(FOLDER))
