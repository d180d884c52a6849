"""Reports for programs: CSV for learning platforms, JUnit for CI, Gradescope's ``results.json``.

Decision: a submission without a grade never gets a zero. There is one exception: on Gradescope a
rejected submission gets 0 points, because the student can submit again.
"""

from __future__ import annotations

from typing import Any
from xml.etree import ElementTree as ET

from fcu_emulator.emulator.errors import NotJudgedError
from fcu_emulator.emulator.grading.results import Graded, GradedClass
from fcu_emulator.emulator.grading.verdict import CheckResult, Verdict
from fcu_emulator.emulator.text import csv_text, visible

_ON_ROSTER = {True: "yes", False: "no", None: ""}
_VISIBILITY = {"always": "visible", "after_due_date": "after_due_date", "never": "hidden"}

# -- CSV ----------------------------------------------------------------------------------------------------


def grades_csv(graded: GradedClass) -> str:
    """Return CSV text with a line for each student."""
    exercises = [exercise.exercise for exercise in graded.exercises]
    columns = ["id", "name", "email", "points", "max_points", *(f"exercise_{name}" for name in exercises)]
    handed_in = [
        "on_roster",
        "handed_in",
        "files",
        "submitted",
        "late_by",
        "late_penalty",
        "copies",
        "comment",
    ]
    rows = [[*columns, "status", "reason", *handed_in]]
    for one in graded.submissions:
        row = [one.id, one.name, one.email, _points(one.points), _points(graded.max_points)]
        row += [_points(one.points_of(name)) for name in exercises]
        row += [one.status, one.reason, _ON_ROSTER[one.on_roster], str(one.handed_in)]
        comments = "; ".join(filter(None, (override.comment for override in one.overrides)))
        late = [one.submitted, one.late_by, _points(one.lost_by_lateness) if one.late else ""]
        rows.append([*row, ", ".join(one.files), *late, one.copies, comments])
    return csv_text(rows)


def _points(value: float | None) -> str:
    return "" if value is None else f"{value:g}"


# -- JUnit --------------------------------------------------------------------------------------------------


def junit_xml(graded: GradedClass) -> str:
    """Return a test suite for each student, with a test case for each check."""
    root = ET.Element("testsuites", name=graded.rubric)
    for one in graded.submissions:
        checks = one.verdict.checks if one.verdict else ()
        failed = sum(check.outcome in ("failed", "partial") for check in checks)
        unjudged = sum(check.outcome == "unjudged" and check.max_points > 0 for check in checks)
        counts = {"tests": len(checks) or 1, "failures": failed, "errors": unjudged if checks else 1}
        skipped = sum(check.outcome == "unjudged" and not check.max_points for check in checks)
        suite = ET.SubElement(root, "testsuite", name=visible(one.shown_name), skipped=str(skipped))
        suite.attrib |= {name: str(count) for name, count in counts.items()}
        for check in checks:
            _case(suite, graded.rubric, check)
        if not checks:
            case = ET.SubElement(suite, "testcase", classname=graded.rubric, name="submission", time="0")
            ET.SubElement(case, "error", message=visible(one.reason), type=one.status)
    ET.indent(root)
    return '<?xml version="1.0" encoding="utf-8"?>\n' + ET.tostring(root, encoding="unicode") + "\n"


def verdict_junit_xml(verdict: Verdict) -> str:
    """Return a test suite for each exercise of a verdict, with a test case for each check."""
    root = ET.Element("testsuites", name=visible(verdict.rubric_title))
    for exercise in verdict.exercises:
        checks = verdict.of(exercise.exercise)
        if not checks:
            continue
        suite = ET.SubElement(root, "testsuite", name=visible(f"{exercise.exercise} {exercise.title}"))
        counts = {
            "tests": len(checks),
            "failures": sum(check.outcome in ("failed", "partial") for check in checks),
            "errors": sum(check.outcome == "unjudged" and check.max_points > 0 for check in checks),
            "skipped": sum(check.outcome == "unjudged" and not check.max_points for check in checks),
        }
        suite.attrib |= {name: str(count) for name, count in counts.items()}
        for check in checks:
            _case(suite, verdict.rubric, check)
    ET.indent(root)
    return '<?xml version="1.0" encoding="utf-8"?>\n' + ET.tostring(root, encoding="unicode") + "\n"


def _case(suite: ET.Element, rubric: str, check: CheckResult) -> None:
    name = visible(f"{check.check} {check.title}")
    case = ET.SubElement(suite, "testcase", classname=f"{rubric}.{check.exercise}", name=name, time="0")
    if check.outcome == "unjudged":
        kind = "error" if check.max_points else "skipped"
        ET.SubElement(case, kind, message=visible(check.unjudged_because), type="unjudged")
    elif check.outcome != "passed":
        said = f"{check.points:g} of {check.max_points:g} points"
        failure = ET.SubElement(case, "failure", message=said, type=check.outcome)
        failure.text = visible(_sentences(check), lines=True)


# -- Gradescope ---------------------------------------------------------------------------------------------


def gradescope_results(one: Graded) -> dict[str, Any]:
    """Return ``results.json`` of one submission. Gradescope hides tests by their visibility.

    Source: https://gradescope-autograders.readthedocs.io/en/latest/specs/. Raises NotJudgedError if
    the submission has no grade.
    """
    if one.status in ("unjudged", "partly", "missing"):
        raise NotJudgedError(f"{one.shown_name}: {one.reason}; run the autograder again")
    results: dict[str, Any] = {
        "stdout_visibility": "hidden",
        "output_format": "text",
        "test_output_format": "text",
        "test_name_format": "text",
        "extra_data": {"seed": one.seed, "status": one.status},
    }
    if one.verdict is None:
        said = f"This submission was rejected: it {one.reason}."
        log = f"\n\n{one.build_log}" if one.build_log else ""
        return {**results, "score": 0.0, "output": visible(said + log, lines=True), "tests": []}
    verdict = one.verdict
    warnings = f"Compiler warnings:\n{one.build_log}" if one.build_log else ""
    results["extra_data"] |= {"rubric_digest": verdict.rubric_digest, "version": verdict.version}
    tests = [
        _gradescope_test(check, shown)
        for check, shown in zip(verdict.checks, verdict.allowed(), strict=True)
        if check.outcome != "unjudged"  # gives no points
    ]
    again = f"To repeat this on your machine: {one.again}" if one.again else ""
    open_ = verdict.for_student()
    total = f"{open_.points:g} of {open_.max_points:g} points"
    total += " in the checks that are shown before the due date." if open_.hidden_checks else "."
    late = f"Handed in late by {one.late_words}." if one.late_penalty else ""
    if one.late_penalty and one.points is not None:
        results["score"] = one.points
    said = "\n".join(filter(None, (total, late, again, warnings)))
    return {**results, "output": visible(said.strip(), lines=True), "tests": tests}


def _gradescope_test(check: CheckResult, shown: CheckResult) -> dict[str, Any]:
    return {
        "name": visible(shown.title),
        "number": check.check,
        "score": check.points,
        "max_score": check.max_points,
        "status": "passed" if check.outcome == "passed" else "failed",
        "output": visible(_sentences(shown), lines=True),
        "visibility": _VISIBILITY[check.visibility],
    }


def _sentences(check: CheckResult) -> str:
    if check.outcome == "passed":
        return ""
    printed = check.printed if check.printed != check.actual else ""
    parts = (
        ("expected", check.expected),
        ("seen", check.actual),
        ("such as", printed),
        ("line", check.source),
        ("hint", check.hint),
    )
    return "\n".join(f"{name}: {text}" for name, text in parts if text)
