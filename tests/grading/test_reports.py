"""Reports do not execute text of submissions, and a submission that was not judged does not get a zero."""

from __future__ import annotations

import csv
import io
import json
import re
from html.parser import HTMLParser
from pathlib import Path
from typing import Any
from xml.etree import ElementTree as ET

import pytest
from hypothesis import given
from hypothesis import strategies as st

from fcu_emulator.emulator.errors import NotJudgedError
from fcu_emulator.emulator.grading.reports.class_page import class_page, hardest_checks, summary
from fcu_emulator.emulator.grading.reports.machine import grades_csv, gradescope_results, junit_xml
from fcu_emulator.emulator.grading.reports.markup import element, page
from fcu_emulator.emulator.grading.reports.plots import histogram, series_plot
from fcu_emulator.emulator.grading.reports.student_page import student_page
from fcu_emulator.emulator.grading.reports.writer import Reports
from fcu_emulator.emulator.grading.results import Graded, GradedClass, pseudonym, report_name
from fcu_emulator.emulator.grading.roster import Student
from fcu_emulator.emulator.grading.rubric import load_rubric
from fcu_emulator.emulator.grading.verdict import (
    CheckResult,
    DiagnosedCause,
    ExerciseTitle,
    RunEvidence,
    Series,
    Verdict,
)
from fcu_emulator.emulator.text import one_line, visible
from tests.support.words import Words

EVIL = "<script>alert(1)</script>\"'><img src=x onerror=alert(1)>\x1b[31m\x00\u202e]]>&amp;"


def check(name: str, **changed: Any) -> CheckResult:
    usual = {"check": name, "exercise": name[0], "title": f"check {name}", "points": 1, "max_points": 2}
    return CheckResult(
        **{**usual, "outcome": "partial", "expected": "a", "actual": "b", "hint": "c", **changed}
    )


def run(**changed: Any) -> RunEvidence:
    usual = {"run": "r", "question": "Why?", "exercises": ("1",), "duration_s": 2.0, "terminal": "ACC"}
    return RunEvidence(**{**usual, **changed})


def verdict(*checks: CheckResult, evidence: tuple[RunEvidence, ...] = ()) -> Verdict:
    return Verdict(
        rubric="lab",
        rubric_title="Lab",
        rubric_digest="d",
        firmware_digest="f",
        seed=1,
        version="0",
        exercises=tuple(
            ExerciseTitle(exercise=one, title="T") for one in dict.fromkeys(c.exercise for c in checks)
        ),
        checks=checks,
        evidence=evidence,
    )


def graded(who: str = "ada", **changed: Any) -> Graded:
    return Graded(**{"id": who, "status": "judged", "report": report_name(who), **changed})


def whole(*submissions: Graded) -> GradedClass:
    return GradedClass(
        rubric="lab",
        rubric_title="Lab",
        rubric_digest="d",
        version="0",
        max_points=2,
        exercises=(ExerciseTitle(exercise="1", title="T"),),
        submissions=submissions,
    )


class Page(HTMLParser):
    """Tags and attributes of a page, as a browser finds them."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.tags: list[tuple[str, dict[str, str | None]]] = []
        self.text = ""
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append((tag, dict(attrs)))

    def handle_data(self, data: str) -> None:
        self.text += data


HARMLESS = {
    *(
        "html",
        "head",
        "meta",
        "title",
        "style",
        "body",
        "h1",
        "h2",
        "h3",
        "p",
        "a",
        "div",
        "span",
        "dl",
        "dt",
        "dd",
    ),
    *("table", "tr", "th", "td", "details", "summary", "pre", "figure", "figcaption"),
    *("svg", "line", "circle", "path", "rect", "polyline", "text"),
}


def assert_harmless(text: str) -> Page:
    found = Page(text)
    assert {tag for tag, _ in found.tags} <= HARMLESS
    for tag, attributes in found.tags:
        assert not [name for name in attributes if name.startswith("on") or name in ("style", "src")]
        if "href" in attributes:
            assert re.fullmatch(r"(students/)?[\w.#-]+", attributes["href"] or "")
        if tag == "meta" and attributes.get("http-equiv"):
            assert (attributes["content"] or "").startswith("default-src 'none'; style-src 'sha256-")
    assert all(sign.isprintable() or sign == "\n" for sign in text)
    assert text.index("Content-Security-Policy") < text.index("<title>")
    return found


def evil() -> Graded:
    causes = (DiagnosedCause(kind="x", summary=EVIL, details=(EVIL,)),)
    series = (Series(name=EVIL, unit=EVIL, t_s=(1.0,), printed=(2.0,), truth=(2.0,)),)
    evidence = run(question=EVIL, terminal=EVIL, causes=causes, series=series, stopped=EVIL, replay=EVIL)
    bad = check("1.a", title=EVIL, expected=EVIL, actual=EVIL, hint=EVIL)
    return graded(
        EVIL,
        name=EVIL,
        email=EVIL,
        reason=EVIL,
        firmware=EVIL,
        build_log=EVIL,
        report=report_name(EVIL),
        verdict=verdict(bad, evidence=(evidence,)),
    )


# -- nothing is obeyed --------------------------------------------------------------------------------------


def test_student_page_escapes_foreign_text() -> None:
    found = assert_harmless(student_page(evil(), EVIL))

    assert found.text.count("<script>alert(1)</script>") > 10
    assert "\\x1b[31m\\x00\\u202e" in found.text


def test_class_page_escapes_foreign_text() -> None:
    found = assert_harmless(class_page(whole(evil(), evil().model_copy(update={"status": "rejected"}))))

    assert "<script>alert(1)</script>" in found.text


@given(st.text())
def test_html_escapes_any_text(text: str) -> None:
    found = Page(page(text, "p{}", element("p", text, title=text)))

    assert [tag for tag, _ in found.tags] == [
        "html",
        "head",
        "meta",
        "meta",
        "meta",
        "meta",
        "title",
        "style",
        "body",
        "p",
    ]
    assert found.tags[-1][1] == {"title": visible(text, lines=True)}


@given(st.text())
def test_visible_text_has_no_control_characters(text: str) -> None:
    assert visible(text).isprintable()
    assert one_line(text).isprintable()
    assert all(line.isprintable() or "\t" in line for line in visible(text, lines=True).split("\n"))
    if text.isprintable():
        assert visible(text) == text


def test_junit_xml_agrees_with_grades() -> None:
    root = ET.fromstring(junit_xml(whole(evil(), graded("bob", status="rejected", reason=EVIL))))
    failures = [one.get("type") for one in root.iter("failure")]
    errors = [one.get("message") for one in root.iter("error")]

    assert failures == ["partial"]
    assert errors == [visible(EVIL)]
    assert [suite.get("failures") for suite in root] == ["1", "0"]


@pytest.mark.parametrize("name", ["=1+1", "+1", "-1", "@SUM(A1)", "\t=1", "=cmd|' /C calc'!A0"])
def test_spreadsheet_cells_are_not_formulas(name: str) -> None:
    rows = list(csv.DictReader(io.StringIO(grades_csv(whole(graded("7", name=name))))))

    assert not rows[0]["name"].startswith(("=", "+", "-", "@", "\t"))
    assert visible(name) in rows[0]["name"]


@pytest.mark.parametrize("name", ["a;=1+1", 'a; "=1+1', "a;\u00a0@SUM(A1)", 'a;""+1', "a;;-1;=2"])
def test_semicolon_spreadsheet_cells_are_not_formulas(name: str) -> None:
    """A spreadsheet uses the separator of the system, in half of Europe a semicolon, and not the file's separator."""
    text = grades_csv(whole(graded("7", name=name)))

    for cell in text.replace('"', "").split(";"):
        assert not cell.strip().startswith(("=", "+", "-", "@"))


@pytest.mark.parametrize(
    "student", ["../../x", "a/b", "CON", "nul.txt", "a\nb", "", ".", "x" * 500, "Ada", "ada", "\udcff"]
)
def test_report_name_is_valid_on_every_system(student: str) -> None:
    assert re.fullmatch(r"[A-Za-z0-9_-]{1,80}", report_name(student))
    assert report_name(student).lower() not in ("con", "nul", "aux", "prn")


@given(st.lists(st.text(max_size=8), unique=True, max_size=20))
def test_report_names_are_unique_ignoring_case(students: list[str]) -> None:
    assert len({report_name(one).casefold() for one in students}) == len(students)


# -- who is not judged gets no zero -------------------------------------------------------------------------


def test_only_judged_submissions_have_points(words: Words) -> None:
    full = verdict(check("1.a", points=2, outcome="passed"))
    half = verdict(check("1.a"), check("1.b", points=0, outcome="unjudged", unjudged_because="no time"))
    found = whole(
        graded("ada", verdict=full),
        graded("bob", status="partly", reason="no time", verdict=half),
        graded("eve", status="rejected", reason="does not compile"),
        graded("moe", status="unjudged", reason="the worker died"),
        graded("zoe", status="missing", reason="nothing came"),
    )
    rows = list(csv.DictReader(io.StringIO(grades_csv(found))))

    assert [row["points"] for row in rows] == ["2", "", "", "", ""]
    assert [row["exercise_1"] for row in rows] == ["2", "", "", "", ""]
    words("grade", "\n".join(summary(found)))
    text = Page(class_page(found)).text
    assert "Not judged: 4" in text
    for reason in ("no time", "does not compile", "the worker died", "nothing came"):
        assert reason in text
    assert [one.attrib["errors"] for one in ET.fromstring(junit_xml(found))] == ["0", "1", "1", "1", "1"]
    assert GradedClass.from_json(found.to_json()) == found
    assert json.loads(found.to_json())["schema"] == 1


@pytest.mark.parametrize("reason", ["does not compile", "lab3.elf: is empty", "the archive is damaged"])
def test_rejection_reason_is_on_student_page(reason: str) -> None:
    page = Page(student_page(graded(status="rejected", reason=reason), "Lab"))
    assert f": {reason}." in page.text


def test_student_page_lists_submitted_files() -> None:
    one = graded(status="rejected", reason="does not compile: did you mean x?", files=("main.c", "notes.txt"))
    page = assert_harmless(student_page(one, "Lab"))

    assert "Handed in: main.c, notes.txt" in page.text
    assert "x?." not in page.text


def test_class_without_roster_leaves_column_empty() -> None:
    one = graded("ada", on_roster=None)

    assert next(csv.DictReader(io.StringIO(grades_csv(whole(one)))))["on_roster"] == ""
    assert "roster" not in class_page(whole(one)).lower()
    assert GradedClass.from_json(whole(one).to_json()) == whole(one)


def test_class_page_lists_late_and_unknown_students() -> None:
    late = graded("ada", late=True, late_by_s=3700, files=tuple(f"{number}.c" for number in range(9)))
    page = assert_harmless(class_page(whole(late, graded("eve", on_roster=False, files=("eve.c",)))))

    assert "Late: 1" in page.text
    assert "1 h 2 min" in page.text
    assert "Not on the roster: 1" in page.text
    assert "eve.c" in page.text


def test_unjudged_check_without_points_does_not_prevent_grade() -> None:
    """A program that was submitted in compiled form has no compiler warnings to check."""
    aside = check("1.w", points=0, max_points=0, outcome="unjudged", unjudged_because="no source")
    one = graded(verdict=verdict(check("1.a", points=2, outcome="passed"), aside))
    row = next(csv.DictReader(io.StringIO(grades_csv(whole(one)))))
    suite = ET.fromstring(junit_xml(whole(one)))[0]
    results = gradescope_results(one)

    assert one.verdict is not None
    assert one.verdict.counts
    assert (row["points"], row["exercise_1"]) == ("2", "2")
    assert (suite.attrib["errors"], suite.attrib["skipped"]) == ("0", "1")
    assert_is_gradescopes(results)
    assert [test["number"] for test in results["tests"]] == ["1.a"]


def test_hardest_check_comes_first() -> None:
    found = whole(
        graded(
            "ada",
            verdict=verdict(
                check("1.a", points=2, outcome="passed"), check("1.b", points=0, outcome="failed")
            ),
        ),
        graded("bob", verdict=verdict(check("1.a"), check("1.b", points=2, outcome="unjudged"))),
    )

    assert [(one.check, one.share, one.passed, one.judged) for one in hardest_checks(found)] == [
        ("1.b", 0.0, 0, 1),
        ("1.a", 0.75, 1, 2),
    ]


# -- what a student sees ------------------------------------------------------------------------------------


def test_student_sees_only_what_rubric_allows() -> None:
    secret = verdict(
        check("1.a", actual="seen a"),
        check("2.b", expected="secret b", detail="actual", actual="seen b"),
        check("3.c", title="secret c", detail="none", actual="secret c"),
        check("4.d", title="secret d", visibility="never"),
        check("5.e", title="later e", visibility="after_due_date"),
        evidence=(run(exercises=("4",), question="secret run", terminal="secret text"),),
    )
    before = student_page(graded(verdict=secret), "Lab", after_due_date=False)
    after = student_page(graded(verdict=secret), "Lab")

    assert "secret" not in before + after
    assert "later e" in after
    assert "later e" not in before
    assert "4 of 8 points" in after
    assert "3 of 6 points" in before
    assert "seen a" in before
    assert "seen b" in before


def test_evidence_is_separate_from_student_pages(tmp_path: Path) -> None:
    secret = verdict(check("1.a", title="secret", visibility="never"), evidence=(run(),))
    reports = Reports(tmp_path, "Lab")
    line = reports.student(graded(verdict=secret))
    reports.whole(whole(line))

    assert line.verdict is not None
    assert line.verdict.evidence == ()
    assert "secret" not in (tmp_path / "students" / "ada.html").read_text()
    assert Verdict.from_json((tmp_path / "evidence" / "ada.json").read_bytes()) == secret
    reports.whole(whole(graded("bob", status="missing")))
    assert not (tmp_path / "students" / "ada.html").exists()
    assert not (tmp_path / "evidence" / "ada.json").exists()


def test_pseudonym_is_stable_and_anonymous() -> None:
    ada = Student("17-123", "Ada", "ada@example.org")
    shown = pseudonym(ada, b"key")

    assert shown == pseudonym(ada, b"key")
    assert shown != pseudonym(ada, b"another")
    assert shown.name == shown.email == ""
    assert "17" not in shown.id.removeprefix("student-") or "123" not in shown.id


# -- plots --------------------------------------------------------------------------------------------------


numbers = st.floats(allow_nan=False, allow_infinity=False)


@given(
    st.lists(st.tuples(st.floats(0, 1e6), st.none() | numbers, st.floats(-1e6, 1e6)), max_size=30),
    st.sampled_from(["deg", "m"]),
)
def test_every_printed_value_has_mark_in_picture(
    points: list[tuple[float, float | None, float]], unit: str
) -> None:
    t_s, printed, truth = ([one[n] for one in points] for n in range(3))
    drawn = series_plot(
        Series(name="Yaw", unit=unit, t_s=tuple(t_s), printed=tuple(printed), truth=tuple(truth))
    )  # type: ignore[arg-type]
    marks = re.findall(r'<circle cx="([^"]*)" cy="([^"]*)" r="2.6" class="printed"', drawn)[:-1]
    others = drawn.count('class="beyond"') + drawn.count('class="none"')

    assert len(marks) + others == len(points)
    assert all(0 <= float(x) <= 440 and 0 <= float(y) <= 180 for x, y in marks)
    assert "nan" not in drawn
    assert "inf" not in drawn


def test_wrap_around_of_yaw_is_drawn_with_gap() -> None:
    yaw = Series(
        name="Yaw", unit="deg", t_s=(1, 2, 3, 4), printed=(170, 179, -179, -170), truth=(170, 179, -179, -170)
    )

    assert series_plot(yaw).count("<polyline") == 2


@given(st.lists(st.floats(0, 100)), st.floats(0.5, 1000))
def test_distribution_counts_every_student(values: list[float], most: float) -> None:
    drawn = histogram(values, most)

    assert sum(map(int, re.findall(r"<title>(\d+) with", drawn))) == len(values)


def test_histogram_shows_full_points_separately() -> None:
    drawn = histogram([19.5, 20.0, 19.0, 0.5], 20.0)

    found = re.findall(r"<title>(.*?)</title>", drawn)
    assert found == ["1 with 0 points to 1", "2 with 19 points to 20", "1 with 20 points, all"]


# -- Gradescope ---------------------------------------------------------------------------------------------

VISIBILITIES = {"hidden", "after_due_date", "after_published", "visible"}
FORMATS = {"text", "html", "simple_format", "md", "ansi"}
TOP = {
    "score": float,
    "execution_time": int,
    "output": str,
    "output_format": str,
    "test_output_format": str,
    "test_name_format": str,
    "visibility": str,
    "stdout_visibility": str,
    "extra_data": dict,
    "tests": list,
    "leaderboard": list,
}
TEST = {
    "score": float,
    "max_score": float,
    "status": str,
    "name": str,
    "name_format": str,
    "number": str,
    "output": str,
    "output_format": str,
    "tags": list,
    "visibility": str,
    "extra_data": dict,
}
"""The documented fields and their types: https://gradescope-autograders.readthedocs.io/en/latest/specs/"""


def assert_is_gradescopes(results: dict[str, Any]) -> None:
    """Assert that only documented fields exist, with the documented types and values."""
    assert "score" in results or all("score" in test for test in results["tests"])
    for fields, table in [(results, TOP), *((test, TEST) for test in results["tests"])]:
        for name, value in fields.items():
            assert isinstance(value, table[name]), name
            assert not name.endswith("visibility") or value in VISIBILITIES
            assert not name.endswith("_format") or value in FORMATS
    assert json.loads(json.dumps(results)) == results


def test_gradescope_results_have_documented_fields() -> None:
    found = verdict(
        check("1.a", points=2, outcome="passed"),
        check("1.b", visibility="after_due_date", expected="secret", detail="actual"),
        check("2.c", visibility="never", hint=EVIL),
    )
    results = gradescope_results(graded(verdict=found))

    assert_is_gradescopes(results)
    assert sum(one["score"] for one in results["tests"]) == 4
    assert [one["visibility"] for one in results["tests"]] == ["visible", "after_due_date", "hidden"]
    assert [one["status"] for one in results["tests"]] == ["passed", "failed", "failed"]
    assert [one["output"] for one in results["tests"]][:2] == ["", "seen: b\nhint: c"]


@pytest.mark.parametrize(
    "late", [{}, {"late": True, "late_by_s": 90_000, "late_penalty": 0.5}], ids=["", "late"]
)
@pytest.mark.parametrize("visibility", ["never", "after_due_date"])
def test_gradescope_does_not_show_hidden_check(visibility: str, late: dict[str, Any]) -> None:
    """A hidden check changes only the test that Gradescope hides, and not the student's page.

    A late penalty needs the total score of all checks, which Gradescope hides as a separate test.
    """
    outcomes = [{"outcome": "passed", "points": 2}, {"outcome": "failed", "points": 0}]
    found = [
        graded(verdict=verdict(check("1.a"), check("2.b", visibility=visibility, **outcome)), **late)
        for outcome in outcomes
    ]
    shown = []
    for one in found:
        results = gradescope_results(one)
        hidden = [test for test in results["tests"] if test["visibility"] != "visible"]
        results["tests"] = [test for test in results["tests"] if test["visibility"] == "visible"]
        assert len(hidden) == len(results["tests"]) == 1
        assert (results.pop("score", None) is not None) is bool(late)
        shown.append(json.dumps(results, indent=1))

    assert shown[0] == shown[1]
    assert "1 of 2 points" in shown[0]
    pages = {student_page(one, "Lab", after_due_date=visibility == "never") for one in found}
    assert len(pages) == 1


def test_gradescope_shows_why_submission_cannot_be_judged() -> None:
    results = gradescope_results(graded(status="rejected", reason="does not compile", build_log="main.c:1"))

    assert_is_gradescopes(results)
    assert results["score"] == 0
    assert "does not compile" in results["output"]
    assert "main.c:1" in results["output"]


@pytest.mark.parametrize("status", ["unjudged", "partly", "missing"])
def test_gradescope_gets_no_results_without_grade(status: str) -> None:
    with pytest.raises(NotJudgedError):
        gradescope_results(graded(status=status, reason="the worker died"))


def test_replay_command_needs_seed_and_known_rubric() -> None:
    known = {"rubric": "lab3", "rubric_digest": load_rubric("lab3").digest, "seed": 7}
    found = verdict(check("1.a")).model_copy(update=known)
    command = "fcu check 'my lab.elf' --rubric lab3 --seed 7 --save motions"
    one = graded(firmware="my lab.elf", verdict=found)
    others = (found.without_seed(), found.model_copy(update={"rubric_digest": "0"}))

    assert command in Page(student_page(one, "LAB3")).text
    assert command in gradescope_results(one)["output"]
    for other in others:
        assert "fcu check" not in student_page(graded(verdict=other), "LAB3")


def test_failed_check_shows_example_of_wrong_line() -> None:
    found = verdict(check("1.a", printed='"Pitch: 5" at 3 s'))

    assert "such as" in Page(student_page(graded(verdict=found), "LAB3")).text
    assert 'such as: "Pitch: 5" at 3 s' in gradescope_results(graded(verdict=found))["tests"][0]["output"]
