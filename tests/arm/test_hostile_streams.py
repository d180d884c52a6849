"""A hundred thousand random instruction streams on the C library, with sanitizers and without Python.

tests/arm/hostile generates them: random half-words, encodings of 32 bits, mutations of real programs, peripherals
with good and bad settings and any clock down to none, branches and accesses to the ends of memories. Streams have
numbers; ``hostile NUMBER COUNT PROGRAM ...`` repeats some of them.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from fcu_emulator.emulator.chip import native
from fcu_emulator.emulator.chip.image import load_firmware
from fcu_emulator.emulator.chip.memory_map import FLASH
from fcu_emulator.firmware_model.arm import prebuilt
from tests.support.arm import speed_programs
from tests.support.arm.vendor_programs import file

STREAMS = 100_000
FOLDER = Path(__file__).with_name("hostile")
SOURCES = Path(native.__file__).parent
CC = next((name for name in ("gcc", "clang") if shutil.which(name)), "")
FLAGS = (
    *("-std=gnu11", "-O1", "-g1", "-fwrapv", "-ffp-contract=off", '-DSOURCES="tests"', '-DCOMPILER="tests"'),
    *("-fsanitize=address,undefined", "-fno-sanitize-recover=all"),
)
FIRMWARE = (prebuilt("solution", "I2C2"), *map(file, ("all_blocks", "uart_dma", "events", "threads")))
ASSEMBLY = (speed_programs.I2C_BY_INTERRUPT, speed_programs.I2C_BY_DMA)
LEAST = {
    "instructions": 1000 * STREAMS,
    "accesses": 10 * STREAMS,
    "faults": STREAMS,
    "lock-ups": STREAMS // 10,
    "resets": STREAMS,
    "notes": STREAMS // 10,
    "bytes on buses": STREAMS // 40,
    "bytes sent": STREAMS // 20,
}
"""Minimum counts of the streams. If they are lower, most streams end before they cause any harm."""

pytestmark = [
    pytest.mark.skipif(not CC, reason="needs gcc or clang: neither is installed"),
    pytest.mark.skipif(sys.platform != "linux", reason="needs Linux and its sanitizers"),
]


@pytest.fixture(scope="module")
def driver(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Build the driver with the library's sources."""
    made = tmp_path_factory.mktemp("hostile") / "hostile"
    sources = *FOLDER.glob("*.c"), *SOURCES.rglob("*.c")
    command = [CC, *FLAGS, f"-I{SOURCES}", *sources, "-lm", "-o", made]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return made


@pytest.fixture(scope="module")
def programs(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    """Return the contents of flash of some programs."""
    contents = [flash_of(firmware) for firmware in FIRMWARE] + list(map(speed_programs.program, ASSEMBLY))
    folder = tmp_path_factory.mktemp("programs")
    files = [folder / f"{number}.bin" for number in range(len(contents))]
    for path, content in zip(files, contents, strict=True):
        path.write_bytes(content)
    return files


def flash_of(firmware: Path) -> bytes:
    """Return the data that a programmer writes, from the beginning of flash."""
    content = bytearray()
    for address, data in load_firmware(firmware).segments:
        end = address - FLASH + len(data)
        content += bytes(max(0, end - len(content)))
        content[address - FLASH : end] = data
    return bytes(content)


def run(driver: Path, first: int, count: int, programs: list[Path]) -> dict[str, str]:
    """Run the driver, and return its counts by name. If it fails, the test shows the output of the sanitizers."""
    options = {"ASAN_OPTIONS": "quarantine_size_mb=16", "UBSAN_OPTIONS": "print_stacktrace=1"}
    done = subprocess.run(
        [driver, str(first), str(count), *programs],
        env=os.environ | options,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr[-6000:]
    return dict(line.rsplit(" ", maxsplit=1) for line in done.stdout.splitlines())


def test_hostile_streams_pass_sanitizers(driver: Path, programs: list[Path]) -> None:
    seen = run(driver, 0, STREAMS, programs)

    assert int(seen["streams"]) == STREAMS
    assert {name for name, least in LEAST.items() if int(seen[name]) < least} == set(), seen


def test_stream_depends_only_on_its_number(driver: Path, programs: list[Path]) -> None:
    """So a result can be repeated by the number."""
    assert run(driver, 640, 640, programs) == run(driver, 640, 640, programs)


def test_sanitizer_finding_shows_number_of_stream(driver: Path, programs: list[Path]) -> None:
    """An option of the driver causes an error in the driver: it writes one byte after the chip's memory."""
    done = subprocess.run(
        [driver, "70", "1", *programs],
        env=os.environ | {"HOSTILE_MISTAKE": "1"},
        capture_output=True,
        text=True,
        check=False,
    )

    assert done.returncode != 0
    assert "heap-buffer-overflow" in done.stderr
    assert "in stream 70, of the group that begins with 64" in done.stderr
