"""The speed table can be printed: which build, which rows, figures as JSON. How fast they are is no test."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[2]


def bench(*arguments: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-m", "tests.bench", *arguments],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
    )


def test_a_row_is_measured_and_kept(tmp_path: Path) -> None:
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


def test_a_pattern_without_rows_names_those_there_are() -> None:
    done = bench("--only", "lab4")

    assert done.returncode == 2
    assert "no row matches lab4; there are: lab3, every register read, ideal sensors;" in done.stderr
