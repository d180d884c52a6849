"""The types of checks that only rubrics have, with a correct and with a wrong program."""

from __future__ import annotations

from pathlib import Path

import pytest

from fcu_emulator.emulator.grading.judge import judge
from fcu_emulator.emulator.grading.rubric import load_rubric
from fcu_emulator.emulator.grading.verdict import CheckResult
from tests.support.arm import student_programs
from tests.support.arm.student_programs import Change, Program
from tests.support.words import Words

WRONG_YAW = Path(__file__).parents[1] / "arm" / "calls" / "wrong_yaw.elf"
STUCK = Path(__file__).parents[1] / "arm" / "broken" / "delay_in_callback.elf"

needs_compiler = pytest.mark.skipif(
    not student_programs.is_buildable(), reason="arm-none-eabi-gcc or make is not installed"
)


def judged(folder: Path, expectation: str, firmware: str | Path, build_log: str | None = None) -> CheckResult:
    """Return the result of one expectation on a board that lies still for two and a half seconds."""
    file = folder / "one.toml"
    file.write_text(
        f"""\
schema = 1
title = "One check"
run.still = {{ duration = "2.5s" }}
[[exercise]]
id = "1"
title = "Lie still"
run = "still"
[[exercise.check]]
id = "one"
title = "The check"
expect = [{{ {expectation} }}]
""",
        encoding="utf-8",
    )
    (check,) = judge(firmware, load_rubric(file), seed=1, build_log=build_log).checks
    return check


QUIET = 'kind = "quiet_callback", from = "1.2s", for = "1s"'
READS = 'kind = "reads", from = "1.5s", for = "500ms", min_hz = 799, max_hz = 801'


@pytest.mark.parametrize(
    "expectation",
    [
        'kind = "no_fault"',
        'kind = "no_diagnosis", of = ["callback", "bus", "timer", "sensor"]',
        'kind = "led_follows", led = "led1", angle = "pitch"',
        f'{READS}, sensor = "accelerometer"',
        f'{READS}, sensor = "gyroscope"',
        f'{READS}, sensor = "magnetometer"',
        f'{READS}, sensor = "barometer"',
        QUIET,
        'kind = "property", property = "pitch_is_the_inclination_of_the_x_axis", examples = 20',
        'kind = "printed", name = "Pitch", max_gap = "1.3s"',
        'kind = "within", name = "Pitch", min = -10, max = 10',
    ],
)
def test_solution_passes_all_checks(tmp_path: Path, expectation: str) -> None:
    check = judged(tmp_path, expectation, "solution")

    assert (check.outcome, check.actual) == ("passed", "")


@pytest.mark.parametrize(
    ("expectation", "firmware", "actual"),
    [
        ('kind = "led_follows", led = "led1", angle = "pitch"', "template-arm", "LED1 is lit at "),
        (
            f'{READS.replace("799", "900").replace("801", "950")}, sensor = "gyroscope"',
            "solution",
            "800 times",
        ),
        ('kind = "no_diagnosis", of = ["callback"]', STUCK, "stuck in HAL_Delay(), "),
        (
            'kind = "within", name = "Pitch", min = 10, max = 20',
            "solution",
            "2 of 2 printed values are outside",
        ),
        ('kind = "printed", name = "Pitch", max_gap = "1s"', "solution", "none for 1.11"),
        ('kind = "printed", name = "Pitch", max_gap = "1s"', "template-arm", 'no line "Pitch: '),
    ],
)
def test_wrong_program_fails_with_actual_value(
    tmp_path: Path, expectation: str, firmware: str, actual: str
) -> None:
    check = judged(tmp_path, expectation, firmware)

    assert check.outcome == "failed"
    assert check.actual.startswith(actual)


def test_too_few_reads_cause_specific_finding(tmp_path: Path) -> None:
    reads = READS.replace("799", "900").replace("801", "950")

    assert judged(tmp_path, f'{reads}, sensor = "gyroscope"', "solution").finding == "seldom read"


def test_line_printed_only_before_window_is_missing(tmp_path: Path, words: Words) -> None:
    late = 'kind = "field", name = "Pre", truth = true, tolerance = 5, from = "2.3s"'
    check = judged(tmp_path, late, "solution")

    assert (check.outcome, check.finding) == ("failed", "missing")
    words("check", check.actual)


def test_wrap_error_is_found_in_compiled_function(tmp_path: Path) -> None:
    law = "yaw_is_the_direction_of_the_x_axis_against_magnetic_north"
    check = judged(tmp_path, f'kind = "property", property = "{law}"', WRONG_YAW)

    assert check.outcome == "failed"
    assert "yaw is " in check.actual


def test_missing_function_is_unjudged(tmp_path: Path) -> None:
    check = judged(tmp_path, 'kind = "property", property = "calibration_finds_any_offset"', "template-arm")

    assert (check.outcome, check.points) == ("unjudged", 0.0)
    assert "MagCalibration" in check.unjudged_because


def test_internal_error_affects_only_its_check(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(firmware: str, law: str, examples: int) -> str | None:
        raise ExceptionGroup("two", [AssertionError("one"), ZeroDivisionError("other")])

    monkeypatch.setattr("fcu_emulator.emulator.testing.counterexample.counterexample", broken)
    check = judged(tmp_path, 'kind = "property", property = "less_pressure_is_more_altitude"', "solution")

    assert (check.outcome, check.points) == ("unjudged", 0.0)
    assert "property" in check.unjudged_because
    assert "ExceptionGroup" in check.unjudged_because


@needs_compiler
def test_several_counterexamples_are_described_as_one(tmp_path: Path) -> None:
    """If the horizontal part is missing, each sample outside of it violates the law in another way."""
    program = Program(
        "caret",
        "^ for a square",
        (
            Change("main.c", "sqrtf(gy * gy + gz * gz)", "sqrt(acc.AXIS_Y ^ 2 + acc.AXIS_Z ^ 2)"),
            Change("main.c", "sqrtf(gx * gx + gz * gz)", "sqrt(acc.AXIS_X ^ 2 + acc.AXIS_Z ^ 2)"),
        ),
    )
    elf = student_programs.build(program, "O2", tmp_path)
    verdict = judge(elf, load_rubric("lab3"), seed=1, exercises=["3"])
    checks = {one.check: one for one in verdict.checks}

    assert verdict.counts
    assert checks["3.formulas"].outcome == "failed"
    assert "(" not in checks["3.formulas"].actual.partition("(roll")[0]
    assert checks["3.block"].outcome == "passed"


def test_compiler_warnings_without_build_log_are_unjudged(tmp_path: Path) -> None:
    warning = "main.c:3:7: warning: unused variable 'x' [-Wunused-variable]\n"
    found, none, unknown = (
        judged(tmp_path, 'kind = "no_warnings"', "lab3", log) for log in (warning, "  CC main.c\n", None)
    )

    assert found.actual.startswith("1 warning, the first: main.c:3:7: warning: unused variable")
    assert none.outcome == "passed"
    assert unknown.outcome == "unjudged"


@needs_compiler
def test_print_in_callback_is_found(tmp_path: Path) -> None:
    program = student_programs.programs("mistakes.toml")["print_in_callback"]
    check = judged(tmp_path, QUIET, student_programs.build(program, "O2", tmp_path))

    assert check.outcome == "failed"
    assert check.actual.startswith("one at 1.2")
