"""The exercises beside a live board are judged as in ``fcu check``, in a separate process."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from pathlib import Path

import pytest

from fcu_emulator.emulator.cli.exercises import LabExercises, judged
from fcu_emulator.emulator.errors import InputError
from fcu_emulator.emulator.grading.exercise_result import as_checked
from fcu_emulator.emulator.grading.judge import judge
from fcu_emulator.emulator.grading.rubric import load_rubric
from fcu_emulator.emulator.live.messages import Checked
from fcu_emulator.firmware_model.arm import prebuilt
from tests.support.arm.broken_programs import FOLDER


@pytest.fixture
def exercises() -> Iterator[LabExercises]:
    one = LabExercises()
    yield one
    one.close()


def result(exercises: LabExercises) -> Checked:
    """Return the next result, which the future of the judge announces."""
    assert exercises._running is not None
    exercises._running[1].exception(timeout=120)
    (checked,) = exercises.finished()
    return checked


def test_each_exercise_is_offered_with_its_question(exercises: LabExercises) -> None:
    offered = exercises.offered()
    assert [one["id"] for one in offered] == ["1", "2", "3", "4", "5"]
    assert all(one["title"] and one["question"].endswith("?") for one in offered)


def test_verdict_equals_fcu_check(exercises: LabExercises, tmp_path: Path) -> None:
    program = tmp_path / "mine.elf"
    program.write_bytes(prebuilt("template", "I2C2").read_bytes())
    exercises.start("4", str(program), 3)
    program.unlink()  # as a new build does it
    checked = result(exercises)
    verdict = judge(prebuilt("template", "I2C2"), load_rubric("lab3"), seed=3, exercises=["4"])
    expected = [one.title for one in verdict.checks if one.max_points > 0]
    assert checked == as_checked("4", verdict.for_student())
    assert checked.state == "not yet"
    assert [one["title"] for one in checked.checks] == expected
    assert exercises.finished() == []


def test_crashing_program_is_reported_with_its_cause() -> None:
    checked = as_checked("4", judged(str(FOLDER / "outside_memory.elf"), "lab3", "4", 0))
    assert checked.state == "not yet"
    assert checked.causes[0]["fatal"]
    assert "HAL_TIM_PeriodElapsedCallback(), outside_memory.c:20" in checked.causes[0]["summary"]


def test_submissions_are_judged_one_by_one(exercises: LabExercises) -> None:
    exercises.start("4", "solution", 0)
    with pytest.raises(InputError, match=r"exercise 4\b") as refused:
        exercises.start("1", "solution", 0)
    assert refused.value.kind == "busy"
    with pytest.raises(InputError):
        exercises.start("no such exercise", "solution", 0)


def test_non_firmware_is_error_result(exercises: LabExercises, tmp_path: Path) -> None:
    program = tmp_path / "empty.elf"
    program.write_bytes(b"")
    exercises.start("4", str(program), 0)
    checked = result(exercises)
    assert (checked.state, checked.checks) == ("error", [])
    assert "\n" not in checked.problem
    assert checked.problem


def test_closed_exercises_stop_judging() -> None:
    exercises = LabExercises()
    exercises.start("5", "solution", 0)
    exercises.close()
    assert not [one for one in threading.enumerate() if "_serve" in one.name]
    exercises.close()
