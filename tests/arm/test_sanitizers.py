"""The C library with the address and undefined-behaviour sanitizers, which end the process at an error.

A copy of the packages has a library that was built with them. The tests of hostile firmware, of the core, of whole
runs and of the peripherals run with this copy.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
COPIED = ("building", "docs", "emulator", "fcu_emulator", "firmware_model", "scenarios", "sensors", "tests")
CC = "gcc"
SANITIZE = "-fsanitize=address,undefined"
BUILD = {"CC": CC, "CFLAGS": f"-g -O1 -fno-sanitize-recover=all {SANITIZE}", "LDFLAGS": SANITIZE}
BLOCKS = ("dma", "exti", "gpio", "i2c_*", "spi_*", "tim_*", "usart")
RUN_THERE = ("hostile_firmware", "core_*", "recorded", *BLOCKS)
"""Files of this folder, by the part of the name after test_.

Random code is left to test_hostile_streams.py, which executes a hundred times as much code without Python.
"""
LEFT_OUT = ("unicorn", "untraced", "counting_up_equals", "counting_down_equals")
"""Parts of names of omitted tests, which use the same C code as other tests of their file."""
LIBRARY = "from fcu_emulator.emulator.chip.native import FOLDER, library_name; print(FOLDER / library_name())"


def preloaded() -> str:
    """Return the sanitizer's library, which a process must load first, or "" if there is none."""
    if sys.platform != "linux" or shutil.which(CC) is None:
        return ""
    done = subprocess.run([CC, "-print-file-name=libasan.so"], capture_output=True, text=True, check=True)
    return done.stdout.strip() if Path(done.stdout.strip()).is_file() else ""


pytestmark = pytest.mark.skipif(not preloaded(), reason="needs Linux and gcc with its sanitizers")


@pytest.fixture(scope="module")
def copy(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the folder with a copy of the packages, whose library has sanitizers."""
    folder = tmp_path_factory.mktemp("sanitized")
    shutil.copy(ROOT / "pyproject.toml", folder)
    for name in COPIED:
        ignored = shutil.ignore_patterns("__pycache__", "*.so")
        shutil.copytree(ROOT / name, folder / name, ignore=ignored)
    build = [sys.executable, folder / "building" / "library.py"]
    subprocess.run(build, env=os.environ | BUILD, check=True)
    return folder


def python(copy: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    """Run Python with this copy."""
    settings = {"LD_PRELOAD": preloaded(), "ASAN_OPTIONS": "detect_leaks=0", "PYTHONPATH": str(copy)}
    return subprocess.run(
        [sys.executable, *arguments],
        cwd=copy,
        env=os.environ | settings,
        capture_output=True,
        text=True,
        check=False,
    )


def test_sanitizer_tests_use_instrumented_library(copy: Path) -> None:
    library = Path(python(copy, "-c", LIBRARY).stdout.strip())

    assert library.is_relative_to(copy)
    assert all(name in library.read_bytes() for name in (b"__asan_init", b"__ubsan_handle"))


def test_hostile_firmware_passes_sanitizers(copy: Path) -> None:
    files = sorted(
        str(path.relative_to(copy))
        for name in RUN_THERE
        for path in (copy / "tests" / "arm").glob(f"test_{name}.py")
    )
    chosen = " and ".join(f"not {name}" for name in LEFT_OUT)
    options = "-q", "-n", "0", "-x", "--hypothesis-profile", "unshrunk"
    done = python(copy, "-m", "pytest", *options, "-k", chosen, *files)

    assert done.returncode == 0, (done.stdout + done.stderr)[-6000:]
    assert int(done.stdout.split(" passed")[0].split()[-1]) > 500
