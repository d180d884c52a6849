"""Explanations of wrong numbers in a verdict, by the rubric's formulas."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from fcu_emulator.emulator.analysis.mistakes import without_explained
from fcu_emulator.emulator.chip.diagnosis.report import KEEPS_SAMPLES_AWAY, Diagnosis
from fcu_emulator.emulator.grading.rubric import CheckTable, Rubric
from fcu_emulator.emulator.grading.verdict import CheckResult, DiagnosedCause, RunEvidence
from fcu_emulator.emulator.scenario.expectations import ExpectField

if TYPE_CHECKING:
    from pathlib import Path

    from fcu_emulator.emulator.chip.firmware import Limits
    from fcu_emulator.emulator.chip.image import FirmwareImage
    from fcu_emulator.emulator.explain.explanation import Explanation, ShownNumber


def explained(
    evidence: Sequence[RunEvidence],
    firmware: str | Path | Callable[..., Any],
    rubric: Rubric,
    results: Mapping[str, CheckResult],
    limits: Limits,
) -> list[RunEvidence]:
    """Return the evidence with explanations of wrong numbers before the other causes.

    Only visible checks are explained, and only if the program runs and receives samples.
    """
    try:
        return _explained(evidence, firmware, rubric, results, limits)
    except Exception as error:  # an error in the explanation must not prevent the verdict
        said = f"the wrong numbers cannot be explained: {type(error).__name__}: {error}; please report this"
        cause = DiagnosedCause(kind="formula", summary=said, details=(), fatal=False)
        return [
            *evidence[:-1],
            *(one.model_copy(update={"causes": (*one.causes, cause)}) for one in evidence[-1:]),
        ]


def _explained(
    evidence: Sequence[RunEvidence],
    firmware: str | Path | Callable[..., Any],
    rubric: Rubric,
    results: Mapping[str, CheckResult],
    limits: Limits,
) -> list[RunEvidence]:
    if rubric.explain is None or callable(firmware):
        return list(evidence)
    failed = {
        name
        for name, one in results.items()
        if one.outcome in ("failed", "partial") and one.visibility == "always"
    }
    outputs: dict[str, list[ShownNumber]] = {}
    for one in evidence:
        kinds = {cause.kind for cause in one.causes}
        if one.stopped or kinds & KEEPS_SAMPLES_AWAY or any(cause.fatal for cause in one.causes):
            continue
        outputs[one.run] = [
            output for exercise in one.exercises for output in _outputs(rubric, exercise, one.run, results)
        ]
    wanted = [output for every in outputs.values() for output in every]
    missing, found = _mistakes(firmware, rubric, limits, failed, wanted)
    return [_with_causes(one, missing, found, outputs.get(one.run, ())) for one in evidence]


_MissingCalls = Sequence[tuple[frozenset[str], Diagnosis]]
"""Pairs of failed checks and the diagnosis of a function that the program has but does not call."""


def _mistakes(
    firmware: str | Path,
    rubric: Rubric,
    limits: Limits,
    failed: Collection[str],
    outputs: Collection[ShownNumber],
) -> tuple[_MissingCalls, Sequence[Explanation]]:
    """Return the missing calls that make checks fail, and the wrong formulas of the other outputs."""
    if not failed and not outputs:
        return [], []
    from fcu_emulator.emulator.explain.explanation import explain_numbers
    from fcu_emulator.emulator.explain.probe import probe

    assert rubric.explain is not None
    with probe(firmware, limits) as running:
        if running is None:
            return [], []
        missing = _missing_calls(running.image, rubric, failed) if failed else []
        by_calls = {check for checks, _ in missing for check in checks}
        wanted = [one for one in outputs if one.check not in by_calls]
        return missing, explain_numbers(running, rubric.explain.arithmetic(), wanted) if wanted else []


def _missing_calls(image: FirmwareImage, rubric: Rubric, failed: Collection[str]) -> _MissingCalls:
    from fcu_emulator.emulator.explain.calls import never_called

    assert rubric.explain is not None
    found = []
    for call, one in never_called(image, rubric.explain.calls()):
        wrong = call.checks.intersection(failed)
        if wrong:
            titles = (
                field.title for name, check in _checks(rubric) if name in wrong for field in _numbers(check)
            )
            found.append((wrong, replace(one, data={**one.data, "fields": ", ".join(dict.fromkeys(titles))})))
    return found


def _checks(rubric: Rubric) -> Iterator[tuple[str, CheckTable]]:
    """Yield the checks that a student sees, with their names such as ``3.pitch``."""
    for exercise in rubric.exercises:
        for check in exercise.check:
            if check.visible == "always":
                yield f"{exercise.id}.{check.id}", check


def _numbers(check: CheckTable) -> list[ExpectField]:
    return [one for one in check.expect if isinstance(one, ExpectField)]


def _with_causes(
    evidence: RunEvidence,
    missing: _MissingCalls,
    found: Sequence[Explanation],
    outputs: Sequence[ShownNumber],
) -> RunEvidence:
    """Return the evidence with missing calls and wrong formulas first.

    A missing call or a formula of any run replaces the causes that only compare the same numbers with
    the truth.
    """
    from fcu_emulator.emulator.explain.explanation import first_of

    exercises = tuple(f"{one}." for one in evidence.exercises)
    calls = [one for names, one in missing if any(name.startswith(exercises) for name in names)]
    checks = {output.check for output in outputs}
    formulas = first_of([one for one in found if one.check in checks])
    explained = [*(one for _, one in missing), *(one.diagnosis for one in found)]
    others = without_explained(evidence.causes, explained)
    return evidence.model_copy(update={"causes": (*map(cause_of, (*calls, *formulas)), *others)})


def _outputs(
    rubric: Rubric, exercise: str, run: str, results: Mapping[str, CheckResult]
) -> Iterator[ShownNumber]:
    """Yield the wrong numbers of a run in checks that a student sees."""
    from fcu_emulator.emulator.explain.explanation import ShownNumber

    assert rubric.explain is not None
    table = rubric.exercise(exercise)
    for check in table.check:
        name = f"{exercise}.{check.id}"
        result = results.get(name)
        if result is None or rubric.run_of(table, check) != run or check.visible != "always":
            continue
        if result.outcome not in ("failed", "partial") or result.finding != "wrong value":
            continue
        for step, number in zip(rubric.explain.shows.get(name, ()), _numbers(check), strict=False):
            yield ShownNumber(name, step, number.title, number.number_format())


def explained_run(
    firmware: str | Path, rubric: Rubric, limits: Limits, wrong: Sequence[ExpectField] | None = None
) -> list[Diagnosis]:
    """Return the missing calls and the wrong formula that cause wrong numbers in a run, or [].

    ``wrong``: the numbers to explain, if they are in visible checks of the rubric; with None, all
    numbers of visible checks are explained.
    """
    if rubric.explain is None:
        return []
    from fcu_emulator.emulator.explain.explanation import ShownNumber, first_of

    numbers = None if wrong is None else {one.title for one in wrong}
    outputs: dict[str, ShownNumber] = {}
    failed = set()
    for name, check in _checks(rubric):
        fields = _numbers(check)
        if numbers is not None and any(one.title in numbers for one in fields):
            failed.add(name)
        for step, field in zip(rubric.explain.shows.get(name, ()), fields, strict=False):
            if numbers is None or field.title in numbers:
                outputs.setdefault(step, ShownNumber(name, step, field.title, field.number_format()))
    missing, found = _mistakes(firmware, rubric, limits, failed, outputs.values())
    return [*(one for _, one in missing), *first_of(found)]


def cause_of(one: Diagnosis) -> DiagnosedCause:
    """Return a diagnosis in the form that verdicts use."""
    return DiagnosedCause(
        kind=one.kind, summary=one.summary, details=one.details, fatal=one.fatal, data=dict(one.data)
    )
