"""The C library without Python: a C program (building/run_library.c) runs the kernels on it."""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from fcu_emulator.emulator.chip.native import FOLDER, library_name
from tests.support.arm.conformance import COMPILER, RESULTS, build

DRIVER = Path(__file__).parents[2] / "building" / "run_library.c"
needed = {COMPILER, "cc"}
pytestmark = [
    pytest.mark.skipif(any(shutil.which(name) is None for name in needed), reason=f"needs {sorted(needed)}"),
    pytest.mark.skipif(sys.platform == "win32", reason="the programs are compiled for POSIX"),
]


def test_c_program_runs_kernels_on_library(tmp_path: Path) -> None:
    """The functions that fcu.h declares are sufficient, and any C program can include the header."""
    elf, flash, driver = build("O2", tmp_path), tmp_path / "flash", tmp_path / "driver"
    subprocess.run([COMPILER.replace("gcc", "objcopy"), "-O", "binary", elf, flash], check=True)
    warnings = "-Wall", "-Wextra", "-Werror"
    subprocess.run(["cc", "-std=gnu11", *warnings, f"-I{FOLDER}", DRIVER, "-o", driver, "-ldl"], check=True)
    done = subprocess.run(
        [driver, FOLDER / library_name(), flash], capture_output=True, text=True, check=False
    )

    *sums, end, count = done.stdout.splitlines()
    assert done.returncode == 0
    assert done.stderr == ""
    assert sums == RESULTS.read_text(encoding="ascii").splitlines()
    assert end == "end"
    assert int(count.removeprefix("retired ")) > 10_000_000
