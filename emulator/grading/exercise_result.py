"""Results of single exercises, with the main causes of their failures, for the page and for programs."""

from __future__ import annotations

from typing import Any, Final

from fcu_emulator.emulator.grading.causes import relevant_causes
from fcu_emulator.emulator.grading.verdict import CheckResult, Verdict
from fcu_emulator.emulator.live.messages import Checked

_MOST_CAUSES: Final = 2
_MOST_DETAILS: Final = 5  # for each cause


def as_checked(exercise: str, verdict: Verdict) -> Checked:
    """Return the result of one exercise of a verdict."""
    checks = [one for one in verdict.of(exercise) if one.max_points > 0]
    points = sum(one.points for one in checks)
    state = "done" if verdict.is_done(exercise) else "begun" if points else "not yet"
    if not any(one.outcome in ("failed", "partial") for one in checks) and state != "done":
        state = "unjudged"
    return Checked(
        exercise,
        state,
        points=round(points, 4),
        max_points=sum(one.max_points for one in checks),
        checks=[_check(one) for one in checks],
        causes=[] if state == "done" else _causes(verdict, exercise),
    )


def _check(check: CheckResult) -> dict[str, str]:
    seen = "; ".join(filter(None, (check.actual, check.printed and f"such as {check.printed}")))
    wrong = check.outcome in ("failed", "partial")
    return {
        "title": check.title,
        "outcome": check.outcome,
        "expected": check.expected,
        "seen": check.unjudged_because or seen,
        "source": check.source,
        "hint": check.hint if wrong else "",
    }


def _causes(verdict: Verdict, exercise: str) -> list[dict[str, Any]]:
    causes = (cause for run in verdict.evidence_of(exercise) for cause in run.causes)
    failed = [one for one in verdict.of(exercise) if one.max_points and one.outcome != "passed"]
    worst_first = relevant_causes(causes, failed)[:_MOST_CAUSES]
    return [{**one.model_dump(), "details": list(one.details[:_MOST_DETAILS])} for one in worst_first]
