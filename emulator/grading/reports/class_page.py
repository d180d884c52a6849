"""The class's report, for the teacher."""

from __future__ import annotations

import statistics
from collections.abc import Iterator
from dataclasses import dataclass

from fcu_emulator.emulator.grading.reports.markup import Html, element, page
from fcu_emulator.emulator.grading.reports.plots import histogram, share_bar
from fcu_emulator.emulator.grading.reports.student_page import number
from fcu_emulator.emulator.grading.reports.style import STYLE
from fcu_emulator.emulator.grading.results import Graded, GradedClass

_MOST_HARD = 12
_MOST_FILES = 4
_STATUS = {
    "rejected": "rejected",
    "missing": "missing",
    "unjudged": "not judged: grade again",
    "partly": "some checks not judged: grade again",
}


_COUNTED = {
    "rejected": "rejected",
    "partly": "partly judged",
    "unjudged": "not judged",
    "missing": "not submitted",
}


@dataclass(frozen=True)
class HardCheck:
    """A check. ``share``: the mean share of its points that students earn."""

    check: str
    title: str
    share: float
    passed: int
    judged: int


def hardest_checks(graded: GradedClass) -> list[HardCheck]:
    """Return checks with points, the hardest check first."""
    found: dict[str, list[tuple[str, float, bool]]] = {}
    for one in graded.submissions:
        for check in one.verdict.checks if one.verdict else ():
            if check.max_points and check.outcome != "unjudged":
                result = check.title, check.points / check.max_points, check.outcome == "passed"
                found.setdefault(check.check, []).append(result)
    hard = [
        HardCheck(
            name,
            results[0][0],
            statistics.fmean(share for _, share, _ in results),
            sum(passed for *_, passed in results),
            len(results),
        )
        for name, results in found.items()
    ]
    return sorted(hard, key=lambda one: one.share)


def class_page(graded: GradedClass) -> str:
    """Return the HTML page of a class."""
    return page(f"{graded.rubric_title}: the class", STYLE, *_body(graded))


def summary(graded: GradedClass) -> list[str]:
    """Summarise the class in a few lines."""
    points = _points(graded)
    found = [f"{len(points)} judged"]
    without = [one for one in graded.submissions if one.points is None]
    for status, words in _COUNTED.items():
        if count := sum(one.status == status for one in without):
            found.append(f"{count} {words}")
    lines = [f"{_counted(len(graded.submissions), 'student')}: {', '.join(found)}"]
    if graded.handed_in:
        handed_in = _counted(graded.handed_in, "file or folder was", "files and folders were")
        lines.append(f"{handed_in} handed in; each is graded or listed with the reason")
    if points:
        middle = f"mean {statistics.fmean(points):.1f}, median {statistics.median(points):.1f}"
        full = sum(value >= graded.max_points for value in points)
        lines.append(
            f"of {number(graded.max_points)} points: {middle}; {_counted(full, 'student')} with full points"
        )
    return lines


def _counted(count: int, one: str, more: str = "") -> str:
    return f"{count} {one if count == 1 else more or one + 's'}"


def _points(graded: GradedClass) -> list[float]:
    return [one.points for one in graded.submissions if one.points is not None]


def _body(graded: GradedClass) -> Iterator[Html]:
    yield element("h1", graded.rubric_title)
    yield from (element("p", line) for line in summary(graded))
    points = _points(graded)
    if points:
        yield element("h2", "Distribution of points")
        yield histogram(points, graded.max_points)
    yield from _not_judged(graded.not_judged)
    yield from _listed(
        "Not on the roster", [(one, _files(one)) for one in graded.submissions if one.on_roster is False]
    )
    yield from _listed("Late", [(one, _late(one)) for one in graded.submissions if one.late])
    yield from _listed("Identical", [(one, one.copies) for one in graded.submissions if one.copies])
    yield from _hardest(hardest_checks(graded))
    yield element("h2", "All students, by exercise")
    yield element("div", _all_students(graded), class_="scroll")
    yield element("p", f"Rubric {graded.rubric}, {graded.version}.", class_="quiet")


def _not_judged(ones: list[Graded]) -> Iterator[Html]:
    if not ones:
        return
    yield element("h2", f"Not judged: {len(ones)}")
    yield element("p", "Their grade is empty, not zero.", class_="quiet")
    rows = (
        element(
            "tr",
            element("td", _link(one), class_="who"),
            element("td", _STATUS[one.status], class_="what"),
            element("td", one.reason),
            element("td", "" if one.status == "missing" else _files(one)),
        )
        for one in ones
    )
    head = element("tr", *(element("th", name) for name in ("who", "what", "why", "files")))
    yield element("div", element("table", head, *rows), class_="scroll")


def _listed(title: str, rows: list[tuple[Graded, str]]) -> Iterator[Html]:
    if rows:
        yield element("h2", f"{title}: {len(rows)}")
        cells = (
            element("tr", element("td", _link(one), class_="who"), element("td", words))
            for one, words in rows
        )
        yield element("div", element("table", *cells), class_="scroll")


def _late(one: Graded) -> str:
    """Describe the delay. Add the deducted points if they are fewer than the penalty."""
    if one.points is not None and one.lost_by_lateness < one.late_penalty:
        return f"{one.late_words}, of which {number(one.lost_by_lateness)} deducted"
    return one.late_words


def _files(one: Graded) -> str:
    names = list(one.files[:_MOST_FILES])
    if not names:  # anonymous
        return _counted(one.handed_in, "file or folder", "files and folders")
    more = len(one.files) - len(names)
    return ", ".join(names) + (f" and {more} more" if more else "")


def _hardest(checks: list[HardCheck]) -> Iterator[Html]:
    missed = [one for one in checks if one.passed < one.judged][:_MOST_HARD]
    if not missed:
        return
    yield element("h2", "Checks with the fewest points")
    rows = (
        element(
            "tr",
            element("td", one.check),
            element("td", one.title),
            element("td", share_bar(one.share)),
            element("td", f"{one.passed} of {one.judged}", class_="number"),
        )
        for one in missed
    )
    head = [element("th", name) for name in ("check", "what", "share of its points")]
    yield element("table", element("tr", *head, element("th", "passed by", class_="number")), *rows)


def _all_students(graded: GradedClass) -> Html:
    names = [exercise.exercise for exercise in graded.exercises]
    head = [element("th", "who")]
    head += [
        element("th", name, class_="number", title=one.title)
        for name, one in zip(names, graded.exercises, strict=True)
    ]
    head.append(element("th", "points", class_="number"))
    rows = []
    for one in graded.submissions:
        cells = [element("td", _link(one), " (not on the roster)" if one.on_roster is False else "")]
        cells += [element("td", _of_exercise(one, name), class_="number") for name in names]
        total = number(one.points) if one.points is not None else "not judged"
        rows.append(element("tr", *cells, element("td", total, class_="number")))
    return element("table", element("tr", *head), *rows)


def _of_exercise(one: Graded, exercise: str) -> str:
    points = one.points_of(exercise)
    return "–" if points is None else number(points)  # noqa: RUF001


def _link(one: Graded) -> Html:
    return element("a", one.shown_name, href=f"students/{one.report}.html")
