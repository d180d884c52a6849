"""``fcu build`` creates the same file as make, without make, and searches for a compiler."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from fcu_emulator.emulator.cli.toolchain import COMPILER, find_compiler

ROOT = Path(__file__).parents[2]
GCC = shutil.which(COMPILER)

needs_compiler = pytest.mark.skipif(GCC is None, reason=f"{COMPILER} is not installed")


def fcu(*arguments: str, folder: Path, **environment: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-m", "fcu_emulator", *arguments],
        cwd=folder,
        env={**os.environ, "PYTHONPATH": str(ROOT), **environment},
        capture_output=True,
        encoding="utf-8",
        check=False,
    )


@pytest.fixture
def project(tmp_path: Path) -> Path:
    assert fcu("new", "mylab", folder=tmp_path).returncode == 0
    return tmp_path / "mylab"


@needs_compiler
@pytest.mark.skipif(shutil.which("make") is None, reason="make is not installed")
@pytest.mark.parametrize(("bus", "opt"), [("I2C2", "-Og"), ("SPI2", "-O2")])
def test_build_gives_same_file_as_make(bus: str, opt: str, project: Path) -> None:
    makefile = project / "Makefile"
    text = makefile.read_text(encoding="utf-8")
    text = text.replace("BUS ?= I2C2", f"BUS ?= {bus}").replace("OPT ?= -Og", f"OPT ?= {opt}")
    makefile.write_text(text, encoding="utf-8")
    done = fcu("build", folder=project)
    built = (project / "lab3.elf").read_bytes()
    shutil.rmtree(project / "build")
    subprocess.run(["make", "-s"], cwd=project, check=True, capture_output=True)

    assert done.returncode == 0, done.stderr
    assert done.stderr == ""
    assert (project / "lab3.elf").read_bytes() == built


@pytest.fixture
def only_gcc(tmp_path: Path) -> str:
    """Return a PATH with the compiler and without make."""
    assert GCC is not None
    folder = tmp_path / "bin"
    folder.mkdir()
    (folder / COMPILER).symlink_to(Path(GCC).resolve())
    return str(folder)


@needs_compiler
@pytest.mark.skipif(sys.platform == "win32", reason="makes a symbolic link")
def test_build_and_check_work_without_make(project: Path, only_gcc: str) -> None:
    done = fcu("check", "--exercise", "2", folder=project, PATH=only_gcc)

    assert done.returncode == 1, done.stderr
    assert "  2   not yet     0 of 4 " in done.stdout


@needs_compiler
@pytest.mark.skipif(sys.platform == "win32", reason="makes a symbolic link")
def test_failed_build_removes_old_program(project: Path, only_gcc: str) -> None:
    (project / "lab3.elf").write_bytes(b"of before")
    main = project / "main.c"
    main.write_text(main.read_text(encoding="utf-8") + "\nint x = no_such_name;\n", encoding="utf-8")
    done = fcu("build", folder=project, PATH=only_gcc)

    assert done.returncode == 2
    assert "main.c:" in done.stderr
    assert "no_such_name" in done.stderr
    assert not (project / "lab3.elf").exists()


def test_error_for_missing_compiler_shows_install_command(project: Path, tmp_path: Path) -> None:
    empty = tmp_path / "empty"
    empty.mkdir()
    done = fcu("build", folder=project, PATH=str(empty), HOME=str(empty))

    assert done.returncode == 2
    assert done.stderr.startswith(f"fcu: {COMPILER} is not installed: ")
    assert len(done.stderr.splitlines()) == 1


def test_non_project_folder_is_refused_in_one_line(tmp_path: Path) -> None:
    done = fcu("build", folder=tmp_path)

    assert done.returncode == 2
    assert len(done.stderr.splitlines()) == 1


def test_old_project_is_refused_with_make_hint(project: Path) -> None:
    (project / "support" / "compile.options").unlink()
    done = fcu("build", folder=project)

    assert done.returncode == 2
    assert "compile.options" in done.stderr


# -- where a compiler is ------------------------------------------------------------------------------------

_CUBE = "plugins/com.st.stm32cube.ide.mcu.externaltools.gnu-tools-for-stm32.{}.win32_1.0.0/tools/bin"
_XPACK = "xPacks/@xpack-dev-tools/arm-none-eabi-gcc/13.3.1-1.1/.content/bin"


@pytest.mark.parametrize(
    ("system", "folder"),
    [
        ("win32", f"ST/STM32CubeIDE_1.17.0/STM32CubeIDE/{_CUBE.format('12.3.rel1')}"),
        ("win32", "Program Files (x86)/Arm GNU Toolchain arm-none-eabi/13.3 rel1/bin"),
        ("win32", "Program Files/Arm GNU Toolchain arm-none-eabi/14.2 rel1/bin"),
        ("win32", f"Roaming/{_XPACK}"),
        ("win32", "home/.platformio/packages/toolchain-gccarmnoneeabi/bin"),
        ("linux", f"opt/st/stm32cubeide_1.17.0/{_CUBE.format('12.3.rel1')}"),
        ("linux", f"home/st/stm32cubeide_1.17.0/{_CUBE.format('12.3.rel1')}"),
        ("linux", "opt/arm-gnu-toolchain-13.3.rel1-x86_64-arm-none-eabi/bin"),
        ("linux", f"home/.local/{_XPACK}"),
        ("linux", "home/.platformio/packages/toolchain-gccarmnoneeabi@1.90301.200702/bin"),
        ("darwin", f"Applications/STM32CubeIDE.app/Contents/Eclipse/{_CUBE.format('12.3.rel1')}"),
        ("darwin", "Applications/ArmGNUToolchain/13.3.rel1/arm-none-eabi/bin"),
        ("darwin", f"home/Library/{_XPACK}"),
        ("darwin", "opt/homebrew/bin"),
    ],
)
def test_compiler_is_found_in_default_install_folder(system: str, folder: str, tmp_path: Path) -> None:
    environment = windows(tmp_path) if system == "win32" else {"HOME": str(tmp_path / "home"), "PATH": ""}
    assert find_compiler(environment, system, tmp_path) is None
    compiler = put_compiler(tmp_path / folder, system)

    assert find_compiler(environment, system, tmp_path) == compiler


def test_newest_of_several_compilers_is_used(tmp_path: Path) -> None:
    for version in ("9.3.1", "13.3.1", "10.3.1"):
        put_compiler(tmp_path / "opt" / f"gcc-arm-none-eabi-{version}" / "bin", "linux")
    found = find_compiler({"HOME": str(tmp_path), "PATH": ""}, "linux", tmp_path)

    assert found is not None
    assert "13.3.1" in str(found)


@pytest.mark.skipif(sys.platform == "win32", reason="a program without a suffix")
def test_compiler_on_path_precedes_other_folders(tmp_path: Path) -> None:
    put_compiler(tmp_path / "opt" / "gcc-arm-none-eabi-13" / "bin", "linux")
    first = put_compiler(tmp_path / "mine", "linux")
    environment = {"HOME": str(tmp_path), "PATH": str(tmp_path / "mine")}

    assert find_compiler(environment, "linux", tmp_path) == first


@needs_compiler
@pytest.mark.skipif(sys.platform == "win32", reason="makes a symbolic link")
def test_check_finds_compiler_outside_path(project: Path, tmp_path: Path) -> None:
    assert GCC is not None
    folder = tmp_path / "home" / ".platformio" / "packages" / "toolchain-gccarmnoneeabi"
    folder.mkdir(parents=True)
    (folder / "bin").symlink_to(Path(GCC).resolve().parent)
    empty = tmp_path / "empty"
    empty.mkdir()
    done = fcu("build", folder=project, PATH=str(empty), HOME=str(tmp_path / "home"))

    assert done.returncode == 0, done.stderr
    assert (project / "lab3.elf").exists()


def windows(root: Path) -> dict[str, str]:
    """Set the variables of a Windows system whose drive is the folder ``root``."""
    return {
        "PATH": "",
        "SystemDrive": str(root),
        "ProgramFiles": str(root / "Program Files"),
        "ProgramFiles(x86)": str(root / "Program Files (x86)"),
        "APPDATA": str(root / "Roaming"),
        "USERPROFILE": str(root / "home"),
    }


def put_compiler(folder: Path, system: str) -> Path:
    folder.mkdir(parents=True)
    compiler = folder / (COMPILER + (".exe" if system == "win32" else ""))
    compiler.write_text("#!/bin/sh\n")
    compiler.chmod(0o755)
    return compiler


@pytest.mark.skipif(shutil.which(COMPILER) is None, reason=f"{COMPILER} is not installed")
@pytest.mark.parametrize("fails", [False, True])
def test_restored_file_is_compiled_again(project: Path, fails: bool) -> None:
    """This also applies after a failed build that has compiled the changed file."""
    main, board, elf = project / "main.c", project / "support" / "board.c", project / "lab3.elf"
    kept, times, right = board.read_text(), (board.stat().st_atime, board.stat().st_mtime), main.read_text()
    fcu("build", folder=project)
    before = elf.read_bytes()
    board.write_text(kept.replace("115200", "9600"))
    main.write_text(f"{right}\nwrong" if fails else right)
    changed = fcu("build", folder=project)
    board.write_text(kept)
    os.utime(board, times)
    main.write_text(right)
    fcu("build", folder=project)

    assert (changed.returncode != 0) is fails
    assert "115200" in kept
    assert elf.read_bytes() == before
