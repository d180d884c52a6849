"""Every example in the documentation runs, and shows what it says."""

from __future__ import annotations

import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

from emulator import Board
from emulator.scenario import run

ROOT = Path(__file__).parents[2]
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]
BLOCK = re.compile(r"^```(\w+)\n(.*?)^```$", re.DOTALL | re.MULTILINE)


def blocks(language: str) -> list[object]:
    """Each block of one language, named by its page and number."""
    return [
        pytest.param(text, id=f"{page.stem}-{number}")
        for page in PAGES
        for number, (kind, text) in enumerate(BLOCK.findall(page.read_text(encoding="utf-8")))
        if kind == language
    ]


@pytest.mark.parametrize("source", blocks("python"))
def test_python_examples_run(source: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    exec(compile(source, "example", "exec"), {"__name__": "example"})


@pytest.mark.parametrize("session", blocks("console"))
def test_console_examples_print_what_they_show(session: str) -> None:
    """What follows ``$ command`` is its output; ``...`` is the rest, spaces at line ends do not show."""
    command, _, shown = session.partition("\n")
    assert command.startswith("$ fcu ")
    done = subprocess.run(
        [sys.executable, "-m", "emulator", *shlex.split(command.removeprefix("$ fcu "))],
        capture_output=True,
        stdin=subprocess.DEVNULL,
        check=True,
        timeout=120,
    )
    expected = [line.rstrip() for line in shown.rstrip("\n").split("\n")]
    printed = [line.strip("\r ") for line in done.stdout.decode().rstrip("\n").split("\n")]
    if expected[-1] == "...":
        expected = expected[:-1]
        printed = printed[: len(expected)]
    assert printed == expected


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_links_lead_somewhere(page: Path) -> None:
    for target in re.findall(r"\]\((?!https?:)([^)#]+)", page.read_text(encoding="utf-8")):
        assert (page.parent / target).exists(), target


def test_ci_runs_the_readmes_test_command() -> None:
    commands = re.findall(
        r"^```sh\n(.*?)\n```$", (ROOT / "README.md").read_text(encoding="utf-8"), re.MULTILINE
    )
    assert "fcu run --scenario desk" in commands[0]
    assert commands[1] in (ROOT / ".ci" / "run").read_text(encoding="utf-8").splitlines()


@pytest.mark.parametrize("text", blocks("toml"))
def test_scenario_examples_hold(text: str, tmp_path: Path) -> None:
    file = tmp_path / "example.toml"
    file.write_text(text, encoding="utf-8")
    result = run(Board(scenario=file))
    assert result.passed, result.lines
