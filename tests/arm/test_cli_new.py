"""``fcu new``: the project, the refusals, and the build according to the README."""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from tests.support.words import Words

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


def commands(text: str) -> list[str]:
    """Return the suggested commands, which are on separate lines."""
    return [line.strip() for line in text.splitlines() if line.startswith("  ")]


def test_new_command_writes_template_and_prints_next_steps(tmp_path: Path, words: Words) -> None:
    project = tmp_path / "my lab"
    text = fcu_new(str(project)).stdout

    names = {path.name for path in project.iterdir()}
    assert names == {
        "main.c",
        "Makefile",
        "README.md",
        ".gitignore",
        ".github",
        "support",
        ".devcontainer",
        ".vscode",
    }
    assert "YOUR CODE HERE" in (project / "main.c").read_text()
    assert commands(text) == [f"cd '{project}'", "fcu build", "fcu run lab3.elf", "fcu check"]
    words("new", text)


def test_bus_option_is_written_to_makefile(tmp_path: Path) -> None:
    text = fcu_new(str(tmp_path / "spi"), "--bus", "SPI2").stdout

    assert "BUS ?= SPI2\n" in (tmp_path / "spi" / "Makefile").read_text()
    # the ELF file says which bus it uses
    assert commands(text)[1:] == ["fcu build", "fcu run lab3.elf", "fcu check"]


def test_empty_folder_is_accepted(tmp_path: Path) -> None:
    fcu_new(str(tmp_path))

    assert (tmp_path / "main.c").is_file()


@pytest.mark.parametrize("what", ["file", "folder"])
def test_existing_files_are_not_overwritten(tmp_path: Path, what: str, words: Words) -> None:
    target = tmp_path / "lab3"
    occupied = target if what == "file" else target / "main.c"
    occupied.parent.mkdir(exist_ok=True)
    occupied.write_text("mine")
    done = fcu_new(str(target), code=2)

    assert str(target) in done.stderr
    words("new", done.stderr)
    assert occupied.read_text() == "mine"


def test_unwritable_folder_is_refused_in_one_line(tmp_path: Path, words: Words) -> None:
    (tmp_path / "file").write_text("")
    done = fcu_new(str(tmp_path / "file" / "lab3"), code=2)

    assert str(tmp_path / "file" / "lab3") in done.stderr
    assert len(done.stderr.splitlines()) == 1
    words("new", done.stderr.rpartition(": ")[0])  # without the reason of the operating system


@pytest.mark.skipif(
    shutil.which("arm-none-eabi-gcc") is None or shutil.which("make") is None,
    reason="arm-none-eabi-gcc or make is not installed",
)
@BUSES
def test_new_project_builds_without_warning(tmp_path: Path, bus: str) -> None:
    fcu_new(str(tmp_path / "lab"), "--bus", bus)
    done = subprocess.run(["make", "-j2"], cwd=tmp_path / "lab", capture_output=True, text=True, check=False)

    assert done.returncode == 0, done.stderr
    assert done.stderr == ""
    assert (tmp_path / "lab" / "lab3.elf").read_bytes().startswith(b"\x7fELF")
