"""The source line of a failed check: the statement that prints, switches a LED, or waits."""

from __future__ import annotations

import json
import re
import subprocess
import sys
from pathlib import Path
from typing import NamedTuple

import pytest

from fcu_emulator.emulator.grading.judge import judge
from fcu_emulator.emulator.grading.rubric import load_rubric
from fcu_emulator.emulator.grading.tasks import Task, code_digest, judge_task
from fcu_emulator.emulator.grading.verdict import Verdict
from tests.support.arm import student_programs
from tests.support.arm.student_programs import FOLDER, Change, Program, build

pytestmark = pytest.mark.skipif(
    not student_programs.is_buildable(), reason="arm-none-eabi-gcc or make is not installed"
)
SOURCE = (FOLDER / "student" / "main.c").read_text()
WITHIN = 2


class Mistake(NamedTuple):
    old: str
    new: str
    check: str

    @property
    def line(self) -> int:
        return SOURCE[: SOURCE.index(self.old)].count("\n") + 1

    def __str__(self) -> str:
        return self.check + " " + self.new.strip()


MISTAKES = [
    Mistake("if (fabsf(pitch) > 80)", "if (fabsf(pitch) > 60)", "3.led1"),
    Mistake("if (fabsf(roll) > 80)", "if (fabsf(roll) > 90)", "4.led2"),
    Mistake("BSP_LED_On(LED1);", "BSP_LED_Off(LED1);", "3.led1"),
    Mistake("MAG[x,y,z] %d mg", "Mag[x,y,z] %d mg", "1.block"),
    Mistake("Pre: %f hPa", "Pre: %d hPa", "1.pre"),
    Mistake("Altitude: %f m", "Altitude: %f", "2.block"),
    Mistake("samples++;", "samples++; if (samples > 16) HAL_Delay(1);", "1.rate"),
]


def verdict_of(mistake: Mistake, optimisation: str, folder: Path) -> Verdict:
    change = Change("main.c", mistake.old, mistake.new, times=SOURCE.count(mistake.old))
    elf = build(Program("line", "", (change,)), optimisation, folder)
    return judge(str(elf), load_rubric("lab3"), seed=0, exercises=(mistake.check[0],))


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("lines")


@pytest.mark.parametrize("optimisation", ["O0", "O2"])
@pytest.mark.parametrize("mistake", MISTAKES, ids=str)
def test_failed_check_shows_line_of_statement(mistake: Mistake, optimisation: str, folder: Path) -> None:
    checks = {one.check: one for one in verdict_of(mistake, optimisation, folder).checks}

    assert checks[mistake.check].outcome == "failed"
    lines = [int(line) for line in re.findall(r"main\.c:(\d+)", checks[mistake.check].source)]
    assert any(abs(line - mistake.line) <= WITHIN for line in lines), checks[mistake.check].source


def test_passed_checks_have_no_line() -> None:
    verdict = judge("solution", load_rubric("lab3"), seed=0, exercises=("3",))

    assert {one.outcome for one in verdict.checks if one.max_points} == {"passed"}
    assert not any(one.source for one in verdict.checks)


@pytest.mark.parametrize("function", ["MagCalibration", "eCompass"])
@pytest.mark.parametrize("optimisation", ["O0", "O2"])
def test_uncalled_function_is_named(function: str, optimisation: str, folder: Path) -> None:
    exercise = "5" if function == "MagCalibration" else "3"
    mistake = Mistake(f"  {function}();", "  ;", exercise)
    causes = [one for run in verdict_of(mistake, optimisation, folder).evidence for one in run.causes]

    assert causes[0].kind == "call"
    assert f"{function}()" in causes[0].summary


def test_missing_call_is_the_only_cause(folder: Path) -> None:
    elf = build(Program("uncalled", "", (Change("main.c", "  eCompass();\n", ""),)), "Og", folder)
    verdict = judge(
        elf, load_rubric("lab3"), seed=1, exercises=("1", "3")
    )  # exercise 1 prints the angles, too

    assert {one.kind for run in verdict.evidence for one in run.causes} == {"call"}


def test_error_in_explanation_does_not_prevent_verdict(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(*_arguments: object) -> None:
        raise ZeroDivisionError("nothing to divide")

    monkeypatch.setattr("fcu_emulator.emulator.explain.explanation.explain_numbers", fail)
    verdict = verdict_of(Mistake("by * cosf(roll)", "by * sinf(roll)", "3.yaw"), "O2", folder)

    assert {one.check for one in verdict.checks if one.outcome == "failed"} >= {"3.yaw"}
    (said,) = [
        one.summary for run in verdict.evidence for one in run.causes if "ZeroDivisionError" in one.summary
    ]
    assert "nothing to divide" in said


def test_verdict_on_submission_quotes_its_source(folder: Path) -> None:
    rubric = load_rubric("lab3")
    elf = build(
        Program("quoted", "", (Change("main.c", "by * cosf(roll)", "by * sinf(roll)"),)), "O2", folder
    )
    sources = {"main.c": (elf.parent / "main.c").read_bytes()}
    task = Task(elf.read_bytes(), "lab3.elf", "lab3", rubric.digest, 0, code_digest(), sources=sources)
    verdict = Verdict.from_json(judge_task(task))
    details = [detail for run in verdict.evidence for cause in run.causes for detail in cause.details]

    assert "main.c:43: float by2 = bz * sinf(roll) - by * sinf(roll);" in details


def test_run_record_shows_line_that_switches_led(folder: Path) -> None:
    mistake = MISTAKES[0]
    change = Change("main.c", mistake.old, mistake.new)
    elf = build(Program("line", "", (change,)), "O2", folder)
    record = folder / "run.json"
    command = ["run", str(elf), "--scenario", "led_x", "--speed", "max", "--json", str(record)]
    subprocess.run([sys.executable, "-m", "fcu_emulator", *command], capture_output=True, check=False)
    findings = json.loads(record.read_text(encoding="utf-8"))["expectations"]["findings"]

    assert f"main.c:{mistake.line + 1} (on)" in findings[0]["source"]
