"""The C files of the chip compile without warnings, are readable, and are the sources of the built library."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import pytest

from fcu_emulator.emulator.chip import native
from fcu_emulator.emulator.chip.native import loader

FOLDER = Path(__file__).parents[2] / "emulator" / "chip" / "native"
SOURCES, HEADERS = ([path for path in native.sources(FOLDER) if path.suffix == kind] for kind in (".c", ".h"))
WIDEST, LONGEST = 120, 900
needs_gcc = pytest.mark.skipif(shutil.which("gcc") is None, reason="needs gcc")
FILES = [*SOURCES, *HEADERS]


@needs_gcc
@pytest.mark.parametrize("path", SOURCES, ids=lambda path: path.name)
def test_file_compiles_without_warnings(path: Path) -> None:
    command = ["gcc", "-std=gnu11", "-O2", "-Wall", "-Wextra", "-S", "-o", "-", f"-I{FOLDER}", str(path)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)

    assert done.returncode == 0
    assert not done.stderr


@needs_gcc
@pytest.mark.parametrize("path", HEADERS, ids=lambda path: path.name)
def test_header_compiles_alone(path: Path) -> None:
    command = ["gcc", "-std=gnu11", "-fsyntax-only", f"-I{FOLDER}", "-x", "c", str(path)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)

    assert done.returncode == 0, done.stderr


def test_every_file_starts_with_comment() -> None:
    assert [path.name for path in FILES if not path.read_text(encoding="utf-8").startswith("/* ")] == []


def test_every_file_can_be_read() -> None:
    lines = {path.name: path.read_text(encoding="utf-8").splitlines() for path in FILES}

    assert {name: len(found) for name, found in lines.items() if len(found) > LONGEST} == {}
    assert [
        f"{name}:{number}"
        for name, found in lines.items()
        for number, line in enumerate(found, 1)
        if len(line) > WIDEST
    ] == []


def test_library_was_built_from_its_sources() -> None:
    assert loader.problem() == ""
