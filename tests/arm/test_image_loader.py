"""Firmware files: which kind they are, what is refused, and in which words."""

from __future__ import annotations

import os
import struct
from pathlib import Path

import pytest

from fcu_emulator.emulator.chip.image import load_firmware, parse_firmware
from fcu_emulator.emulator.chip.image.image import LONGEST_FILE
from fcu_emulator.emulator.errors import FirmwareFileError, InputError
from tests.support.arm.elf_builder import FLASH, RAM, RAM_END, RESET, Load, code, elf

FLASH_SIZE = 256 * 1024


def refusal(data: bytes) -> str:
    with pytest.raises(FirmwareFileError) as caught:
        parse_firmware(data, "lab3.bin")
    assert "\n" not in str(caught.value)
    return str(caught.value)


def test_raw_contents_of_flash_begin_at_its_first_address() -> None:
    image = parse_firmware(code(), "lab3.bin")

    assert (image.kind, image.segments) == ("bin", ((FLASH, code()),))
    assert (image.stack_pointer, image.reset_vector) == (RAM_END, RESET | 1)
    assert image.symbols is None


def test_a_binary_may_fill_the_flash_and_no_more() -> None:
    assert parse_firmware(code(size=FLASH_SIZE), "lab3.bin").segments[0].end == FLASH + FLASH_SIZE
    assert "262144 at most" in refusal(code(size=FLASH_SIZE + 2))


def test_the_kind_is_taken_from_the_contents_not_the_name(tmp_path: Path) -> None:
    path = tmp_path / "lab3.bin"
    path.write_bytes(elf())

    image = load_firmware(path)

    assert (image.kind, image.path) == ("elf", path)


def test_the_error_is_one_of_the_users_and_names_the_file() -> None:
    with pytest.raises(InputError) as caught:
        parse_firmware(b"", "lab3.elf")

    assert isinstance(caught.value, FirmwareFileError)
    assert str(caught.value) == f"{caught.value.file}: {caught.value.problem}"
    assert caught.value.file == "lab3.elf"
    assert "is empty" in caught.value.problem


@pytest.mark.parametrize("stack", [0, RAM, RAM_END + 4, 0x2001_8000, 0xFFFF_FFFF, FLASH])
def test_a_stack_outside_the_ram_is_refused(stack: int) -> None:
    """PM0214 2.3.4: word 0 is the stack pointer; 0x20018000 is that of the STM32F401RE with its 96 KB."""
    assert f"stack pointer 0x{stack:08X}, which must lie in RAM" in refusal(code(stack=stack))


@pytest.mark.parametrize("reset", [0, 0x0000_0041, RAM | 1, FLASH - 1, FLASH + FLASH_SIZE + 1, 0xFFFF_FFFF])
def test_a_reset_vector_outside_the_flash_is_refused(reset: int) -> None:
    assert f"reset vector 0x{reset:08X} must lie in flash" in refusal(code(reset=reset))


def test_a_reset_vector_without_the_thumb_bit_is_refused() -> None:
    """ARMv7-M ARM B1.5.3: bit 0 of a vector is the Thumb bit; clear, the first instruction faults."""
    message = refusal(code(reset=RESET))

    assert "even reset vector" in message
    assert "%function" in message


def test_a_reset_vector_to_where_nothing_is_loaded_is_refused() -> None:
    assert "has nothing at its reset vector" in refusal(code(reset=(FLASH + 0x8000) | 1))


@pytest.mark.parametrize("data", [b"\0\0\1\x20", b"\0\0\1\x20\x41\0\0"])
def test_less_than_a_vector_table_is_refused(data: bytes) -> None:
    assert "no vector table at 0x08000000" in refusal(data)


@pytest.mark.parametrize(
    ("data", "what"),
    [
        (b"MZ\x90\0" + bytes(60), "a Windows program"),
        (b"PK\x03\x04" + bytes(60), "a ZIP archive"),
        (b"!<arch>\n" + bytes(60), "a static library"),
        (b"UF2\n" + bytes(60), "a UF2 file"),
        (b"S00600004844521B\r\nS1137AF0", "Motorola S-records"),
        (b"#include <stdio.h>\n\nint main(void) { return 0; }\n", "is a text"),
    ],
)
def test_other_files_are_called_what_they_are(data: bytes, what: str) -> None:
    assert what in refusal(data)


def test_missing_files_and_folders_are_named(tmp_path: Path) -> None:
    with pytest.raises(FirmwareFileError, match="does not exist"):
        load_firmware(tmp_path / "no.elf")
    with pytest.raises(FirmwareFileError, match="is a folder"):
        load_firmware(tmp_path)
    with pytest.raises(FirmwareFileError, match="cannot be read"):
        load_firmware("lab3\0.elf")


def test_endless_devices_are_not_opened() -> None:
    """The null device, which each system has, stands for those that never end."""
    with pytest.raises(FirmwareFileError, match="no ordinary file"):
        load_firmware(os.devnull)


def test_a_huge_file_is_refused_by_its_size_unread(tmp_path: Path) -> None:
    path = tmp_path / "huge.elf"
    with path.open("wb") as file:
        file.truncate(1 << 40)  # holds no blocks on the disk; reading it would need a terabyte

    with pytest.raises(FirmwareFileError, match=f"{LONGEST_FILE} at most"):
        load_firmware(path)


def test_an_elf_and_its_binary_load_the_same() -> None:
    data = struct.pack("<4I", 1, 2, 3, 4)
    program = elf([Load(FLASH, code()), Load(FLASH + len(code()), data, virtual=RAM)])

    assert parse_firmware(program, "a.elf").segments == parse_firmware(code() + data, "a.bin").segments
