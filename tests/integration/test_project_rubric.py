"""A project that has a rubric (``fcu new --rubric``), and a program on several boards (``--boards``)."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
import sys
from pathlib import Path
from urllib.parse import urlsplit

import pytest

from fcu_emulator.emulator.grading.copies import shipped_digests, source_digest
from fcu_emulator.emulator.grading.submissions import SubmittedSource
from fcu_emulator.emulator.live.address import Address
from fcu_emulator.firmware_model import arm
from fcu_emulator.firmware_model.arm import prebuilt
from tests.support.live_fakes import connected

RUBRIC = """\
schema = 1
title = "Print the pitch"
run.still.scenario = "motions/still.toml"
[[exercise]]
id = "1"
title = "Pitch"
run = "still"
[[exercise.check]]
id = "pitch"
title = "the pitch is printed"
expect = [{ kind = "printed", name = "Pitch", max_gap = "2s" }]
"""
SECOND = """\
[[exercise]]
id = "2"
title = "Pitch again"
run = "still"
[[exercise.check]]
id = "again"
title = "the pitch is printed"
expect = [{ kind = "printed", name = "Pitch", max_gap = "2s" }]
"""
SCENARIO = """\
schema = 1
question = "Is the pitch printed?"
duration = "3s"
[[timeline]]
do = "replay"
csv = "walk.csv"
"""
WALK = "t_s,roll_deg,pitch_deg,yaw_deg\n0,0,0,0\n1,0,20,0\n"


def fcu(folder: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "fcu_emulator", *arguments]
    return subprocess.run(command, cwd=folder, capture_output=True, encoding="utf-8", check=False)


@pytest.fixture
def desk(tmp_path: Path) -> Path:
    """Return a folder with a rubric and its files."""
    (tmp_path / "motions").mkdir()
    (tmp_path / "pitch.toml").write_text(RUBRIC, encoding="utf-8")
    (tmp_path / "motions" / "still.toml").write_text(SCENARIO, encoding="utf-8")
    (tmp_path / "motions" / "walk.csv").write_text(WALK, encoding="utf-8")
    return tmp_path


def test_project_has_rubric_and_its_files(desk: Path) -> None:
    done = fcu(desk, "new", "lab", "--rubric", "pitch.toml")

    assert done.returncode == 0, done.stderr
    assert "Print the pitch" in done.stdout
    assert (desk / "lab" / "rubric.toml").read_text(encoding="utf-8") == RUBRIC
    assert (desk / "lab" / "motions" / "walk.csv").is_file()


@pytest.mark.parametrize(("program", "code"), [("solution", 0), ("template", 1)])
def test_check_in_project_uses_its_rubric(desk: Path, program: str, code: int) -> None:
    fcu(desk, "new", "lab", "--rubric", "pitch.toml")
    shutil.copyfile(prebuilt(program), desk / "lab" / "lab3.elf")
    done = fcu(desk / "lab", "check", "lab3.elf")

    assert done.returncode == code, done.stderr
    assert done.stdout.startswith("Print the pitch\n")
    assert "--rubric" not in done.stdout
    shutil.rmtree(desk / "motions")
    assert fcu(desk, "check", "lab/lab3.elf").returncode == code


def test_next_step_of_rubric_may_name_function(desk: Path) -> None:
    table = 'title = "Pitch"\nnext = "Compute it in HAL_TIM_PeriodElapsedCallback(), and print it."'
    (desk / "pitch.toml").write_text(RUBRIC.replace('title = "Pitch"', table), encoding="utf-8")
    done = fcu(desk, "check", "template-arm", "--rubric", "pitch.toml")

    assert "\nNext\n  Compute it in HAL_TIM_PeriodElapsedCallback(), and print it.\n" in done.stdout


def test_rubric_option_precedes_rubric_of_project(desk: Path) -> None:
    fcu(desk, "new", "lab", "--rubric", "pitch.toml")
    done = fcu(desk / "lab", "check", "solution", "--rubric", "lab3", "--exercise", "2")

    assert done.stdout.startswith("LAB3")


def test_new_command_with_unknown_rubric_creates_no_files(desk: Path) -> None:
    done = fcu(desk, "new", "lab", "--rubric", "ptch.toml")

    assert done.returncode == 2
    assert not (desk / "lab").exists()


def test_rubric_with_files_elsewhere_is_not_copied(desk: Path) -> None:
    (desk / "deep").mkdir()
    (desk / "deep" / "pitch.toml").write_text(RUBRIC.replace('"motions/', '"../motions/'), encoding="utf-8")
    done = fcu(desk, "new", "lab", "--rubric", "deep/pitch.toml")

    assert (done.returncode, (desk / "lab").exists()) == (2, False)


TITLE = 'Tilt */ "alarm" /* 100 %'


@pytest.mark.parametrize("asked", [False, True])
def test_project_program_shows_title_of_rubric(desk: Path, asked: bool) -> None:
    line = ', { kind = "line", text = "LAB3 Init..." }' if asked else ""
    rubric = RUBRIC.replace('"2s" }', f'"2s" }}{line}').replace('"Print the pitch"', f"'{TITLE}'")
    (desk / "pitch.toml").write_text(rubric, encoding="utf-8")
    fcu(desk, "new", "lab", "--rubric", "pitch.toml")
    program = (desk / "lab" / "main.c").read_text(encoding="utf-8")
    comment, rest = program.split("*/\n", 1)

    assert comment.startswith('/* Tilt * / "alarm" / * 100 %\n')
    assert re.findall("LAB3.*", rest) == (['LAB3 Init...\\n");'] if asked else [])
    assert not re.search("eCompass|slides", program)
    assert program.count("YOUR CODE HERE") == 4
    assert (
        arm.sources().joinpath("template", "main.c").read_text(encoding="utf-8").count("YOUR CODE HERE") == 4
    )


def test_program_of_project_equals_template(desk: Path) -> None:
    fcu(desk, "new", "lab", "--rubric", "pitch.toml")
    program = SubmittedSource({"main.c": (desk / "lab" / "main.c").read_bytes()})

    assert shipped_digests()[source_digest(program)] == "template"


# -- Several boards -----------------------------------------------------------------------------------------


@pytest.mark.parametrize(("program", "passed", "code"), [("solution", 3, 0), ("template-arm", 0, 1)])
def test_check_command_counts_boards_with_all_points(
    desk: Path, program: str, passed: int, code: int
) -> None:
    done = fcu(desk, "check", program, "--rubric", "pitch.toml", "--boards", "3", "--seed", "5")

    assert done.returncode == code, done.stderr
    assert re.findall(r"^  (?:PASS|FAIL)  board (\d+)", done.stdout, re.MULTILINE) == ["5", "6", "7"]
    assert f"{passed} of 3 boards" in done.stdout
    assert ("1.pitch loses points on board 5, 6, 7" in done.stdout) is (code == 1)


@pytest.mark.parametrize("option", [["--json", "j.json"], ["--save", "out"], ["--hint"]])
def test_boards_with_options_for_one_board_are_refused(desk: Path, option: list[str]) -> None:
    done = fcu(desk, "check", "solution", "--rubric", "pitch.toml", "--boards", "2", *option)

    assert (done.returncode, done.stdout) == (2, "")


# -- The project's pages ------------------------------------------------------------------------------------


TWO = RUBRIC.replace('id = "1"', 'id = "a1"') + SECOND
HIDDEN = RUBRIC.replace('id = "1"', 'id = "a1"') + SECOND.replace(
    'id = "again"', 'id = "again"\nvisible = "never"'
)


def offered(folder: Path, firmware: str) -> list[dict[str, str]]:
    """Return the exercises that the page of ``fcu web`` receives."""
    command = [sys.executable, "-m", "fcu_emulator", "web", firmware, "--no-browser"]
    with subprocess.Popen(command, cwd=folder, stderr=subprocess.PIPE, encoding="utf-8") as server:
        try:
            assert server.stderr is not None
            url = urlsplit(next(found[0] for line in server.stderr if (found := re.search(r"http\S+", line))))
            assert url.port is not None
            with connected(Address(url.port, url.fragment.removeprefix("token="))) as client:
                hello = json.loads(client.recv(timeout=60))
        finally:
            server.terminate()
    exercises: list[dict[str, str]] = hello["exercises"]
    return exercises


@pytest.mark.parametrize("rubric", [TWO, HIDDEN], ids=["two", "one of two hidden"])
def test_page_offers_exercises_of_project(desk: Path, rubric: str) -> None:
    (desk / "pitch.toml").write_text(rubric, encoding="utf-8")
    fcu(desk, "new", "lab", "--rubric", "pitch.toml")
    shutil.copyfile(prebuilt("template"), desk / "lab" / "lab3.elf")
    exercises = offered(desk, "lab/lab3.elf")

    assert [one["id"] for one in exercises] == (["a1", "2"] if rubric is TWO else ["a1"])
    assert (exercises[0]["title"], exercises[0]["question"]) == ("Pitch", "Is the pitch printed?")


def test_page_with_wrong_rubric_offers_no_exercise(desk: Path) -> None:
    (desk / "rubric.toml").write_text("schema = 1\n", encoding="utf-8")

    assert offered(desk, "template-arm") == []


@pytest.mark.parametrize("rubric", [TWO, HIDDEN], ids=["two", "one of two hidden"])
def test_readme_and_workflow_list_project_exercises(desk: Path, rubric: str) -> None:
    (desk / "pitch.toml").write_text(rubric.replace("the pitch", "a | b"), encoding="utf-8")
    fcu(desk, "new", "lab", "--rubric", "pitch.toml")
    readme = (desk / "lab" / "README.md").read_text(encoding="utf-8")
    (workflow,) = (desk / "lab" / ".github" / "workflows").iterdir()
    steps = workflow.read_text(encoding="utf-8")

    assert readme.startswith("# Print a \\| b\n")
    shown = ["a1", "2"] if rubric is TWO else ["a1"]
    assert re.findall(r"^\| (\w+) \|.*`fcu check --exercise \1`", readme, re.MULTILINE) == shown
    assert not re.search("LAB3|tilt_sweep", readme)
    assert re.findall(r"fcu check --exercise (\S+)", steps) == ["a1"]
    assert re.findall(r"add --exercise (\S+)", steps) == shown[1:]
    assert (workflow.name, "lab3" in steps) == ("check.yml", False)


def test_project_without_rubric_uses_lab3(desk: Path) -> None:
    fcu(desk, "new", "lab")

    assert (desk / "lab" / "README.md").read_text(encoding="utf-8").startswith("# LAB3")
    assert "--exercise 1 " in (desk / "lab" / ".github" / "workflows" / "lab3.yml").read_text(
        encoding="utf-8"
    )
