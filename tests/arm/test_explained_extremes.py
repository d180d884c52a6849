"""Explanations of variables that should keep the largest or smallest value so far."""

from __future__ import annotations

import re
from pathlib import Path
from typing import NamedTuple

import pytest

from fcu_emulator.emulator.explain.states import WrongState
from tests.arm.test_explained_formulas import WITHIN, explained
from tests.support.arm import student_programs
from tests.support.arm.student_programs import FOLDER, Change, Program, build

pytestmark = pytest.mark.skipif(
    not student_programs.is_buildable(), reason="arm-none-eabi-gcc or make is not installed"
)
SOURCE = (FOLDER / "student" / "main.c").read_text()


class Mistake(NamedTuple):
    old: str
    new: str
    step: str
    variable: str

    @property
    def line(self) -> int:
        return SOURCE[: SOURCE.index(self.old)].count("\n") + 1

    def __str__(self) -> str:
        return self.new


MISTAKES = [
    Mistake("mag.AXIS_Z > mag_max", "mag.AXIS_Z > mag_min", "max_z", "mag_max.AXIS_Z"),
    Mistake("mag.AXIS_X > mag_max", "mag.AXIS_X < mag_max", "max_x", "mag_max.AXIS_X"),
    Mistake("mag_max.AXIS_Y = mag.AXIS_Y", "mag_max.AXIS_Y = mag.AXIS_X", "max_y", "mag_max.AXIS_Y"),
    Mistake("mag_min.AXIS_Z = mag.AXIS_Z", "mag_min.AXIS_Y = mag.AXIS_Z", "min_y", "mag_min.AXIS_Y"),
    Mistake("mag_min.AXIS_X = mag.AXIS_X", "mag_min.AXIS_X = 2 * mag.AXIS_X", "min_x", "mag_min.AXIS_X"),
    Mistake("mag_max = {-10000, -10000, -10000}", "mag_max = {0, 0, 0}", "max_y", "mag_max.AXIS_Y"),
    Mistake("mag_min = {10000, 10000, 10000}", "mag_min = {0, 0, 0}", "min_x", "mag_min.AXIS_X"),
]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("extremes")


@pytest.mark.parametrize("optimisation", ["O0", "O2"])
@pytest.mark.parametrize("mistake", MISTAKES, ids=str)
def test_wrong_extreme_is_named_with_its_line(mistake: Mistake, optimisation: str, folder: Path) -> None:
    elf = build(Program("extreme", "", (Change("main.c", mistake.old, mistake.new),)), optimisation, folder)
    first = explained(elf)[0]

    assert isinstance(first.mistake, WrongState)
    assert (first.mistake.step, first.mistake.variable) == (mistake.step, mistake.variable)
    line = re.search(r"main\.c:(\d+)", first.diagnosis.summary)
    assert line is not None
    assert abs(int(line[1]) - mistake.line) <= WITHIN, first.diagnosis.summary
