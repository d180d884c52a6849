"""The fast set of tests omits all slow tests, and the list of slow tests has only existing tests."""

from __future__ import annotations

import subprocess
import sys

import pytest

from tests.slow import LIST, is_there, listed

A_FILE = next(iter(listed())).partition("::")[0]


def collected(marker: str) -> set[str]:
    """Return the test functions of a file that has a slow test."""
    command = [sys.executable, "-m", "pytest", "--collect-only", "-q", "-n", "0", "-m", marker, A_FILE]
    done = subprocess.run(command, cwd=LIST.parents[1], capture_output=True, text=True, check=False)
    return {line.partition("[")[0] for line in done.stdout.splitlines() if "::" in line}


def test_every_entry_is_existing_test() -> None:
    """To remove a missing test: python -m tests.slow PATH, with any short file."""
    assert [name for name in listed() if not is_there(name)] == []


@pytest.mark.parametrize("marker", ["slow", "not slow"])
def test_slow_marker_is_on_listed_tests_only(marker: str) -> None:
    slow = {name for name in listed() if name.startswith(f"{A_FILE}::")}
    found = collected(marker)

    assert found == slow if marker == "slow" else not found & slow
