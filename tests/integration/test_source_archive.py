"""The source archive has every file of a clone, the generated C headers, and can be installed."""

from __future__ import annotations

import tarfile
from pathlib import Path

from fcu_emulator.emulator.chip.registers.c_headers import headers
from tests.integration.test_library import copied_clone, files, run

ADDED = {"PKG-INFO", *(f"emulator/chip/native/generated/{name}" for name in headers())}


def archived(clone: Path, into: Path) -> set[str]:
    done = run(clone, "-m", "hatchling", "build", "-t", "sdist", "-d", into)
    assert done.returncode == 0, done.stderr
    (archive,) = into.iterdir()
    with tarfile.open(archive) as content:
        return {name.partition("/")[2] for name in content.getnames()}


def test_source_archive_has_every_file(tmp_path: Path) -> None:
    clone = copied_clone(tmp_path / "clone")

    assert archived(clone, tmp_path / "dist") == files(clone) | ADDED


def test_type_checker_links_keep_source_archive_complete(tmp_path: Path) -> None:
    clone = copied_clone(tmp_path / "clone")
    before = files(clone)
    run(clone, "building/namespace.py")

    assert archived(clone, tmp_path / "dist") == before | ADDED
