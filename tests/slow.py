"""List of slow tests: ``python -m tests.slow [PATH ...]`` measures tests and writes ``tests/slow.txt``.

A test in this list has the marker ``slow``. ``pytest -m "not slow"`` is the set for use between two changes, under 90
seconds on two cores; the full set is the default. The processor time is measured, including the time of processes that
a test starts, so that a busy machine gives the same list. All cases of a parametrised test count together: a thousand
cases of 5 ms are as slow as one case of 5 s.

Decision: slow tests are in a list from measured times, not marked in the code, because marks of tests that have
become fast would stay. A test refuses entries of tests that do not exist.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from collections import defaultdict
from collections.abc import Generator
from pathlib import Path

import pytest

LIST = Path(__file__).with_name("slow.txt")
SLOW_S = 0.4
_MEASURED = "FCU_MEASURED_TESTS"  # names the file that the measuring process writes


def test_function(nodeid: str) -> str:
    """Return a test without its case: the part before the bracket of ``tests/unit/test_spi.py::test_a[1]``."""
    return nodeid.partition("[")[0]


def listed() -> dict[str, float]:
    """Return the seconds of each slow test, by its name."""
    lines = LIST.read_text(encoding="utf-8").splitlines() if LIST.exists() else []
    return {name: float(seconds) for seconds, name in (line.split() for line in lines)}


def mark(items: list[pytest.Item]) -> None:
    """Add the marker to the tests in the list."""
    slow = listed()
    for item in items:
        if test_function(item.nodeid) in slow:
            item.add_marker(pytest.mark.slow)


def _used_s() -> float:
    times = os.times()
    return times.user + times.system + times.children_user + times.children_system


@pytest.hookimpl(wrapper=True)
def pytest_runtest_protocol(item: pytest.Item) -> Generator[None, object, object]:
    """Note the time of each test, as a plugin of the measuring run."""
    before = _used_s()
    try:
        return (yield)
    finally:
        with Path(os.environ[_MEASURED]).open("a", encoding="utf-8") as file:
            file.write(f"{_used_s() - before:.4f} {test_function(item.nodeid)}\n")


def _measure(paths: list[str]) -> dict[str, float]:
    """Run the tests one after the other, and return their times."""
    command = [sys.executable, "-m", "pytest", "-q", "-n", "0", "-p", "tests.slow", *paths]
    found: dict[str, float] = defaultdict(float)
    with tempfile.TemporaryDirectory() as folder:
        noted = Path(folder) / "measured.txt"
        subprocess.run(command, check=False, env=os.environ | {_MEASURED: str(noted)}, cwd=LIST.parents[1])
        for line in noted.read_text(encoding="utf-8").splitlines():
            seconds, name = line.split()
            found[name] += float(seconds)
    return found


def main(paths: list[str]) -> None:
    """Measure the given tests, and keep the known times of the other tests."""
    measured = _measure(paths)
    kept = {name: seconds for name, seconds in listed().items() if name not in measured and is_there(name)}
    slow = kept | {name: seconds for name, seconds in measured.items() if seconds >= SLOW_S}
    lines = [f"{seconds:7.1f} {name}\n" for name, seconds in sorted(slow.items())]
    LIST.write_text("".join(lines), encoding="utf-8")


def is_there(name: str) -> bool:
    """Return whether the file has a function of this name, or a ``TestName = ...`` of a Hypothesis state machine."""
    file, *classes, function = name.split("::")
    path = LIST.parents[1] / file
    told_by = f"\n{classes[-1]} = " if function == "runTest" else f"def {function}("
    return path.exists() and told_by in path.read_text(encoding="utf-8")


if __name__ == "__main__":
    main(sys.argv[1:])
