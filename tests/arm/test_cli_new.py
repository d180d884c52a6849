"""``fcu new``: a project as a student gets it, refuses as a student sees it, built as the README says."""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
BUSES = pytest.mark.parametrize("bus", ["I2C2", "SPI2"])


def fcu_new(*arguments: str, code: int = 0) -> subprocess.CompletedProcess[str]:
    done = subprocess.run(
        [sys.executable, "-m", "fcu_emulator", "new", *arguments],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == code, done.stderr
    return done


def test_it_writes_the_template_and_says_what_is_next(tmp_path: Path) -> None:
    project = tmp_path / "my lab"
    text = fcu_new(str(project)).stdout

    names = {path.name for path in project.iterdir()}
    assert names == {"main.c", "Makefile", "README.md", ".gitignore", ".github", "support"}
    assert "YOUR CODE HERE" in (project / "main.c").read_text()
    assert f"  cd '{project}'\n  fcu build\n  fcu run lab3.elf\n  fcu check\n" in text


def test_bus_is_in_the_makefile_and_commands_are_the_usual_ones(tmp_path: Path) -> None:
    text = fcu_new(str(tmp_path / "spi"), "--bus", "SPI2").stdout

    assert "BUS ?= SPI2\n" in (tmp_path / "spi" / "Makefile").read_text()
    assert "  fcu build\n  fcu run lab3.elf\n  fcu check\n" in text  # the ELF file says which bus it uses


def test_an_empty_folder_is_taken(tmp_path: Path) -> None:
    fcu_new(str(tmp_path))

    assert (tmp_path / "main.c").is_file()


@pytest.mark.parametrize("what", ["file", "folder"])
def test_nothing_is_overwritten(tmp_path: Path, what: str) -> None:
    target = tmp_path / "lab3"
    occupied = target if what == "file" else target / "main.c"
    occupied.parent.mkdir(exist_ok=True)
    occupied.write_text("mine")
    done = fcu_new(str(target), code=2)

    assert done.stderr == f"fcu: {target} exists and is not an empty folder; give the name of a new one\n"
    assert occupied.read_text() == "mine"


def test_a_place_that_cannot_be_written_is_one_line(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    done = fcu_new(str(tmp_path / "file" / "lab3"), code=2)

    assert done.stderr.startswith(f"fcu: cannot create {tmp_path / 'file' / 'lab3'}: ")
    assert len(done.stderr.splitlines()) == 1


@pytest.mark.skipif(
    shutil.which("arm-none-eabi-gcc") is None or shutil.which("make") is None,
    reason="arm-none-eabi-gcc or make is not installed",
)
@BUSES
def test_it_builds_without_a_warning(tmp_path: Path, bus: str) -> None:
    fcu_new(str(tmp_path / "lab"), "--bus", bus)
    done = subprocess.run(["make", "-j2"], cwd=tmp_path / "lab", capture_output=True, text=True, check=False)

    assert done.returncode == 0, done.stderr
    assert done.stderr == ""
    assert (tmp_path / "lab" / "lab3.elf").read_bytes().startswith(b"\x7fELF")
