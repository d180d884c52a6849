"""Types and lines as GCC writes them, in every version of DWARF. The values are stated in C.

The tests need the cross compiler. Variables are constants, so that the file has their values.
"""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path
from typing import Any

import pytest

from fcu_emulator.emulator.chip.image import FirmwareImage, load_firmware
from tests.support.words import Words

pytestmark = pytest.mark.skipif(
    shutil.which("arm-none-eabi-gcc") is None, reason="arm-none-eabi-gcc is not installed"
)

LINKER_SCRIPT = """
SECTIONS {
  . = 0x08000000;
  .text : { KEEP(*(.vectors)) *(.text*) *(.rodata*) *(.data*) }
  /DISCARD/ : { *(.ARM.exidx*) }
}
"""
SOURCE = """
#include <stdbool.h>
#include <stdint.h>

typedef struct { int32_t AXIS_X, AXIS_Y, AXIS_Z; } Axes;
typedef enum { LOW = -1, HIGH = 7 } Level;
enum Big { HUGE_ONE = 0xFFFFFFF0u };
struct Node { struct Node *next; const char *name; int8_t weight; };
struct Mixed {
  uint8_t first;
  double number;
  union { uint32_t word; uint16_t halves[2]; } both;
  struct { int inner; };
  unsigned low : 3, middle : 10;
  int negative : 4;
  unsigned : 0;
  unsigned last : 32;
  Axes table[2];
};

#define KEEP __attribute__((used)) /* also by link-time optimisation */

KEEP const volatile Axes acc = {44, -23, 1008};
KEEP const float press = 977.400024f;
KEEP const double exact = 0.1;
KEEP const bool yes = true, no = false;
KEEP const int8_t small = -5;
KEEP const uint8_t byte = 0xFE;
KEEP const int16_t half = -30000;
KEEP const uint64_t wide = 0x123456789ABCDEF0u;
KEEP const int64_t negative_wide = -2;
KEEP const char text[4] = "abc";
KEEP const int matrix[2][3] = {{1, 2, 3}, {4, 5, 6}};
KEEP const Level level = LOW;
KEEP const enum Big big = HUGE_ONE;
KEEP const struct Mixed mixed = {
  .first = 1, .number = -2.5, .both.word = 0x00020001, .inner = 9, .low = 5, .middle = 1000,
  .negative = -3, .last = 0xFFFFFFFF, .table = {{1, 2, 3}, {-4, -5, -6}}};
extern const struct Node list;
KEEP const struct Node list = {&list, text, -1};
KEEP void (*const handler)(void) = (void (*)(void))0x08000101;
KEEP const Axes *const pointer = (const Axes *)0x20000004;

static int counted(int by) {
  static const volatile int step[2] = {3, 4};
  return step[by & 1] + by;
}

int work(int by) {
  int sum = 0;
  for (int i = 0; i < by; ++i)
    sum += counted(i);
  return sum + acc.AXIS_X;
}

void Reset_Handler(void) {
  for (;;)
    work(3);
}

const void *const vectors[] __attribute__((section(".vectors"), used)) = {(void *)0x20010000, Reset_Handler};
"""
EXPECTED = {
    "press": 977.4000244140625,  # the nearest float32
    "exact": 0.1,
    "yes": True,
    "no": False,
    "small": -5,
    "byte": 0xFE,
    "half": -30000,
    "wide": 0x1234_5678_9ABC_DEF0,
    "negative_wide": -2,
    "text": (97, 98, 99, 0),
    "matrix": ((1, 2, 3), (4, 5, 6)),
    "level": -1,
    "big": 0xFFFF_FFF0,
    "step": (3, 4),
    "handler": 0x0800_0101,
    "pointer": 0x2000_0004,
}
STYLES = [
    ["-gdwarf-2", "-gstrict-dwarf", "-O0"],
    ["-gdwarf-3", "-gstrict-dwarf", "-Os"],
    ["-gdwarf-4", "-O2", "-gz=zlib-gnu"],
    ["-gdwarf-5", "-g3", "-O0", "-ffunction-sections", "-fdata-sections"],  # what CubeIDE gives
    ["-gdwarf-5", "-Os", "-gz=zlib"],
    ["-gdwarf-5", "-O3"],
    ["-gdwarf-4", "-O2", "-flto", "-ffat-lto-objects"],
]
styles = pytest.mark.parametrize("style", STYLES, ids=" ".join)


def built(folder: Path, style: list[str]) -> FirmwareImage:
    (folder / "lab.c").write_text(SOURCE)
    (folder / "lab.ld").write_text(LINKER_SCRIPT)
    core = ["-mcpu=cortex-m4", "-mthumb", "-mfpu=fpv4-sp-d16", "-mfloat-abi=hard", "-nostdlib"]
    command = ["arm-none-eabi-gcc", *core, *style, "-T", "lab.ld", "lab.c", "-o", "lab.elf"]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return load_firmware(folder / "lab.elf")


def variable(image: FirmwareImage, name: str) -> Any:
    def memory(address: int, size: int) -> bytes:
        (segment,) = image.segments
        return segment.data[address - segment.address :][:size]

    assert image.symbols is not None
    return image.symbols.read_variable(name, memory)


@styles
def test_values_equal_those_in_source(tmp_path: Path, style: list[str]) -> None:
    image = built(tmp_path, style)

    assert {name: variable(image, name) for name in EXPECTED} == EXPECTED


@styles
def test_structures_have_members_of_source(tmp_path: Path, style: list[str]) -> None:
    image = built(tmp_path, style)
    acc, mixed, node = (variable(image, name) for name in ("acc", "mixed", "list"))

    assert (acc.AXIS_X, acc.AXIS_Y, acc.AXIS_Z) == (44, -23, 1008)
    assert (mixed.first, mixed.number, mixed.inner) == (1, -2.5, 9)
    assert (mixed.both.word, mixed.both.halves) == (0x0002_0001, (1, 2))
    assert (mixed.low, mixed.middle, mixed.negative, mixed.last) == (5, 1000, -3, 0xFFFF_FFFF)
    assert [axes.AXIS_Y for axes in mixed.table] == [2, -5]
    assert image.symbols is not None
    assert (node.next, node.name) == (image.symbols.address_of("list"), image.symbols.address_of("text"))
    assert node.weight == -1


@styles
def test_lines_equal_those_of_binutils(tmp_path: Path, style: list[str]) -> None:
    image = built(tmp_path, style)
    symbols = image.symbols
    assert symbols is not None
    start = symbols.function_at(image.reset_vector)
    assert start is not None
    assert start.name == "Reset_Handler"
    addresses = range(start.start, start.start + start.size, 2)
    command = ["arm-none-eabi-addr2line", "-e", "lab.elf", *map(hex, addresses)]
    lines = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=True).stdout.split(
        "\n"
    )

    shown = [str(symbols.line_at(address)) for address in addresses]

    assert shown == [Path(line.split(" ")[0]).name for line in lines if line]
    assert symbols.notes == []


@pytest.mark.parametrize(
    ("option", "advice"),
    [
        ("-fdebug-types-section", "-fdebug-types-section"),
        ("-gsplit-dwarf", "-gsplit-dwarf"),
        ("-g0", "-g "),
    ],
)
def test_error_about_debug_information_shows_compiler_option(
    tmp_path: Path, option: str, advice: str, words: Words
) -> None:
    image = built(tmp_path, ["-gdwarf-5", "-O2", option])

    with pytest.raises(KeyError, match=advice) as caught:
        variable(image, "acc")
    words("firmware_file", caught.value.args[0])
    assert image.symbols is not None
    found = image.symbols.function_at(image.reset_vector)
    assert found is not None
    assert found.name == "Reset_Handler"


def test_stripped_program_loads_same_bytes(tmp_path: Path, words: Words) -> None:
    whole, stripped = built(tmp_path, ["-g", "-O2"]), built(tmp_path, ["-O2", "-s"])

    assert stripped.segments == whole.segments
    assert stripped.symbols is None
    (note,) = stripped.notes
    words("firmware_file", note)


def test_hex_and_binary_equal_elf(tmp_path: Path) -> None:
    image = built(tmp_path, ["-O2"])
    for kind, name in (("ihex", "lab.hex"), ("binary", "lab.bin")):
        command = ["arm-none-eabi-objcopy", "-O", kind, "lab.elf", name]
        subprocess.run(command, cwd=tmp_path, check=True)

        assert load_firmware(tmp_path / name).segments == image.segments
