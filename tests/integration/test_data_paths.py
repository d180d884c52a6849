"""Data passes through few files of the emulator; the numbers must not increase."""

from __future__ import annotations

import re
import subprocess
import sys
from functools import cache
from pathlib import Path

import pytest

from tests.support.data_paths import C_FILES, NATIVE

ROOT = Path(__file__).parents[2]
AT_MOST = {
    "TOML -> verdict": (17, 9, 0),
    "attitude set -> register byte": (18, 0, 0),
    "printf byte -> terminal": (8, 0, 5),
    "I2C read -> sensor": (11, 0, 6),
}
"""Maximum numbers: files in Python, files of packages other than ``scenario``, files in C."""
LINE = re.compile(r"^(\S.*?) +(\d+)(?:\+(\d+))? files in Python(?:, (\d+) in C)?$", re.MULTILINE)


@cache
def measured() -> dict[str, tuple[int, int, int]]:
    """Return the counts of a new process, in which no module is imported yet."""
    done = subprocess.run(
        [sys.executable, "-m", "tests.support.data_paths"],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=True,
    )
    return {
        name: (int(files), int(beyond or 0), int(in_c or 0))
        for name, files, beyond, in_c in LINE.findall(done.stdout)
    }


def test_all_data_paths_are_measured() -> None:
    assert measured().keys() == AT_MOST.keys()


@pytest.mark.parametrize("name", AT_MOST)
def test_data_path_has_at_most_listed_files(name: str) -> None:
    files, beyond, in_c = measured()[name]

    assert 3 < files <= AT_MOST[name][0]
    assert beyond <= AT_MOST[name][1]
    assert in_c <= AT_MOST[name][2]


@pytest.mark.parametrize(("file", "function"), [item for files in C_FILES.values() for item in files.items()])
def test_function_is_in_listed_c_file(file: str, function: str) -> None:
    assert re.search(rf"\b{function}\b", next(NATIVE.rglob(file)).read_text(encoding="utf-8"))


def test_architecture_page_lists_files_of_data_paths() -> None:
    """The files in each section are among those whose functions were called."""
    names = [
        "attitude set -> register byte",
        "printf byte -> terminal",
        "I2C read -> sensor",
        "TOML -> verdict",
    ]
    page = (ROOT / "docs" / "architecture.md").read_text(encoding="utf-8")
    sections = re.findall(r"^## Data path \d: .*?\n(.*?)(?=^## |^`python)", page, re.DOTALL | re.MULTILINE)
    done = subprocess.run(
        [sys.executable, "-m", "tests.support.data_paths", "--files"],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=True,
    )
    entered = dict(re.findall(r"^(\S.*?) +\d.*\n((?: {4}.*\n)+)", done.stdout, re.MULTILINE))

    for name, section in zip(names, sections, strict=True):
        files = re.findall(r"`((?:emulator|sensors)/[\w/.]+\.[pyc]+)`", section)
        assert len(files) > 5
        for file in files:
            shown = Path(file).name if file.startswith("emulator/chip/native/") else file
            assert f"    {shown} " in entered[name], (name, file)
