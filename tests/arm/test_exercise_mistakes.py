"""Mistakes in the exercises: the scenario of the exercise and the rubric agree, and both lead to the fix.

With FCU_ALL_STUDENTS=1 the tests run all programs of tests/arm/mistakes/exercises.toml, which takes a quarter of an
hour. Otherwise they run a part.
"""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from fcu_emulator import Board
from fcu_emulator.emulator.grading.judge import judge
from fcu_emulator.emulator.grading.rubric import load_rubric
from fcu_emulator.emulator.scenario import run
from tests.integration.test_cli_check import fcu
from tests.support.arm import student_programs
from tests.support.arm.graded_programs import lost, staged
from tests.support.arm.student_programs import Change, Program, build

MISTAKES = student_programs.programs("exercises.toml")
ALL = bool(os.environ.get("FCU_ALL_STUDENTS"))
OF_EXERCISE = {
    "exercise_1": 1,
    "stairs": 2,
    "tilt_sweep": 3,
    "compass_turn": 3,
    "led_x": 3,
    "led_y": 4,
    "figure_eight": 5,
}

pytestmark = pytest.mark.skipif(
    not student_programs.is_buildable(), reason="arm-none-eabi-gcc or make is not installed"
)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("exercises")


def in_one_line(output: str) -> str:
    """Return the words of an output without its line breaks."""
    return " ".join(output.replace("fcu:", " ").split())


@pytest.mark.parametrize("name", list(MISTAKES) if ALL else list(MISTAKES)[::6])
def test_commands_run_and_check_explain_each_mistake(name: str, folder: Path) -> None:
    program = MISTAKES[name]
    assert program.scenario is not None
    exercise = str(OF_EXERCISE[program.scenario])
    elf = str(build(program, "Og", folder))
    played = fcu("run", elf, "--scenario", program.scenario, "--speed", "max")
    checked = fcu("check", elf, "--exercise", exercise)

    assert played.returncode == checked.returncode
    assert played.returncode in (1, 3)
    for words in program.leads:
        assert words in in_one_line(played.stderr)
        assert words in in_one_line(checked.stdout)


@pytest.mark.skipif(not ALL, reason="a quarter of an hour; FCU_ALL_STUDENTS=1")
@pytest.mark.parametrize("name", MISTAKES)
def test_mistake_costs_points_only_in_its_exercise(name: str, folder: Path) -> None:
    program = MISTAKES[name]
    wanted = [one.partition(".") for one in program.loses]
    found = lost(judge(build(program, "Og", folder), load_rubric("lab3"), seed=1))

    assert {
        one for one in found if one.partition(".")[0] not in {exercise for exercise, _, _ in wanted}
    } == set()
    assert {exercise for exercise, _, check in wanted} == {one.partition(".")[0] for one in found}


@pytest.mark.parametrize("scenario", OF_EXERCISE)
def test_scenario_passes_only_after_its_exercise_is_done(scenario: str, folder: Path) -> None:
    exercise = OF_EXERCISE[scenario]

    assert run(Board(str(staged(exercise, folder)), scenario=scenario)).passed
    if exercise > 1:
        assert not run(Board(str(staged(exercise - 1, folder)), scenario=scenario)).passed


CRASH = Program(
    "crash_after_the_first_block",
    "A write to no memory after the template's block",
    (Change("main.c", "    float alt =", "    *(volatile int *)0x60000000 = 1;\n    float alt ="),),
)


def test_crash_costs_only_points_for_later_output(folder: Path) -> None:
    verdict = judge(build(CRASH, "Og", folder), load_rubric("lab3"), seed=1, exercises=["1", "2"])
    points = {one.check: one.points for one in verdict.checks if one.max_points}

    assert {check: got for check, got in points.items() if got} == {"1.setup": 0.5, "1.acc": 1, "1.pre": 0.5}
    assert {one.finding for one in verdict.of("2") if one.max_points} == {"stopped"}


CRASH_WHEN_STEEP = Program(
    "crash_when_steep",
    "A write to no memory where LED1 should be lit",
    (Change("main.c", "    BSP_LED_On(LED1);\n", "    *(volatile int *)0x60000000 = 1;\n"),),
)


def test_exercises_without_crash_keep_their_points(folder: Path) -> None:
    verdict = judge(build(CRASH_WHEN_STEEP, "Og", folder), load_rubric("lab3"), seed=1, exercises=["3", "4"])

    assert lost(verdict) == ("3.yaw", "3.led1")  # the figure-of-eight before the yaw is steep, too


OTHER_LED_TOGGLED = Program(
    "other_led_toggled",
    "LED1 to one side only, and LED2 toggled in main's loop",
    (
        Change("main.c", "if (fabsf(pitch) > 80)", "if (pitch > 80)"),
        Change("main.c", "  if (fabsf(roll) > 80) {\n    BSP_LED_On(LED2);\n", "  if (0) {\n"),
        Change("main.c", "    BSP_LED_Off(LED2);\n", ""),
        Change("main.c", "    HAL_Delay(1000);\n", "    BSP_LED_Toggle(LED2);\n    HAL_Delay(1000);\n"),
    ),
)


def test_causes_for_led_of_other_exercise_are_omitted(folder: Path) -> None:
    elf = str(build(OTHER_LED_TOGGLED, "Og", folder))
    screen = fcu("check", elf, "--exercise", "3").stdout
    titles = [line for line in screen.splitlines() if line.startswith("Exercise 3: ")]
    causes = screen.partition(f"{titles[-1]}\n")[2]

    assert len(titles) == 2  # the checks, and the causes
    assert "LED1" in causes
    assert "LED2" not in causes
