"""Lint, format and types, as part of the tests: one command says whether the tree is good."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]


@pytest.fixture(autouse=True)
def linked() -> None:
    """Types are checked where the four folders are one package."""
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
def test_the_tree_is_clean(command: list[str]) -> None:
    done = subprocess.run(
        [sys.executable, "-m", *command], cwd=ROOT, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stdout + done.stderr


@pytest.mark.parametrize("platform", ["win32", "darwin"])
def test_no_call_is_made_that_another_system_lacks(platform: str) -> None:
    """A type checker knows what each standard library has."""
    command = [sys.executable, "-m", "mypy", "--no-incremental", "--platform", platform]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)

    assert done.stdout.startswith("Success"), done.stdout + done.stderr
