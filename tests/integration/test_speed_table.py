"""The speed table can be printed and stored: build, rows, figures as JSON. The speeds are not tested."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

from tests.bench import history

ROOT = Path(__file__).parents[2]


def bench(*arguments: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-m", "tests.bench", *arguments],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
    )


def test_row_is_measured_and_stored(tmp_path: Path) -> None:
    file = tmp_path / "figures.json"
    done = bench("--only", "next board", "--json", str(file))
    kept = json.loads(file.read_text())
    (row,) = kept["rows"]

    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith("commit: ")
    assert f"\nlibrary: {kept['build']['library']}\n" in done.stdout
    assert f"\npython: CPython {sys.version.split()[0]}\n" in done.stdout
    assert row["name"] == "next board in the process"
    assert row["value"] > 0
    assert (row["at_least"], row["aim"], row["unit"], row["less_is_better"]) == (10, 3, "ms", True)


def test_pattern_without_match_lists_existing_rows() -> None:
    done = bench("--only", "lab4")

    assert done.returncode == 2
    assert "no row matches lab4; there are: lab3, every register read, ideal sensors;" in done.stderr


BUILD = {"commit": "abc1234", "library": "sources 1", "python": "CPython 3.11", "machine": "a machine"}


def kept(file: Path, value: float, busy: float = 0.1, **build: str) -> None:
    history.append(BUILD | build, [{"name": "burst", "value": value, "unit": "us"}], busy, file)


def test_history_shows_first_and_latest_values_and_trend(tmp_path: Path) -> None:
    file = tmp_path / "history.jsonl"
    for value in (2.0, 1.0, 1.5):
        kept(file, value)
    heading, row = history.lines(history.curves(file))

    assert heading.startswith("a machine, 20")
    assert row.split() == ["burst", "2", "->", "1.5", "us", "█▁▅"]


def test_history_omits_busy_runs_and_separates_machines(tmp_path: Path) -> None:
    file = tmp_path / "history.jsonl"
    kept(file, 2.0)
    kept(file, 9.0, busy=1.7)
    kept(file, 3.0, machine="another")
    found = history.curves(file)

    assert {where: [point.value for point in points] for (where, _, _), points in found.items()} == {
        "a machine": [2.0],
        "another": [3.0],
    }


def test_history_in_repository_can_be_read() -> None:
    assert all(point.value > 0 for points in history.curves().values() for point in points)
