"""The exercises of a rubric that students see."""

from __future__ import annotations

from fcu_emulator.emulator.grading.rubric import ExerciseTable, Rubric


def shown_exercises(rubric: Rubric) -> list[ExerciseTable]:
    """Return exercises with a check that students see."""
    return [one for one in rubric.exercises if any(check.visible == "always" for check in one.check)]
