"""Only one package is installed, so that a student's files do not hide its parts. Old imports work with a warning."""

from __future__ import annotations

import os
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

from tests.integration.test_library import copied_clone, pip

OLD = ("emulator", "sensors", "firmware_model", "scenarios")
SHORT = ("--duration", "1100ms", "--speed", "max", "--quiet")
SCRIPT = """
import multiprocessing
import pickle

from fcu_emulator import Board, InputError


def text(seed):
    board = Board("lab3", scenario="desk", seed=seed)
    board.run_for(1.1)
    return board.terminal.text


if __name__ == "__main__":
    assert "LAB3" in text(1)
    with multiprocessing.get_context("spawn").Pool(1) as pool:
        assert pool.map(text, [1]) == [text(1)]
    assert isinstance(pickle.loads(pickle.dumps(InputError("x"))), InputError)
"""
TEST = """
import pytest

@pytest.mark.board("lab3")
def test_it(board, dut):
    dut.expect("LAB3")
"""


def python(folder: Path, *arguments: str, path: Path | None = None) -> subprocess.CompletedProcess[str]:
    """Run Python in ``folder``, with ``path`` on the search path before all installed packages."""
    environment = dict(os.environ)
    if path:
        environment["PYTHONPATH"] = str(path)
    command = [sys.executable, *arguments]
    return subprocess.run(
        command, cwd=folder, env=environment, capture_output=True, text=True, timeout=300, check=False
    )


@pytest.fixture
def lab(tmp_path: Path) -> Path:
    """Return a student's folder with a file or folder of each common name, which cannot be imported."""
    folder = tmp_path / "lab"
    (folder / "scenarios").mkdir(parents=True)
    for name in ("sensors.py", "emulator.py", "firmware_model.py", "scenarios/__init__.py"):
        (folder / name).write_text("raise SystemExit('a file of the student was imported')\n")
    (folder / "script.py").write_text(SCRIPT)
    (folder / "test_lab.py").write_text(TEST)
    return folder


@pytest.mark.parametrize(
    "command",
    [
        ["script.py"],
        ["-m", "fcu_emulator", "run", "lab3", *SHORT],
        ["-m", "fcu_emulator", "run", "lab3", *SHORT, "--isolate"],
        ["-m", "pytest", "-q", "-p", "no:cacheprovider", "test_lab.py"],
    ],
    ids=["script", "run", "isolated", "pytest"],
)
def test_files_of_student_do_not_hide_package(command: list[str], lab: Path) -> None:
    done = python(lab, *command)

    assert done.returncode == 0, done.stdout + done.stderr


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with the unpacked contents of a wheel."""
    into = tmp_path_factory.mktemp("wheel")
    clone = copied_clone(tmp_path_factory.mktemp("source") / "clone")
    done = pip(clone, "wheel", "-w", into, ".")
    assert done.returncode == 0, done.stderr
    site = into / "site"
    with zipfile.ZipFile(next(into.glob("*.whl"))) as archive:
        archive.extractall(site)
    return site


def test_wheel_installs_one_package(wheel: Path) -> None:
    assert {path.name for path in wheel.iterdir() if path.suffix not in (".dist-info", ".pth")} == {
        "fcu_emulator",
        "_fcu_emulator_old_names.py",
    }


OLD_NAMES = """
import pickle, sys, warnings
import _fcu_emulator_old_names
with warnings.catch_warnings(record=True) as caught:
    warnings.simplefilter("always")
    from emulator import Board
    import sensors.part, firmware_model.arm, scenarios
    import emulator.errors
import fcu_emulator, fcu_emulator.emulator.errors, fcu_emulator.sensors.part
assert sys.argv[1] in fcu_emulator.__file__, fcu_emulator.__file__
assert Board is fcu_emulator.Board
assert sensors.part is fcu_emulator.sensors.part
assert emulator.errors is fcu_emulator.emulator.errors
assert {one.category for one in caught} == {DeprecationWarning}, caught
assert pickle.loads(b"cemulator.errors\\nInputError\\n(S'x'\\ntR.").args == ("x",)
"""


def test_old_imports_work_with_warning(wheel: Path, tmp_path: Path) -> None:
    done = python(tmp_path, "-c", OLD_NAMES, str(wheel), path=wheel)

    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize("name", OLD)
def test_module_of_student_precedes_old_name(name: str, wheel: Path, tmp_path: Path) -> None:
    (tmp_path / f"{name}.py").write_text("mine = True\n")
    program = f"import _fcu_emulator_old_names\nimport {name}\nassert {name}.mine"
    done = python(tmp_path, "-W", "error", "-c", program, path=wheel)

    assert done.returncode == 0, done.stderr
