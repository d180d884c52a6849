"""The rubric of a student's project."""

from __future__ import annotations

from pathlib import Path

from fcu_emulator.emulator.grading.rubric import PROJECT_RUBRIC, ExerciseTable, Rubric

_USUAL_RUBRIC = "lab3"


def rubric_of(target: str) -> str:
    """Return the rubric in or beside ``target``, by default LAB3's."""
    path = Path(target)
    own = (path if path.is_dir() else path.parent) / PROJECT_RUBRIC
    return str(own) if own.is_file() else _USUAL_RUBRIC


def shown_exercises(rubric: Rubric) -> list[ExerciseTable]:
    """Return exercises with a check that students see."""
    return [one for one in rubric.exercises if any(check.visible == "always" for check in one.check)]
