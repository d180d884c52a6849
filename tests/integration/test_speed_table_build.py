"""A table of figures names its commit, and states whether the sources of the build differ from it."""

from __future__ import annotations

import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest

from fcu_emulator.emulator.host.commit import commit
from tests.integration.test_library import PACKAGES, copied_clone

CHANGED = " with changes"


def git(folder: Path, *arguments: str) -> str:
    identity = ("-c", "user.name=name", "-c", "user.email=name@example.org")
    command = ["git", *identity, "-C", str(folder), *arguments]
    return subprocess.run(command, capture_output=True, text=True, check=True).stdout.strip()


@pytest.fixture(scope="module")
def repository(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a repository with all files that a wheel needs, committed."""
    folder = copied_clone(tmp_path_factory.mktemp("build") / "clone")
    git(folder, "init", "-q")
    git(folder, "add", "-A")
    git(folder, "commit", "-q", "-m", "all")
    return folder


@pytest.fixture
def clone(repository: Path) -> Iterator[Path]:
    yield repository
    git(repository, "reset", "-q", "--hard")
    git(repository, "clean", "-q", "-f", "-d")


def head(clone: Path) -> str:
    return git(clone, "rev-parse", "--short", "HEAD")


def test_clean_clone_is_identified_by_its_commit(clone: Path) -> None:
    assert commit(clone) == head(clone)


@pytest.mark.parametrize("folder", [*PACKAGES, "fcu_emulator", "building"])
def test_changed_and_new_files_of_build_are_marked(folder: str, clone: Path) -> None:
    changed = clone / git(clone, "ls-files", folder).splitlines()[0]
    changed.write_bytes(changed.read_bytes() + b"\n")
    with_a_change = commit(clone)
    git(clone, "reset", "-q", "--hard")
    (clone / folder / "new.py").touch()

    assert with_a_change == commit(clone) == head(clone) + CHANGED


def test_changed_settings_of_build_are_marked(clone: Path) -> None:
    (clone / "pyproject.toml").write_text("", encoding="utf-8")

    assert commit(clone) == head(clone) + CHANGED


def test_changed_documents_are_not_marked(clone: Path) -> None:
    (clone / "README.md").write_text("", encoding="utf-8")
    (clone / "figures.json").touch()

    assert commit(clone) == head(clone)


def test_installed_package_has_no_commit(clone: Path, tmp_path: Path) -> None:
    """An environment inside a clone does not belong to the clone's commit."""
    installed = clone / "environment" / "site-packages"
    installed.mkdir(parents=True)

    assert commit(installed) == commit(tmp_path) == ""
