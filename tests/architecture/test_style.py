"""Linting, formatting and types are part of the tests, so that one command checks the whole tree."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from tests.support import recipe

ROOT = Path(__file__).parents[2]


@pytest.fixture(autouse=True)
def linked() -> None:
    """Return the folder in which the four folders are one package, so that types can be checked."""
    subprocess.run([sys.executable, "building/namespace.py"], cwd=ROOT, check=True)


@pytest.mark.parametrize(
    "command",
    [
        ["ruff", "check", "--no-cache", "."],
        ["ruff", "format", "--no-cache", "--check", "."],
        ["mypy", "--no-incremental"],
    ],
    ids=["lint", "format", "types"],
)
def test_repository_passes_linters(command: list[str]) -> None:
    done = subprocess.run(
        [sys.executable, "-m", *command], cwd=ROOT, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stdout + done.stderr


@pytest.mark.parametrize(
    "command",
    [["ruff", "check", "--no-cache", "--config"], ["mypy", "--strict", "--no-incremental", "--config-file"]],
    ids=["lint", "types"],
)
def test_recipe_for_sensor_and_board_passes_linters(command: list[str], tmp_path: Path) -> None:
    """The files of docs/recipes.md are checked with the settings of the project."""
    sources = recipe.sources()
    for name, source in sources.items():
        (tmp_path / f"{name}.py").write_text(source, encoding="utf-8")
    config = [ROOT / "pyproject.toml"] if command[0] == "ruff" else [""]
    types = os.environ | {"MYPYPATH": os.pathsep.join((str(ROOT / "build" / "types"), str(tmp_path)))}
    done = subprocess.run(
        [sys.executable, "-m", *command, *config, *(f"{name}.py" for name in sources)],
        cwd=tmp_path,
        env=types,
        capture_output=True,
        text=True,
        check=False,
    )

    assert sources
    assert done.returncode == 0, done.stdout + done.stderr


@pytest.mark.parametrize("platform", ["win32", "darwin"])
def test_library_calls_exist_on_other_systems(platform: str) -> None:
    """The type checker knows the contents of the standard library on each system."""
    command = [sys.executable, "-m", "mypy", "--no-incremental", "--platform", platform]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)

    assert done.stdout.startswith("Success"), done.stdout + done.stderr
