"""Source lines in explanations are read only from the ELF file's own folder."""

from __future__ import annotations

import os
import shutil
from pathlib import Path

import pytest

from fcu_emulator.emulator.chip.image import load_firmware
from fcu_emulator.emulator.chip.image.lines import SourceLine
from fcu_emulator.emulator.explain.source_text import source_text
from fcu_emulator.firmware_model import arm

TEXT = "float bx3 = bx * cosf(roll);"


@pytest.fixture
def elf(tmp_path: Path) -> Path:
    project = tmp_path / "lab"
    project.mkdir()
    (project / "main.c").write_text(f"\n  {TEXT}\n")
    os.utime(project / "main.c", (1, 1))
    (tmp_path / "secret.c").write_text("secret\nsecret\n")
    os.utime(tmp_path / "secret.c", (1, 1))
    return Path(shutil.copy(arm.sources() / "prebuilt" / "solution-i2c2.elf", project / "lab3.elf"))


def text(elf: Path, path: str, line: int = 2) -> str:
    return source_text(load_firmware(elf), SourceLine(path, line))


def test_line_beside_elf_is_quoted(elf: Path) -> None:
    assert text(elf, "main.c") == text(elf, str(elf.parent / "main.c")) == f"main.c:2: {TEXT}"


@pytest.mark.parametrize(
    "path", ["../secret.c", "/etc/passwd", "..\\secret.c", "missing.c", "lab3.elf", "x\0.c", "."]
)
def test_only_source_files_in_folder_are_read(elf: Path, path: str) -> None:
    assert text(elf, path) == ""


def test_link_to_another_folder_is_not_followed(elf: Path) -> None:
    (elf.parent / "link.c").symlink_to(elf.parent.parent / "secret.c")
    assert text(elf, "link.c") == ""


@pytest.mark.parametrize("line", [0, 1, 3, 4, 10**9])
def test_line_without_text_is_empty(elf: Path, line: int) -> None:
    assert text(elf, "main.c", line) == ""


def test_large_file_is_not_read(elf: Path) -> None:
    (elf.parent / "main.c").write_bytes(b"\nx\n" * 500_000)
    os.utime(elf.parent / "main.c", (1, 1))
    assert text(elf, "main.c") == ""


def test_changed_source_is_not_quoted(elf: Path) -> None:
    os.utime(elf.parent / "main.c", (2**32, 2**32))
    said = text(elf, "main.c")
    assert TEXT not in said
    assert "main.c" in said
    assert "lab3.elf" in said


def test_control_characters_are_escaped(elf: Path) -> None:
    (elf.parent / "main.c").write_bytes(b"\nx \x1b[31m \xff\n")
    os.utime(elf.parent / "main.c", (1, 1))
    assert "\x1b" not in text(elf, "main.c")
