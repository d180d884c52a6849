"""Prerequisites of checks: a check with ``requires`` earns points only if all required checks have
passed.

::

    [[exercise.check]]
    id = "quiet"
    requires = ["alarm", "2"]   # a check of this exercise; all checks of exercise 2 with points

Decision: a rubric names the required checks, because a grade must not depend on the template's
results.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping, Sequence

from fcu_emulator.emulator.grading.verdict import CheckResult, requires_text
from fcu_emulator.emulator.text import choices, shown

PREREQUISITE = "prerequisite"
"""Finding of a check if one of its required checks has not passed."""


class PrerequisiteError(ValueError):
    """Entry ``number`` in ``requires`` of ``check`` names an unknown check, or makes the requirements circular."""

    def __init__(self, check: str, number: int, problem: str) -> None:
        super().__init__(problem)
        self.check = check
        self.number = number


class Prerequisites:
    """The required checks, keyed by full name ("1.alarm"). The name of an exercise means its ``counted`` checks."""

    def __init__(self, requires: Mapping[str, Sequence[str]], counted: Collection[str]) -> None:
        self._requires = requires
        self._counted = counted
        self._required = {check: self._resolved(check) for check in requires}
        for check in requires:
            self._refuse_circle(check)

    def needed(self, checks: Iterable[str]) -> set[str]:
        """Return these checks and all checks that they require."""
        found: set[str] = set()
        waiting = list(checks)
        while waiting:
            one = waiting.pop()
            if one not in found:
                found.add(one)
                waiting.extend(self._required[one])
        return found

    def applied(self, results: Mapping[str, CheckResult], hint: Mapping[str, str]) -> dict[str, CheckResult]:
        """Return the results after the prerequisites.

        A check fails if a required check fails, and is unjudged if a required check is unjudged.
        """
        done: dict[str, CheckResult] = {}

        def result_of(check: str) -> CheckResult:
            if check not in done:
                required = [result_of(one) for one in self._required[check]]
                done[check] = _withheld(results[check], required, hint.get(check, ""))
            return done[check]

        return {check: result_of(check) for check in results}

    def _resolved(self, check: str) -> tuple[str, ...]:
        found: list[str] = []
        for number, name in enumerate(self._requires[check]):
            named = self._named(name, check.partition(".")[0])
            if not named:
                problem = f"must be {choices(self._names(check))}, not {shown(name)}"
                raise PrerequisiteError(check, number, problem)
            found += named
        return tuple(dict.fromkeys(found))

    def _named(self, name: str, exercise: str) -> list[str]:
        one = next((full for full in (name, f"{exercise}.{name}") if full in self._requires), None)
        if one is not None:
            return [one]
        return [check for check in self._counted if check.partition(".")[0] == name]

    def _names(self, check: str) -> list[str]:
        exercises = dict.fromkeys(one.partition(".")[0] for one in self._counted)
        others = (one for one in exercises if one != check.partition(".")[0])
        return [*(one for one in self._requires if one != check), *others]

    def _refuse_circle(self, check: str) -> None:
        for number, name in enumerate(self._requires[check]):
            if check in self.needed(self._named(name, check.partition(".")[0])):
                problem = f"must not be {shown(name)}, because that check requires {check}"
                raise PrerequisiteError(check, number, problem)


def _withheld(result: CheckResult, required: Sequence[CheckResult], hint: str) -> CheckResult:
    if result.outcome == "failed":
        return result
    missing = [one for one in required if one.outcome in ("failed", "partial")]
    if missing:
        changed = {
            "outcome": "failed",
            "points": 0.0,
            "expected": "",
            "actual": requires_text((one.check, one.title) for one in missing),
            "printed": "",
            "finding": PREREQUISITE,
            "fault": "",
            "hint": hint,
            "unjudged_because": "",
            "requires_unmet": tuple(one.check for one in missing),
        }
        return result.model_copy(update=changed)
    unjudged = [one for one in required if one.outcome == "unjudged"]
    if unjudged and result.outcome != "unjudged":
        because = f"it requires {unjudged[0].check}: {unjudged[0].unjudged_because}"
        changed = {"outcome": "unjudged", "points": 0.0, "unjudged_because": because}
        changed |= {"expected": "", "actual": "", "printed": "", "finding": "", "fault": "", "hint": ""}
        return result.model_copy(update=changed)
    return result
