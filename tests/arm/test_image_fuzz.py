"""Each of ten thousand damaged files is loaded or refused in one line. The cost is proportional to its size.

The mutations have fixed seeds, so that every run tries the same files. The cost is a count of steps in the reader of
debug information, not a time; all other readers read the file one time.
"""

from __future__ import annotations

import struct
import tracemalloc
from pathlib import Path
from random import Random

import pytest

from fcu_emulator.emulator.chip.image import FirmwareImage, Symbols, parse_firmware
from fcu_emulator.emulator.chip.memory_map import fits
from fcu_emulator.emulator.errors import FirmwareFileError
from tests.support.arm.elf_builder import FLASH, MAIN, RAM, RESET, code, debug_elf
from tests.support.arm.mutations import OF_ELF, mutated

PREBUILT = Path(__file__).parents[2] / "firmware_model/arm/prebuilt/solution-i2c2.elf"
ADDRESSES = (0, 1, FLASH, RESET, RESET | 1, MAIN + 6, RAM, 0x0803_FFFF, 0xFFFF_FFFE)
STEPS_PER_BYTE = 30  # an object of three bytes costs 32 steps, and tables may be read by several units


def survives(data: bytes) -> bool:
    """Load a file and read all its information. Return whether the file was accepted."""
    try:
        image = parse_firmware(data, "fuzz.elf")
    except FirmwareFileError as refused:
        image, refusal = None, str(refused)
    if image is None:
        assert refusal.startswith("fuzz.elf: ")
        assert refusal.isprintable()
        return False
    assert_sound(image)
    if image.symbols is not None:
        ask(image.symbols)
        assert image.symbols.work <= STEPS_PER_BYTE * len(data)
    return True


def assert_sound(image: FirmwareImage) -> None:
    """Assert the properties on which the board relies: contents inside the memories, no overlaps, and a start address."""
    end = 0
    for segment in image.segments:
        assert fits(segment.address, segment.end)
        assert segment.address >= end
        end = segment.end
    table = struct.unpack_from("<II", image.segments[0].data)
    assert (image.stack_pointer, image.reset_vector) == table


def ask(symbols: Symbols) -> None:
    def memory(address: int, size: int) -> bytes:
        assert fits(address, address + size)
        return bytes(size)

    for address in ADDRESSES:
        function, variable = symbols.function_at(address), symbols.object_at(address)
        assert function is None or function.name.isprintable()
        assert variable is None or variable.name.isprintable()
        assert str(symbols.line_at(address)).isprintable()
    for name in ("acc", "count", "main", "press", "htim9"):
        problem = ""
        try:
            repr(symbols.read_variable(name, memory))
        except KeyError as unknown:
            problem = unknown.args[0]
        assert problem.isprintable()
    assert all(note.isprintable() for note in symbols.notes)


def hex_file() -> bytes:
    """Return a HEX file with every type of record."""
    records = [b"\x02\0\0\x04\x08\0", b"\x04\0\0\x05\x08\0\0\x41", b"\x04\0\0\x03\0\0\0\0"]
    records += [
        bytes([16]) + at.to_bytes(2, "big") + b"\0" + code()[at : at + 16] for at in range(0, 256, 16)
    ]
    records += [b"\x02\0\0\x02\x10\0", b"\0\0\0\1"]
    lines = [":" + (record + bytes([-sum(record) & 0xFF])).hex().upper() for record in records]
    return "\r\n".join(lines).encode()


def resealed(data: bytes) -> bytes:
    """Return damaged records with correct checksums, so that they pass the first check."""
    lines = []
    for line in data.split(b"\r\n"):
        try:
            raw = bytes.fromhex(line[1:-2].decode("ascii"))
        except ValueError:
            lines.append(line)
            continue
        lines.append(b":" + (raw + bytes([-sum(raw) & 0xFF])).hex().upper().encode())
    return b"\r\n".join(lines)


def test_undamaged_files_load() -> None:
    assert all(map(survives, (debug_elf(4), debug_elf(5), hex_file(), code(), PREBUILT.read_bytes())))


@pytest.mark.parametrize("version", [4, 5])
@pytest.mark.parametrize("shard", [1, 2])
def test_damaged_elf_files_load_or_are_refused(shard: int, version: int) -> None:
    """4000 files are damaged at any place."""
    whole, random = debug_elf(version), Random(10 * shard + version)
    accepted = sum(survives(mutated(whole, random, OF_ELF)) for _ in range(1000))

    assert 100 < accepted < 950  # both ways are taken


@pytest.mark.parametrize("version", [4, 5])
@pytest.mark.parametrize("region", ["symbols", "debug information"])
def test_loader_survives_elf_files_with_damaged_names(region: str, version: int) -> None:
    """3200 files keep their headers, so that the damage reaches the readers behind them."""
    whole = debug_elf(version)
    start = whole.index(code()) + len(code())
    middle = whole.index(b"\x01\x11\x01")  # the first abbreviation
    first, last = (start, middle) if region == "symbols" else (middle, whole.index(b"\0.symtab"))
    random = Random(f"{region} {version}")
    for _ in range(800):
        damaged = mutated(whole[first:last], random)[: last - first].ljust(last - first, b"\0")

        assert survives(whole[:first] + damaged + whole[last:])


@pytest.mark.parametrize("shard", range(4))
def test_damaged_large_elf_files_load_or_are_refused(shard: int) -> None:
    """100 files have a third of a megabyte each."""
    whole = PREBUILT.read_bytes()
    random = Random(20 + shard)
    places = (0, whole.index(b"main.c"), len(whole) - 900)  # headers, somewhere inside, section table
    for number in range(25):
        at = places[number % len(places)] if number % 2 else random.randrange(len(whole) - 900)

        survives(whole[:at] + mutated(whole[at : at + 900], random) + whole[at + 900 :])


def test_damaged_hex_files_load_or_are_refused() -> None:
    """1600 files are damaged, and half of them have correct checksums."""
    random = Random(3)
    accepted = sum(
        survives(resealed(damaged) if number % 2 else damaged)
        for number in range(1600)
        for damaged in [mutated(hex_file(), random)]
    )

    assert 10 < accepted < 1500


def test_damaged_binary_files_load_or_are_refused() -> None:
    """1000 binary files are damaged."""
    random = Random(4)
    accepted = sum(survives(mutated(code(), random)) for _ in range(1000))

    assert 200 < accepted < 950


def test_damaged_files_take_little_memory() -> None:
    """100 files are damaged; the largest, with doubled headers, has 20 KB."""
    random = Random(5)
    files = [mutated(debug_elf(4 + number % 2), random, OF_ELF) for number in range(100)]
    survives(debug_elf())  # what is loaded once

    tracemalloc.start()
    for file in files:
        survives(file)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()

    assert peak < 2_000_000
