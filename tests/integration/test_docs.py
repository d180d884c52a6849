"""Every example in the documentation runs and has the shown output, and named files exist."""

from __future__ import annotations

import re
import runpy
import shlex
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest
from PIL import Image, ImageSequence

from fcu_emulator import Board, BusTransfer
from fcu_emulator.emulator.grading.judge import judge
from fcu_emulator.emulator.grading.rubric import load_rubric
from fcu_emulator.emulator.scenario import run, scenario_names
from tests.support import recipe

ROOT = Path(__file__).parents[2]
PAGES = [path for folder in (".", "docs", "changes") for path in sorted((ROOT / folder).glob("*.md"))]
BLOCK = re.compile(r"^```(\w+)\n(.*?)^```$", re.DOTALL | re.MULTILINE)
LONGEST_README = 500  # words
LARGEST_PICTURE = 1_500_000  # bytes
NAMED = re.compile(
    r"`((?:emulator|sensors|registers|firmware_model|scenarios|building|tests|docs)/[\w./-]+)`"
)


NAMED_TEST = re.compile(r"`(tests/[\w/]+\.py)::(test_\w+)`")


def text_of(page: Path) -> str:
    return page.read_text(encoding="utf-8")


def blocks(language: str) -> list[object]:
    """Yield each block of one language, named by its page and number."""
    return [
        pytest.param(text, id=f"{page.stem}-{number}")
        for page in PAGES
        for number, (kind, text) in enumerate(BLOCK.findall(text_of(page)))
        if kind == language
    ]


def fcu(command: str, folder: Path | None = None, *, check: bool = True) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-m", "fcu_emulator", *shlex.split(command.removeprefix("fcu "))],
        capture_output=True,
        stdin=subprocess.DEVNULL,
        encoding="utf-8",
        check=check,
        cwd=folder,
        timeout=240,
    )


@pytest.mark.parametrize("source", blocks("python"))
def test_python_examples_run(source: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Examples that contain tests are run with pytest."""
    monkeypatch.chdir(tmp_path)
    if source.startswith(recipe.FILES):  # imported already, from this page
        return
    if "def test_" in source:
        (tmp_path / "test_example.py").write_text(source, encoding="utf-8")
        command = [sys.executable, "-m", "pytest", "-q", "-n", "0", "-p", "no:cacheprovider"]
        done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=240)
        assert done.returncode == 0, done.stdout
        return
    exec(compile(source, "example", "exec"), {"__name__": "example"})


@pytest.mark.parametrize("session", blocks("console"))
def test_console_examples_print_output_shown_on_page(session: str) -> None:
    """The text after ``$ command`` is its output. ``...`` replaces other output, and spaces at line ends do not count."""
    command, _, shown = session.partition("\n")
    assert command.startswith("$ fcu ")
    expected = [line.rstrip() for line in shown.rstrip("\n").split("\n")]
    done = fcu(command.removeprefix("$ "))
    printed = [line.strip("\r ") for line in done.stdout.rstrip("\n").split("\n")]
    if expected[-1] == "...":
        expected = expected[:-1]
        printed = printed[: len(expected)]
    assert printed == expected


(LAB,) = (text for kind, text in BLOCK.findall(text_of(ROOT / "docs" / "tilt-alarm.md")) if kind == "toml")


@pytest.mark.parametrize("text", blocks("toml"))
def test_scenario_examples_pass(text: str, tmp_path: Path) -> None:
    if text == LAB:
        return  # asks for another program than LAB3's: tests/grading/test_tilt_alarm.py
    file = tmp_path / "example.toml"
    file.write_text(text, encoding="utf-8")
    if "[[exercise]]" in text:
        verdict = judge("lab3", load_rubric(file), seed=1)
        assert verdict.points == verdict.max_points > 0, verdict.checks
        return
    result = run(Board(scenario=file))
    assert result.passed, result.lines


def anchors(page: Path) -> set[str]:
    """Return the anchors of headings on GitHub and in MyST: lower case, hyphens for spaces, no punctuation."""
    headings = re.findall(r"^#+ (.*)$", re.sub(r"(?ms)^```.*?^```$", "", text_of(page)), re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings}


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_links_have_targets(page: Path) -> None:
    for target, heading in re.findall(r"\]\((?!https?:)([^)#]*)#?([^)]*)\)", text_of(page)):
        file = (page.parent / target) if target else page
        assert file.exists(), target
        assert not heading or heading in anchors(file), f"{target}#{heading}"


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_tests_named_on_page_exist(page: Path) -> None:
    for file, name in NAMED_TEST.findall(text_of(page)):
        assert f"def {name}(" in text_of(ROOT / file), f"{file}::{name}"


def test_index_of_decisions_is_up_to_date() -> None:
    """If it is outdated: python building/decisions.py"""
    script = runpy.run_path(str(ROOT / "building" / "decisions.py"))
    page = text_of(ROOT / "docs" / "decisions.md")

    assert script["rewrite"](page) == page
    assert page.count("\n- ") > 100


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_named_files_exist(page: Path) -> None:
    if page.name == "CHANGELOG.md":
        return  # what was said of a version stays
    assert [name for name in NAMED.findall(text_of(page)) if not (ROOT / name).exists()] == []


def test_every_page_can_be_reached_from_readme() -> None:
    linked, waiting = set(), [ROOT / "README.md"]
    while waiting:
        page = waiting.pop()
        if page not in linked:
            linked.add(page)
            targets = re.findall(r"\]\((?!https?:)([^)#]+\.md)", text_of(page))
            waiting.extend((page.parent / target).resolve() for target in targets)

    assert {page for page in PAGES if page not in linked and not page.name.startswith("+")} == set()


def test_readme_can_be_read_in_three_minutes() -> None:
    assert len(text_of(ROOT / "README.md").split()) <= LONGEST_README


def test_fragments_of_changelog_have_kind() -> None:
    files = [path.name for path in (ROOT / "changes").iterdir() if path.name != "README.md"]
    kinds = tomllib.loads(text_of(ROOT / "pyproject.toml"))["tool"]["towncrier"]["type"]
    suffixes = tuple(f".{kind['directory']}.md" for kind in kinds)

    assert [name for name in files if not (name.startswith("+") and name.endswith(suffixes))] == []


def test_ci_runs_readmes_test_command() -> None:
    commands = re.findall(r"^```sh\n(.*?)\n```$", text_of(ROOT / "README.md"), re.MULTILINE)
    assert " --scenario desk" in commands[0]
    assert commands[1] in text_of(ROOT / ".ci" / "run").splitlines()


def test_readme_animation_lasts_eight_seconds() -> None:
    """``python building/picture.py`` creates the picture."""
    file = ROOT / "docs" / "run.webp"
    shown_ms = []
    with Image.open(file) as picture:
        for frame in ImageSequence.Iterator(picture):
            frame.load()
            shown_ms.append(frame.info["duration"])

    assert "](docs/run.webp)" in text_of(ROOT / "README.md")
    assert file.stat().st_size < LARGEST_PICTURE
    script = runpy.run_path(str(ROOT / "building" / "picture.py"))
    seconds = script["END_S"] - script["BEGIN_S"] + 1
    assert sum(shown_ms) == pytest.approx(1000 * seconds, abs=200)
    assert len(shown_ms) > 0.8 * (seconds - 1) / script["STEP_S"]


EXERCISES = re.findall(
    r"^\| ([\d, \w]+) \|.*\| `fcu run lab3.elf --scenario (\w+)`",
    text_of(ROOT / "docs" / "student.md"),
    re.MULTILINE,
)


def test_every_exercise_has_scenario() -> None:
    assert [exercise[0] for exercise, _ in EXERCISES] == ["1", "2", "3", "3", "3", "4", "5"]
    assert {scenario for _, scenario in EXERCISES} < set(scenario_names())


@pytest.mark.parametrize("scenario", [scenario for _, scenario in EXERCISES])
def test_exercise_scenario_passes_only_for_finished_exercise(scenario: str) -> None:
    assert run(Board(firmware="solution", scenario=scenario)).passed
    done_by_template = scenario == "exercise_1"
    assert run(Board(firmware="template-arm", scenario=scenario)).passed is done_by_template


def test_fragments_are_joined_to_section_of_changelog() -> None:
    command = [sys.executable, "-m", "towncrier", "build", "--draft", "--version", "next"]
    section = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True).stdout
    fragments = list((ROOT / "changes").glob("+*.md"))

    assert section.startswith("## next (")
    assert len(re.findall(r"^- ", section, re.MULTILINE)) == len(fragments)


def test_migration_table_lists_existing_features() -> None:
    page = text_of(ROOT / "docs" / "renamed.md")
    table = page[page.index("| 0.1.0 | now |") :].partition("\n\n")[0]
    rows = [row.strip("| ").split(" | ") for row in table.splitlines()[2:]]
    now = [code for _, right in rows for code in re.findall(r"`([^`]+)`", right)]
    board = Board()

    imports = [code for code in now if code.startswith("from fcu_emulator import ")]
    attributes = [code for code in now if re.fullmatch(r"board(\.\w+)+", code)]
    assert len(imports) > 3
    assert len(attributes) > 3
    for code in imports:
        exec(code)
    for code in attributes:
        eval(code, {"board": board})
    assert all(hasattr(BusTransfer, name) for name in ("t_s", "end_s"))
    assert board.tim9.longest_wait_s == 0
