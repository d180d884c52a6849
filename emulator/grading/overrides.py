"""Overrides of the teacher: points that replace the judged points, with a comment.

The overrides are in a CSV file with the columns ``id``, ``what`` (``total``, ``late penalty``, an exercise ``2``, a
check ``2.pitch``), ``points`` and ``comment``.
"""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Mapping
from pathlib import Path

from fcu_emulator.emulator.errors import InputError
from fcu_emulator.emulator.grading.results import LATE_PENALTY, TOTAL, Graded, Override
from fcu_emulator.emulator.grading.roster import delimiter, read_csv
from fcu_emulator.emulator.grading.rubric import Rubric
from fcu_emulator.emulator.grading.verdict import CheckResult
from fcu_emulator.emulator.text import choices, one_line

_COLUMNS = ("id", "what", "points", "comment")


def load_overrides(path: Path, rubric: Rubric) -> dict[str, tuple[Override, ...]]:
    """Return the overrides, keyed by the student's id in lower case. Raises InputError, which names file and line."""
    text, _ = read_csv(path)
    lines = csv.DictReader(io.StringIO(text, newline=""), delimiter=delimiter(text), strict=True)
    found: dict[str, tuple[Override, ...]] = {}
    try:
        lines.fieldnames = [name.strip().casefold() for name in lines.fieldnames or ()]
        missing = [name for name in _COLUMNS[:3] if name not in lines.fieldnames]
        if missing:
            raise InputError(
                f"{path}:1: must have the columns {', '.join(_COLUMNS)}; {missing[0]} is missing"
            )
        for row in lines:
            where = f"{path}:{lines.line_num}"
            student, override = _override(where, row, rubric)
            earlier = found.get(student, ())
            if any(one.what == override.what for one in earlier):
                raise InputError(
                    f"{where}: {override.what} of {one_line(student, 40)} must be given once, not twice"
                )
            found[student] = (*earlier, override)
    except csv.Error as error:
        raise InputError(f"{path}:{lines.line_num}: must be CSV: {one_line(str(error), 80)}") from error
    return found


def _override(where: str, row: Mapping[str, str | None], rubric: Rubric) -> tuple[str, Override]:
    student, what, points, comment = ((row.get(name) or "").strip() for name in _COLUMNS)
    known = [TOTAL, LATE_PENALTY]
    for exercise in rubric.exercises:
        known += [exercise.id, *(f"{exercise.id}.{check.id}" for check in exercise.check)]
    if not student:
        raise InputError(f"{where}: id must be a student's id, not empty")
    if what not in known:
        raise InputError(f"{where}: 'what' must be {choices(known)}, not {one_line(what, 40)!r}")
    try:
        value = float(points)
    except ValueError:
        value = math.nan
    if not 0 <= value < math.inf:
        raise InputError(f"{where}: points must be a number of at least 0, not {one_line(points, 40)!r}")
    return student.casefold(), Override(what=what, points=value, comment=one_line(comment, 1000))


def with_overrides(graded: Graded, overrides: tuple[Override, ...]) -> Graded:
    """Return the result after the overrides, which also change its verdict."""
    points = {one.what: one.points for one in overrides}
    verdict = graded.verdict
    if verdict is not None:
        checks = tuple(_given(check, points.get(check.check)) for check in verdict.checks)
        verdict = verdict.model_copy(update={"checks": checks})
    changed: dict[str, object] = {"overrides": overrides, "verdict": verdict}
    changed["late_penalty"] = points.get(LATE_PENALTY, graded.late_penalty)
    # with the overrides, all points are known
    if graded.status == "partly" and verdict is not None and verdict.counts:
        changed |= {"status": "judged", "reason": ""}
    return graded.model_copy(update=changed)


def _given(check: CheckResult, points: float | None) -> CheckResult:
    if points is None:
        return check
    outcome = "passed" if points >= check.max_points else "partial" if points else "failed"
    return check.model_copy(update={"points": points, "outcome": outcome, "unjudged_because": ""})
