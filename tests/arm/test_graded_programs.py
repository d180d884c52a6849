"""Programs with more exercises done pass more checks, and each mistake fails its own checks.

The whole class: ``python -m tests.support.arm.graded_programs``. This file tests a part of it, one exercise at a
time.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from fcu_emulator import Board
from fcu_emulator.emulator.grading.judge import judge
from fcu_emulator.emulator.grading.rubric import Rubric, load_rubric
from fcu_emulator.emulator.grading.verdict import Verdict
from tests.support.arm import graded_programs, student_programs
from tests.support.arm.graded_programs import EXERCISES, OPTIMISATION, lost, staged
from tests.support.arm.student_programs import build

MISTAKES = student_programs.programs("mistakes.toml")
VARIANTS = student_programs.programs("variants.toml")

needs_compiler = pytest.mark.skipif(
    not student_programs.is_buildable(), reason="arm-none-eabi-gcc or make is not installed"
)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("class")


@pytest.fixture(scope="module")
def rubric() -> Rubric:
    return load_rubric("lab3")


def green(verdict: Verdict) -> list[str]:
    return [one.exercise for one in verdict.exercises if verdict.is_done(one.exercise)]


def test_template_passes_only_exercise_1(rubric: Rubric) -> None:
    verdict = judge("template-arm", rubric, seed=1)

    assert green(verdict) == ["1"]
    assert {one.check for one in verdict.checks if one.outcome == "unjudged"} == {
        *("1.warnings", "2.formula", "3.formulas", "5.calibration")
    }


def test_solution_passes_everything_on_another_board(rubric: Rubric) -> None:
    verdict = judge("solution", rubric, seed=2)

    assert (green(verdict), verdict.points) == (list(EXERCISES), rubric.max_points)
    assert [one.check for one in verdict.checks if one.outcome != "passed"] == [
        "1.warnings"
    ]  # not built here


@needs_compiler
@pytest.mark.parametrize("done", [2, 3, 4])
def test_completed_exercises_pass_without_later_ones(done: int, rubric: Rubric, folder: Path) -> None:
    verdict = judge(staged(done, folder), rubric, seed=1)

    assert green(verdict) == list(EXERCISES[:done])
    assert lost(verdict) == graded_programs.expected(done)


@needs_compiler
@pytest.mark.parametrize(
    ("name", "exercises"),
    [
        ("int16_overflow", "1"),
        ("no_bdu", "1"),
        ("print_in_callback", "1"),
        ("ratio_upside_down", "2"),
        ("integer_division", "2"),
        ("fabsf_missing", "4"),
        ("axis_negated", "5"),
        ("led_inverted", "4"),
    ],
)
def test_mistake_fails_only_its_checks(name: str, exercises: str, rubric: Rubric, folder: Path) -> None:
    program = MISTAKES[name]
    verdict = judge(build(program, OPTIMISATION, folder), rubric, seed=1, exercises=exercises)

    assert lost(verdict) == tuple(one for one in graded_programs.loses(program) if one[0] in exercises)


@needs_compiler
@pytest.mark.parametrize(("name", "exercises"), [("flag_for_main", "1"), ("seldom", "5"), ("tasks", "4")])
def test_correct_variant_passes_all_checks(name: str, exercises: str, rubric: Rubric, folder: Path) -> None:
    elf = build(VARIANTS[name], OPTIMISATION, folder)

    assert lost(judge(elf, rubric, seed=1, exercises=exercises)) == ()


@needs_compiler
def test_constant_output_earns_no_points_for_numbers(rubric: Rubric, folder: Path) -> None:
    elf = build(graded_programs.CONSTANTS, OPTIMISATION, folder)
    verdict = judge(elf, rubric, seed=1, exercises=["1", "2"])

    wanted = tuple(one for one in graded_programs.CONSTANTS_LOSE if one[0] in "12")
    assert lost(verdict) == wanted


@pytest.mark.parametrize("run", ["sensors", "stairs", "tilt", "steep_x", "steep_y", "heading", "iron"])
def test_random_motions_stay_in_ranges_of_sensors(run: str, rubric: Rubric) -> None:
    """The motions are in the range of the sensors at the lab's settings, and acceleration does not distort the tilt."""
    for seed in range(25):
        scenario = rubric.scenario(run, seed)
        world = Board(scenario=scenario, seed=seed).world  # motions are planned ahead
        t_s = np.linspace(0.0, scenario.duration_s, 400)
        assert np.abs(world.angular_rate_dps(t_s)).max() < 1000
        assert np.abs(np.linalg.norm(world.specific_force_g(t_s), axis=1) - 1).max() < 0.7
        assert np.abs(world.magnetic_field_mgauss(t_s)).max() < 2000
        assert 900 < world.pressure_hpa(t_s).min() <= world.pressure_hpa(t_s).max() < 1100


@pytest.mark.parametrize(("run", "axis"), [("steep_x", 0), ("steep_y", 1)])
def test_led_motion_passes_threshold_on_both_sides(run: str, axis: int, rubric: Rubric) -> None:
    for seed in range(25):
        scenario = rubric.scenario(run, seed)
        world = Board(scenario=scenario, seed=seed).world
        force_g = world.specific_force_g(np.linspace(0.0, scenario.duration_s, 400))
        inclination_deg = np.degrees(np.arcsin(force_g[:, axis].clip(-1, 1)))
        assert inclination_deg.max() > 83
        assert inclination_deg.min() < -83


def test_hard_iron_keeps_every_axis_away_from_0(rubric: Rubric) -> None:
    """If an axis came near 0, a program whose minimum and maximum begin at 0 would pass."""
    for seed in range(25):
        scenario = rubric.scenario("iron", seed)
        world = Board(scenario=scenario, seed=seed).world
        field_mgauss = world.magnetic_field_mgauss(np.linspace(0.0, scenario.duration_s, 400))
        assert (np.abs(field_mgauss).min(axis=0) > 50).all()


@pytest.mark.parametrize("run", ["heading", "iron"])
@pytest.mark.parametrize("wrong", ["pitch", "roll"])
def test_wrong_axis_in_square_root_changes_yaw(run: str, wrong: str, rubric: Rubric) -> None:
    """The error lasts longer than a pass of the main loop, so that a print shows it, and exceeds the tolerance."""
    for seed in range(40):
        scenario = rubric.scenario(run, seed)
        world = Board(scenario=scenario, seed=seed).world
        t_s = np.arange(14.1, scenario.duration_s, 0.01)  # after the figure-of-eight and the first turn
        force_g = world.specific_force_g(t_s)
        field = world.magnetic_field_mgauss(t_s) - world.hard_iron_mgauss(t_s)
        error_deg = np.abs(_yaw_deg(force_g, field, wrong) - _yaw_deg(force_g, field, ""))
        shown_s = 0.01 * (np.minimum(error_deg, 360 - error_deg) > 4.5).sum()
        assert shown_s > 1.2, f"seed {seed}"


def _yaw_deg(force_g: np.ndarray, field: np.ndarray, wrong: str) -> np.ndarray:
    """Return the yaw by the formula on the slides. ``wrong``: the angle with its own axis in its square root."""
    (gx, gy, gz), (bx, by, bz) = force_g.T, field.T
    pitch = np.arctan2(-gx, np.hypot(gx if wrong == "pitch" else gy, gz))
    roll = np.arctan2(gy, np.hypot(gy if wrong == "roll" else gx, gz))
    by2 = bz * np.sin(roll) - by * np.cos(roll)
    bz2 = by * np.sin(roll) + bz * np.cos(roll)
    return np.degrees(np.arctan2(by2, bx * np.cos(pitch) + bz2 * np.sin(pitch)))
