"""The core computes the same as QEMU's Cortex-M4: kernels in C and assembly, at five optimisation levels.

The kernels have instructions of each kind with their flags, floating point in all rounding modes, code of the
compiler and of the C library, and exceptions; see tests/arm/kernels. A file has QEMU's checksums. If QEMU is
installed, they are computed again.
"""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from tests.support.arm.conformance import COMPILER, LEVELS, QEMU, RESULTS, build, on_board, on_qemu

pytestmark = pytest.mark.skipif(shutil.which(COMPILER) is None, reason=f"{COMPILER} is not installed")
needs_qemu = pytest.mark.skipif(shutil.which(QEMU) is None, reason=f"{QEMU} is not installed")


def results() -> dict[str, str]:
    """Return the checksum of each kernel."""
    return parsed(RESULTS.read_text(encoding="ascii"))


def parsed(text: str) -> dict[str, str]:
    found = dict(line.split(" ") for line in text.splitlines())
    assert len(found) == text.count("\n") > 150
    return found


@pytest.fixture(scope="module", params=LEVELS)
def kernels(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the ELF file of an optimisation level; each file is built once."""
    return build(request.param, tmp_path_factory.mktemp("kernels"))


def test_board_computes_same_as_qemu(kernels: Path) -> None:
    assert parsed(on_board(kernels)) == results()


@needs_qemu
def test_stored_results_equal_those_of_qemu(kernels: Path) -> None:
    assert parsed(on_qemu(kernels)) == results()


def test_every_kernel_computes_something() -> None:
    """Each kernel adds to its checksum, and all checksums are different."""
    assert len(set(results().values())) == len(results())
