"""Modules that an import of ``sensors`` loads, and the list of files in the docstring of each package."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest

from fcu_emulator import sensors

SENSORS = Path(sensors.__path__[0])
PROGRAM = """
import sys
before = set(sys.modules)
from fcu_emulator import sensors
loaded = {name.removeprefix("fcu_emulator.").partition(".")[0] for name in set(sys.modules) - before}
print(*sorted(loaded - sys.stdlib_module_names))
"""


def test_importing_sensors_loads_at_most_numpy() -> None:
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM],
        cwd=Path(__file__).parents[2],
        capture_output=True,
        text=True,
        check=True,
        timeout=60,
    )
    assert set(done.stdout.split()) <= {"fcu_emulator", "sensors", "numpy"}
    assert "sensors" in done.stdout


@pytest.mark.parametrize("package", ["sensors", *(f"sensors.{name.lower()}" for name in sensors.SENSORS)])
def test_package_docstring_lists_its_files(package: str) -> None:
    """The docstring has a table with names of files and their subjects."""
    folder = SENSORS.parent.joinpath(*package.split("."))
    text = sys.modules[f"fcu_emulator.{package}"].__doc__ or ""
    _, table, _ = re.split(r"^=+  =+$", text, flags=re.MULTILINE)
    named = [name for line in table.strip().splitlines() for name in line.partition("  ")[0].split(", ")]

    assert sorted(named) == sorted(file.stem for file in folder.glob("*.py") if file.stem != "__init__")
