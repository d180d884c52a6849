"""Following something through the emulator leads through few files, and no more than it did."""

from __future__ import annotations

import re
import subprocess
import sys
from functools import cache
from pathlib import Path

import pytest

from tests.support.journeys import C_FILES, NATIVE

ROOT = Path(__file__).parents[2]
AT_MOST = {
    "TOML -> verdict": (17, 8, 0),
    "attitude set -> register byte": (17, 0, 0),
    "printf byte -> terminal": (8, 0, 5),
    "I2C read -> sensor": (11, 0, 6),
}
"""Files in Python, those of other rooms beyond the scenarios', files in C."""
LINE = re.compile(r"^(\S.*?) +(\d+)(?:\+(\d+))? files in Python(?:, (\d+) in C)?$", re.MULTILINE)


@cache
def measured() -> dict[str, tuple[int, int, int]]:
    """In a process of its own: what is imported already is not imported on the way."""
    done = subprocess.run(
        [sys.executable, "-m", "tests.support.journeys"], cwd=ROOT, capture_output=True, text=True, check=True
    )
    return {
        name: (int(files), int(beyond or 0), int(in_c or 0))
        for name, files, beyond, in_c in LINE.findall(done.stdout)
    }


def test_all_four_are_measured() -> None:
    assert measured().keys() == AT_MOST.keys()


@pytest.mark.parametrize("name", AT_MOST)
def test_a_journey_leads_through_no_more_files_than_it_did(name: str) -> None:
    files, beyond, in_c = measured()[name]

    assert 3 < files <= AT_MOST[name][0]
    assert beyond <= AT_MOST[name][1]
    assert in_c <= AT_MOST[name][2]


@pytest.mark.parametrize(("file", "function"), [item for files in C_FILES.values() for item in files.items()])
def test_what_c_does_on_the_way_is_where_it_is_said_to_be(file: str, function: str) -> None:
    assert re.search(rf"\b{function}\b", next(NATIVE.rglob(file)).read_text(encoding="utf-8"))


def test_the_architecture_page_leads_where_the_journeys_lead() -> None:
    """Each section's files are among those that were entered on that journey."""
    names = [
        "attitude set -> register byte",
        "printf byte -> terminal",
        "I2C read -> sensor",
        "TOML -> verdict",
    ]
    page = (ROOT / "docs" / "architecture.md").read_text(encoding="utf-8")
    sections = re.findall(r"^## Journey \d: .*?\n(.*?)(?=^## |^`python)", page, re.DOTALL | re.MULTILINE)
    done = subprocess.run(
        [sys.executable, "-m", "tests.support.journeys", "--files"],
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
