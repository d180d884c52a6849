"""The lab of docs/tilt-alarm.md: its rubric, its solution and wrong programs, graded as a class."""

from __future__ import annotations

import csv
import re
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

import jsonschema
import pytest

from fcu_emulator.emulator.grading.rubric import json_schema, load_rubric
from fcu_emulator.emulator.grading.trials import trials
from fcu_emulator.emulator.grading.verdict import Verdict
from fcu_emulator.firmware_model import arm
from tests.support.arm import student_programs

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "tilt-alarm.md").read_text(encoding="utf-8")
(RUBRIC,) = re.findall(r"^```toml\n(.*?)^```$", PAGE, re.DOTALL | re.MULTILINE)
VARIABLE, LOOP, CALLBACK = re.findall(r"^```c\n(.*?)^```$", PAGE, re.DOTALL | re.MULTILINE)
ROW = re.compile(r"^\| (.+?) \| (\d+) \| (.+?) \|$", re.MULTILINE)
BOTH = "fabsf(roll) > 45.0f"

needs_compiler = pytest.mark.skipif(
    not student_programs.is_buildable(), reason="arm-none-eabi-gcc or make is not installed"
)


def solution() -> str:
    """Return the template with the additions of the page."""
    source = (arm.sources() / "template" / "main.c").read_text(encoding="utf-8")
    return replaced(
        source,
        ("/* YOUR CODE HERE: your variables", f"{VARIABLE}\n/* YOUR CODE HERE: your variables"),
        ("    /* YOUR CODE HERE: altitude", f"{LOOP}    /* YOUR CODE HERE: altitude"),
        ("  /* YOUR CODE HERE: computations", f"{CALLBACK}  /* YOUR CODE HERE: computations"),
        ("    BSP_LED_Toggle(LED1);\n", ""),
    )


def replaced(text: str, *changes: tuple[str, str]) -> str:
    for old, new in changes:
        assert text.count(old) >= 1, old
        text = text.replace(old, new)
    return text


def led(condition: str) -> tuple[str, str]:
    return f"if ({BOTH}) {{\n    BSP", f"if ({condition}) {{\n    BSP"


def alarm(condition: str) -> tuple[str, str]:
    return f"if ({BOTH}) {{\n      PRINTF", f"if ({condition}) {{\n      PRINTF"


WRONG = {
    "your own program": (),
    "threshold 40 in both conditions": (("45.0f", "40.0f"),),
    "one side only: `roll < -45.0f` in both": ((BOTH, "roll < -45.0f"),),
    "`fabsf` missing at the LED": (led("roll > 45.0f"),),
    "inverted LED": (led("fabsf(roll) <= 45.0f"),),
    "alarm printed once only": (
        alarm(f"{BOTH} && alarms++ == 0"),
        ("float roll;", "int alarms; float roll;"),
    ),
    "alarm printed always": (alarm("1"),),
    "pitch in place of roll": (("atan2f(gy, sqrtf(gx * gx", "atan2f(-gx, sqrtf(gy * gy"),),
}


def programs() -> dict[str, str]:
    found = {name: replaced(solution(), *changes) for name, changes in WRONG.items()}
    return {**found, "the template": (arm.sources() / "template" / "main.c").read_text(encoding="utf-8")}


@needs_compiler
def test_class_gets_points_shown_on_page(tmp_path: Path) -> None:
    (tmp_path / "tilt.toml").write_text(RUBRIC, encoding="utf-8")
    numbers = {name: f"s{number}" for number, name in enumerate(programs())}
    for name, source in programs().items():
        folder = tmp_path / "submissions" / numbers[name]
        folder.mkdir(parents=True)
        (folder / "main.c").write_text(source, encoding="utf-8")
    sandbox = [] if shutil.which("bwrap") else ["--build-without-sandbox"]
    command = ["grade", "submissions", "--rubric", "tilt.toml", "--out", "graded", "--jobs", "1", *sandbox]
    done = subprocess.run(
        [sys.executable, "-m", "fcu_emulator", *command],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    with (tmp_path / "graded" / "grades.csv").open(encoding="utf-8-sig") as file:
        points = {row["id"]: float(row["points"]) for row in csv.DictReader(file)}

    shown = {name: (float(most), loses) for name, most, loses in ROW.findall(PAGE)}
    got = {}
    for name, number in numbers.items():
        evidence = (tmp_path / "graded" / "evidence" / f"{number}.json").read_text(encoding="utf-8")
        verdict = Verdict.model_validate_json(evidence)
        lost = [check.check for check in verdict.checks if check.outcome != "passed"]
        got[name] = (points[number], ", ".join(lost) or "nothing")
    assert got == shown
    page = (tmp_path / "graded" / "students" / "s0.html").read_text(encoding="utf-8")
    for name in ("tilt=%d cdeg", "LED1 while ", "ALARM"):
        assert re.search(f"<figcaption>[^<]*{name}", page), name


def test_rubric_follows_schema() -> None:
    jsonschema.Draft202012Validator(json_schema()).validate(tomllib.loads(RUBRIC))


@needs_compiler
def test_solution_has_all_points_on_several_boards(tmp_path: Path) -> None:
    new = [
        sys.executable,
        "-m",
        "emulator",
        "new",
        str(tmp_path / "lab"),
        "--rubric",
        str(tmp_path / "tilt.toml"),
    ]
    (tmp_path / "tilt.toml").write_text(RUBRIC, encoding="utf-8")
    subprocess.run(new, check=True, capture_output=True)
    (tmp_path / "lab" / "main.c").write_text(solution(), encoding="utf-8")
    done = subprocess.run(
        [sys.executable, "-m", "fcu_emulator", "check", "--boards", "5"],
        cwd=tmp_path / "lab",
        capture_output=True,
        text=True,
        check=False,
    )

    assert done.returncode == 0, done.stdout + done.stderr
    assert len(re.findall(r"10 of 10", done.stdout)) == 5


def test_programs_that_do_nothing_get_no_points(tmp_path: Path) -> None:
    (tmp_path / "tilt.toml").write_text(RUBRIC, encoding="utf-8")

    assert [one.earned for one in trials(load_rubric(tmp_path / "tilt.toml"), "template-arm")] == [{}] * 5
