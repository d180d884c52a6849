"""One student's report: points, reasons and evidence, in one file."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import takewhile

from fcu_emulator.emulator.grading.late import after_penalty
from fcu_emulator.emulator.grading.reports.following_plot import following_plot
from fcu_emulator.emulator.grading.reports.markup import Html, element, page
from fcu_emulator.emulator.grading.reports.plots import series_plot, share_bar
from fcu_emulator.emulator.grading.reports.style import STYLE
from fcu_emulator.emulator.grading.results import LATE_PENALTY, TOTAL, Graded
from fcu_emulator.emulator.grading.verdict import CheckResult, DiagnosedCause, RunEvidence, Verdict
from fcu_emulator.emulator.host.install_hints import command_line

_MARKS = {"passed": "✓", "partial": "◐", "failed": "✗", "unjudged": "?"}
_WORDS = {"passed": "passed", "partial": "partly passed", "failed": "not passed", "unjudged": "not judged"}


def student_page(graded: Graded, title: str, *, after_due_date: bool = True) -> str:
    """Return the visible part of the verdict as HTML. ``title``: the title of the rubric."""
    return page(f"{graded.shown_name}: {title}", STYLE, *_body(graded, title, after_due_date))


def number(value: float) -> str:
    """Format points without trailing zeros: 3, 2.5."""
    return f"{value:.4g}"


def _body(graded: Graded, title: str, after_due_date: bool) -> Iterator[Html]:
    yield element("p", title, class_="quiet")
    yield element("h1", graded.shown_name)
    verdict = graded.verdict and graded.verdict.for_student(after_due_date)
    if verdict is not None:
        yield element("p", _total(graded, verdict), class_="points")
    if graded.late:
        by = f" by {graded.late_words}" if graded.late_by_s is not None else ""
        yield element("p", f"Handed in late{by}.", class_="quiet")
    if graded.files:
        yield element("p", f"Handed in: {', '.join(graded.files)}", class_="quiet")
    if graded.note:
        yield element("p", f"{graded.note[0].upper()}{graded.note[1:]}.", class_="quiet")
    yield from _overrides(graded, verdict)
    if graded.status != "judged":
        yield _notice(graded)
    if graded.build_log:
        yield from _build_log(graded)
    if verdict is None:
        return
    yield from _causes(verdict)
    yield _overview(graded, verdict)
    if graded.again:
        yield element("p", "To repeat this on your machine:", class_="quiet")
        yield element("pre", graded.again)
    for exercise in verdict.exercises:
        checks = verdict.of(exercise.exercise)
        if checks:
            yield element(
                "h2", f"Exercise {exercise.exercise}: {exercise.title}", id=f"e-{exercise.exercise}"
            )
            yield from (_check(one) for one in checks if one.max_points or one.outcome != "unjudged")
            yield from _links(verdict.evidence_of(exercise.exercise))
    if verdict.hidden_checks:
        some = "one check" if verdict.hidden_checks == 1 else f"{verdict.hidden_checks} checks"
        yield element("p", f"The grade also includes {some} that this page does not show.", class_="quiet")
    for evidence in verdict.evidence:
        yield from _run(evidence, graded.firmware)
    yield _footer(graded, verdict)


def _notice(graded: Graded) -> Html:
    words = {
        "rejected": "This submission was rejected: ",
        "missing": "No submission: ",
        "unjudged": "This submission has not been judged, through no fault of the student: ",
        "partly": "Some checks were not judged, through no fault of the program, and do not count: ",
    }
    end = "" if graded.reason.endswith((".", "?", "!")) else "."
    return element("div", element("p", words[graded.status], graded.reason, end), class_="notice")


def _build_log(graded: Graded) -> Iterator[Html]:
    compiled = graded.verdict is not None
    yield element("h2", "Compiler warnings" if compiled else "Compiler output")
    yield element("pre", graded.build_log)


def _causes(verdict: Verdict) -> Iterator[Html]:
    found = {cause.summary: cause for run in verdict.evidence for cause in run.causes}
    if found:
        yield element("h2", "Problems of the program")
    yield from (_cause(cause) for cause in sorted(found.values(), key=lambda one: not one.fatal))


def _cause(cause: DiagnosedCause) -> Html:
    sentences = list(takewhile(lambda line: not line.endswith(":"), cause.details))
    lists = "\n".join(cause.details[len(sentences) :])
    more = element("details", element("summary", "Details"), element("pre", lists)) if lists else None
    lines = (element("p", line) for line in (cause.summary, *sentences))
    return element("div", *lines, more, class_="cause fatal" if cause.fatal else "cause")


def _total(graded: Graded, verdict: Verdict) -> str:
    if any(one.what == TOTAL for one in graded.overrides) and graded.points is not None:
        return f"{number(graded.points)} points"
    got = sum(_points_of(graded, verdict, one.exercise) for one in verdict.exercises)
    got = after_penalty(got, graded.late_penalty)
    return f"{number(got)} of {number(verdict.max_points)} points"


def _points_of(graded: Graded, verdict: Verdict, exercise: str) -> float:
    given = (one.points for one in graded.overrides if one.what == exercise)
    return next(given, sum(check.points for check in verdict.of(exercise)))


def _overrides(graded: Graded, verdict: Verdict | None) -> Iterator[Html]:
    checks = {check.check: check.title for check in verdict.checks} if verdict else {}
    names = checks | {TOTAL: "everything", LATE_PENALTY: "deducted for handing in late"}
    if verdict is not None:
        names |= {one.exercise: f"exercise {one.exercise}: {one.title}" for one in verdict.exercises}
    shown = [one for one in graded.overrides if one.what in names]
    if shown:
        yield element("h2", "Points given by the teacher")
        rows = (
            element(
                "tr",
                element("td", names[one.what]),
                element("td", one.comment),
                element("td", number(one.points), class_="number"),
            )
            for one in shown
        )
        yield element("table", *rows)


def _overview(graded: Graded, verdict: Verdict) -> Html:
    rows = []
    for exercise in verdict.exercises:
        checks = verdict.of(exercise.exercise)
        most = sum(check.max_points for check in checks)
        got = _points_of(graded, verdict, exercise.exercise)
        if checks:
            link = element("a", exercise.title, href=f"#e-{exercise.exercise}")
            share = share_bar(min(got / most, 1.0) if most else 0.0)
            points = element("td", f"{number(got)} of {number(most)}", class_="number")
            rows.append(
                element(
                    "tr", element("td", exercise.exercise), element("td", link), element("td", share), points
                )
            )
    head = element(
        "tr",
        *(element("th", name) for name in ("", "exercise", "")),
        element("th", "points", class_="number"),
    )
    return element("table", head, *rows)


def _check(check: CheckResult) -> Html:
    mark = element("span", _MARKS[check.outcome], class_=f"mark {check.outcome}", title=_WORDS[check.outcome])
    worth = f"{number(check.points)} of {number(check.max_points)}" if check.max_points else "no points"
    if check.outcome == "unjudged" and check.max_points:
        worth = f"not judged, {number(check.max_points)}"
    rows: list[Html] = []
    for name, text in (
        ("expected", check.expected),
        ("seen", check.actual),
        ("such as", check.printed if check.printed != check.actual else ""),
        ("line", check.source),
        ("because", check.unjudged_because),
        ("hint", check.hint if check.outcome in ("failed", "partial") else ""),
    ):
        if text:
            rows += [element("dt", name), element("dd", text)]
    details = element("dl", *rows) if rows else None
    return element(
        "div",
        mark,
        element("span", check.title),
        element("span", worth, class_="worth"),
        details,
        class_="check",
    )


def _links(evidence: tuple[RunEvidence, ...]) -> Iterator[Html]:
    if evidence:
        links: list[Html | str] = []
        for one in evidence:
            links += [", " if links else "", element("a", one.question, href=f"#r-{one.run}")]
        yield element("p", "Runs: ", *links, class_="quiet")


def _run(run: RunEvidence, firmware: str) -> Iterator[Html]:
    yield element("h2", f"Run: {run.question}", id=f"r-{run.run}")
    facts = [f"{run.duration_s:g} s of virtual time"]
    if run.timer_hz is not None:
        facts.append(f"the callback's timer runs at {run.timer_hz:.6g} Hz")
        facts.append(f"{run.ticks} ticks, {run.ticks_late} late, {run.ticks_lost} lost")
    yield element("p", "; ".join(facts), class_="quiet")
    if run.stopped:
        yield element("div", element("p", f"The run {run.stopped}"), class_="cause fatal")
    if run.series:
        yield element("div", *map(series_plot, run.series), class_="plots")
    if run.following:
        plots = (following_plot(one, run.duration_s) for one in run.following)
        yield element("div", *plots, class_="plots")
    text = run.terminal or "(no output)"
    yield element("details", element("summary", "Terminal"), element("pre", text))
    if run.replay:
        yield element(
            "details",
            element("summary", "To repeat this run on your machine"),
            element("p", f"Save this as {run.run}.toml, then:"),
            element("pre", command_line(["fcu", "run", firmware, "--scenario", f"{run.run}.toml"])),
            element("pre", run.replay),
        )


def _footer(graded: Graded, verdict: Verdict) -> Html:
    what = f"{graded.firmware}, SHA-256 {verdict.firmware_digest[:16]}"
    what += f"; seed {verdict.seed}" if verdict.seed is not None else ""
    by = f"rubric {verdict.rubric}, fcu-emulator {verdict.version}"
    return element("p", f"Judged: {what}; {by}.", class_="quiet")
