"""Correct programs that do the lab in other ways: they get every point and no explanation."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from fcu_emulator.emulator.grading.judge import judge
from fcu_emulator.emulator.grading.rubric import load_rubric
from tests.support.arm import student_programs
from tests.support.arm.student_programs import build

VARIANTS = student_programs.programs("variants.toml") | student_programs.programs("formula_variants.toml")
OPTIMISATIONS = ("O0", "O1", "O2", "O3", "Os")
ALL = bool(os.environ.get("FCU_ALL_STUDENTS"))
CASES = [(name, OPTIMISATIONS[number % len(OPTIMISATIONS)]) for number, name in enumerate(VARIANTS)]
LINK_TIME = [("student", "O2 -flto"), ("volatile_everything", "Os -flto")]
"""Programs that are also optimised at link time."""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("variants")


@pytest.mark.skipif(not student_programs.is_buildable(), reason="arm-none-eabi-gcc or make is not installed")
@pytest.mark.parametrize(
    ("name", "optimisation"), [*CASES, *LINK_TIME] if ALL else [*CASES[::9], *LINK_TIME[:1]]
)
def test_correct_program_gets_all_points_and_no_finding(name: str, optimisation: str, folder: Path) -> None:
    verdict = judge(str(build(VARIANTS[name], optimisation, folder)), load_rubric("lab3"), seed=1)

    assert {one.check: one.actual for one in verdict.checks if one.points < one.max_points} == {}
    assert [cause.summary for run in verdict.evidence for cause in run.causes] == []


def test_there_are_forty_variants() -> None:
    assert len(VARIANTS) >= 40
