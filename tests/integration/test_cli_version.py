"""``fcu --version`` identifies the build: version, commit, C library and Python."""

from __future__ import annotations

import platform
import shutil
import subprocess
import sys
import tarfile
import tomllib
from pathlib import Path
from zipfile import ZipFile

import pytest

from fcu_emulator.emulator.chip import native
from fcu_emulator.emulator.host.commit import FILE, commit_of_package, stamped
from tests.integration.test_library import ROOT, copied_clone, pip, run
from tests.integration.test_speed_table_build import git, head

needs_git = pytest.mark.skipif(shutil.which("git") is None, reason="git is not installed")


def version(folder: Path) -> list[str]:
    done = run(folder, "-m", "fcu_emulator", "--version")
    assert (done.returncode, done.stderr) == (0, "")
    return done.stdout.splitlines()


@needs_git
def test_version_of_clone_names_its_build() -> None:
    first, commit, library, python = version(ROOT)
    number = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]["version"]
    named = git(ROOT, "rev-parse", "--short", "HEAD") if (ROOT / ".git").exists() else "unknown"

    assert first == f"fcu-emulator {number}"
    assert commit.removesuffix(" with changes") == f"commit {named}"
    assert library.startswith(f"C library {native.digest()}, built with ")
    assert "does not match" not in library
    assert python == f"Python {platform.python_version()}, {platform.system()} {platform.machine()}"


def test_version_shows_missing_commit_and_library(tmp_path: Path) -> None:
    _, commit, library, _ = version(copied_clone(tmp_path / "clone"))

    assert (commit, library) == ("commit unknown", "C library missing")


def test_outdated_library_is_marked(tmp_path: Path) -> None:
    clone = copied_clone(tmp_path / "clone")
    name = native.library_name()
    folder = Path("emulator", "chip", "native")
    shutil.copy(ROOT / folder / name, clone / folder)
    assert not version(clone)[2].endswith("does not match its sources")
    (clone / folder / "fcu.h").write_text("/* changed */\n", encoding="utf-8")

    assert version(clone)[2].endswith(", does not match its sources")


@needs_git
def test_wheel_of_source_archive_has_commit(tmp_path: Path) -> None:
    clone = copied_clone(tmp_path / "clone")
    git(clone, "init", "-q")
    git(clone, "add", "-A")
    git(clone, "commit", "-q", "-m", "all")
    built = run(clone, "-m", "hatchling", "build", "-t", "sdist", "-d", tmp_path / "dist")
    assert built.returncode == 0, built.stderr
    with tarfile.open(next((tmp_path / "dist").iterdir())) as archive:
        archive.extractall(tmp_path / "unpacked")
    (source,) = (tmp_path / "unpacked").iterdir()
    assert stamped(source) == head(clone)
    assert version(source)[1] == f"commit {head(clone)}"

    done = pip(source, "wheel", "-w", tmp_path / "wheel", ".")
    assert done.returncode == 0, done.stderr
    with ZipFile(next((tmp_path / "wheel").iterdir())) as wheel:
        assert wheel.read(f"fcu_emulator/{FILE}").decode() == f"{head(clone)}\n"
        site = tmp_path / "site"
        wheel.extractall(site)
    program = "from fcu_emulator.emulator.agents.guides import guide_text, guides; print(guide_text(guides()[1].name))"
    for arguments, expected in (
        (("-m", "fcu_emulator", "--version"), f"\ncommit {head(clone)}\n"),
        (("-c", program), "# The lab, exercise by exercise"),
    ):
        done = run(tmp_path, *arguments, PYTHONPATH=str(site))
        assert expected in done.stdout, done.stderr


@pytest.mark.parametrize(
    "text", ["", "unknown", "1234567 \x1b[31m", "g234567", "1234567\n7654321", "1" * 300]
)
def test_other_text_is_not_a_commit(text: str, tmp_path: Path) -> None:
    (tmp_path / FILE).write_text(text, encoding="utf-8")

    assert stamped(tmp_path) == ""
    assert commit_of_package(tmp_path) == ""


@needs_git
def test_version_is_shown_without_git(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PATH", "")
    done = subprocess.run(
        [sys.executable, "-m", "fcu_emulator", "--version"],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=True,
    )

    assert done.stdout.splitlines()[1] == "commit unknown"
