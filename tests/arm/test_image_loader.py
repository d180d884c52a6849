"""Firmware files: their types, and files that are refused."""

from __future__ import annotations

import os
import struct
from pathlib import Path

import pytest

from fcu_emulator.emulator.chip.image import load_firmware, parse_firmware
from fcu_emulator.emulator.chip.image.image import LONGEST_FILE
from fcu_emulator.emulator.errors import FirmwareFileError, InputError
from tests.support.arm.elf_builder import FLASH, RAM, RAM_END, RESET, Load, code, elf
from tests.support.words import Words

FLASH_SIZE = 256 * 1024


def refusal(data: bytes) -> FirmwareFileError:
    with pytest.raises(FirmwareFileError) as caught:
        parse_firmware(data, "lab3.bin")
    assert "\n" not in str(caught.value)
    return caught.value


def test_raw_binary_is_loaded_to_start_of_flash() -> None:
    image = parse_firmware(code(), "lab3.bin")

    assert (image.kind, image.segments) == ("bin", ((FLASH, code()),))
    assert (image.stack_pointer, image.reset_vector) == (RAM_END, RESET | 1)
    assert image.symbols is None


def test_binary_larger_than_flash_is_refused() -> None:
    assert parse_firmware(code(size=FLASH_SIZE), "lab3.bin").segments[0].end == FLASH + FLASH_SIZE
    error = refusal(code(size=FLASH_SIZE + 2))
    assert error.kind == "too_long"
    assert "262144" in error.problem


def test_file_type_depends_on_contents_not_name(tmp_path: Path) -> None:
    path = tmp_path / "lab3.bin"
    path.write_bytes(elf())

    image = load_firmware(path)

    assert (image.kind, image.path) == ("elf", path)


def test_loader_error_shows_file() -> None:
    with pytest.raises(InputError) as caught:
        parse_firmware(b"", "lab3.elf")

    assert isinstance(caught.value, FirmwareFileError)
    assert str(caught.value) == f"{caught.value.file}: {caught.value.problem}"
    assert caught.value.file == "lab3.elf"
    assert caught.value.kind == "empty"


@pytest.mark.parametrize("stack", [0, RAM, RAM_END + 4, 0x2001_8000, 0xFFFF_FFFF, FLASH])
def test_stack_outside_ram_is_refused(stack: int) -> None:
    """PM0214 2.3.4: word 0 is the stack pointer. 0x20018000 is the stack pointer of the STM32F401RE with 96 KB."""
    error = refusal(code(stack=stack))

    assert error.kind == "stack_pointer"
    assert f"0x{stack:08X}" in error.problem


@pytest.mark.parametrize("reset", [0, 0x0000_0041, RAM | 1, FLASH - 1, FLASH + FLASH_SIZE + 1, 0xFFFF_FFFF])
def test_reset_vector_outside_flash_is_refused(reset: int) -> None:
    error = refusal(code(reset=reset))

    assert error.kind == "reset_outside_flash"
    assert f"0x{reset:08X}" in error.problem


def test_reset_vector_without_thumb_bit_is_refused(words: Words) -> None:
    """ARMv7-M ARM B1.5.3: bit 0 of a vector is the Thumb bit. If it is clear, the first instruction faults."""
    error = refusal(code(reset=RESET))

    assert error.kind == "reset_even"
    words("firmware_file", error.problem)


def test_reset_vector_to_unloaded_address_is_refused(words: Words) -> None:
    error = refusal(code(reset=(FLASH + 0x8000) | 1))

    assert error.kind == "reset_nothing"
    words("firmware_file", error.problem)


@pytest.mark.parametrize("data", [b"\0\0\1\x20", b"\0\0\1\x20\x41\0\0"])
def test_file_shorter_than_vector_table_is_refused(data: bytes) -> None:
    assert refusal(data).kind == "no_vector_table"


@pytest.mark.parametrize(
    ("data", "what"),
    [
        (b"MZ\x90\0" + bytes(60), "Windows"),
        (b"PK\x03\x04" + bytes(60), "ZIP"),
        (b"!<arch>\n" + bytes(60), "(.a)"),
        (b"UF2\n" + bytes(60), "UF2"),
        (b"S00600004844521B\r\nS1137AF0", "S-records"),
        (b"#include <stdio.h>\n\nint main(void) { return 0; }\n", "text"),
    ],
)
def test_file_of_other_type_is_refused_with_type(data: bytes, what: str, words: Words) -> None:
    error = refusal(data)

    assert error.kind == "other_file"
    assert what in error.problem
    words("firmware_file", error.problem)


@pytest.mark.parametrize(
    ("name", "kind"), [("no.elf", "no_such_file"), ("", "folder"), ("lab3\0.elf", "unreadable")]
)
def test_missing_file_or_folder_is_refused_with_path(name: str, kind: str, tmp_path: Path) -> None:
    with pytest.raises(FirmwareFileError) as caught:
        load_firmware(tmp_path / name)

    assert caught.value.kind == kind
    assert caught.value.file == str(tmp_path / name)


def test_endless_devices_are_not_opened() -> None:
    """The null device, which each system has, represents all endless devices."""
    with pytest.raises(FirmwareFileError) as caught:
        load_firmware(os.devnull)
    assert caught.value.kind == "not_a_file"


def test_huge_file_is_refused_without_reading(tmp_path: Path) -> None:
    path = tmp_path / "huge.elf"
    with path.open("wb") as file:
        file.truncate(1 << 40)  # holds no blocks on the disk; reading it would need a terabyte

    with pytest.raises(FirmwareFileError, match=str(LONGEST_FILE)) as caught:
        load_firmware(path)
    assert caught.value.kind == "too_long"


def test_elf_and_its_binary_have_same_contents() -> None:
    data = struct.pack("<4I", 1, 2, 3, 4)
    program = elf([Load(FLASH, code()), Load(FLASH + len(code()), data, virtual=RAM)])

    assert parse_firmware(program, "a.elf").segments == parse_firmware(code() + data, "a.bin").segments


def test_elf_header_in_flash_is_refused_with_reason() -> None:
    """A linker script without PHDRS for the headers places them before the first section."""
    data = elf([Load(FLASH, b"\x7fELF" + code()[4:])])
    assert refusal(data).kind == "header_in_flash"


@pytest.mark.parametrize(("end", "kilobytes"), [(0x2001_8000, 96), (0x2002_0000, 128)])
def test_stack_of_larger_chip_is_refused_with_size(end: int, kilobytes: int) -> None:
    """The STM32F401xE has 96 KB, the STM32F411 128 KB."""
    error = refusal(struct.pack("<I", end) + code()[4:])
    assert error.kind == "stack_pointer"
    assert f"{kilobytes} KB" in error.problem
