"""The flash is kept in a file between runs (``fcu run --flash``), except the sectors of the program."""

from __future__ import annotations

from pathlib import Path

import pytest

from fcu_emulator import Board, InputError
from tests.integration.test_cli import fcu, one_line_error

SIZE = 256 * 1024
UNUSED = 128 * 1024  # the last sector (RM0368 table 5); the template is in the first ones


def run(flash: Path, firmware: str = "template-arm") -> None:
    done = fcu("run", firmware, "--duration", "0.01s", "--flash", str(flash))
    assert done.returncode == 0, done.stderr


def test_flash_file_keeps_unused_sector_between_runs(tmp_path: Path) -> None:
    file = tmp_path / "flash.bin"
    run(file)
    contents = bytearray(file.read_bytes())
    program = bytes(contents[:1024])
    contents[UNUSED], contents[0] = 0x5A, 0x00
    file.write_bytes(contents)

    run(file)

    kept = file.read_bytes()
    assert len(kept) == SIZE
    assert kept[UNUSED] == 0x5A
    assert kept[:1024] == program  # from the firmware's file


def test_loaded_flash_is_read_by_core() -> None:
    board = Board("template-arm")
    assert board.chip is not None
    contents = bytearray(board.chip.flash_contents())
    contents[UNUSED : UNUSED + 4] = (0x1234_5678).to_bytes(4, "little")

    board.chip.load_flash(bytes(contents))

    assert board.chip.core.peek(0x0800_0000 + UNUSED) == 0x1234_5678


def test_flash_of_other_size_is_refused() -> None:
    board = Board("template-arm")
    assert board.chip is not None
    with pytest.raises(InputError):
        board.chip.load_flash(bytes(SIZE - 1))


@pytest.mark.parametrize("size", [0, SIZE + 1])
def test_flash_file_of_other_size_is_refused(size: int, tmp_path: Path) -> None:
    file = tmp_path / "flash.bin"
    file.write_bytes(bytes(size))

    assert "262144" in one_line_error("run", "template-arm", "--flash", str(file))
    assert file.stat().st_size == size


def test_flash_file_is_refused_for_python_firmware(tmp_path: Path) -> None:
    assert "lab3" in one_line_error("run", "lab3", "--flash", str(tmp_path / "flash.bin"))
