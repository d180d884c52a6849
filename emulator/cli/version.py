"""``fcu --version``: version, commit, C library and Python, for bug reports."""

from __future__ import annotations

import platform
from collections.abc import Iterator
from importlib.metadata import version
from pathlib import Path

import fcu_emulator
from fcu_emulator.emulator.chip.native import FOLDER, built_from, library_name
from fcu_emulator.emulator.chip.native.loader import problem
from fcu_emulator.emulator.host.commit import commit_of_package


def version_lines() -> Iterator[str]:
    """Yield the lines of the output."""
    yield f"fcu-emulator {version('fcu-emulator')}"
    yield f"commit {commit_of_package(Path(fcu_emulator.__file__).parent) or 'unknown'}"
    yield _library()
    yield f"Python {platform.python_version()}, {platform.system()} {platform.machine()}"


def _library() -> str:
    digest, compiler, compiler_version = built_from(FOLDER / library_name())
    if not digest:
        return "C library missing"
    outdated = ", does not match its sources" if problem() else ""
    return f"C library {digest}, built with {compiler} {compiler_version}{outdated}"
