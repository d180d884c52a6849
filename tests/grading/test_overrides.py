"""Points that a teacher sets, and late submissions."""

from __future__ import annotations

import csv
import os
from datetime import datetime
from pathlib import Path

import pytest

from fcu_emulator.emulator.cli import execute
from fcu_emulator.emulator.errors import RubricError
from fcu_emulator.emulator.grading.results import duration_text
from fcu_emulator.emulator.grading.rubric import load_rubric
from tests.grading.test_grade import RUBRIC
from tests.grading.test_nothing_lost import BAD, GOOD, no_machine
from tests.grading.test_reports import check, verdict
from tests.support.layouts import Handed, write_blackboard, write_canvas, write_folders, write_zips

__all__ = ["no_machine"]

VERDICT = verdict(
    check("1.acc", points=1, max_points=1, outcome="passed"),
    check("1.warnings", points=0, max_points=0, outcome="passed"),
    check("2.pitch", points=0, max_points=2, outcome="failed", visibility="after_due_date"),
)


@pytest.fixture
def where(tmp_path: Path, no_machine: None, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return a class: Ada and Bob are judged, and Eve's program does not compile."""
    monkeypatch.setattr("tests.grading.test_nothing_lost.VERDICT", VERDICT)
    (tmp_path / "little.toml").write_text(RUBRIC, encoding="utf-8")
    programs = {"ada": GOOD, "bob": GOOD + b" int b;", "eve": BAD}
    return write_folders(
        tmp_path / "class", [Handed(name, "", "", {"main.c": data}) for name, data in programs.items()]
    )


def grade(where: Path, *options: object) -> int:
    folder = where.parent
    return int(
        execute(
            ["grade", str(where), "--rubric", str(folder / "little.toml"), "--out", str(folder / "out")]
            + [str(option) for option in options]
        )
    )


def rows(where: Path) -> dict[str, dict[str, str]]:
    with (where.parent / "out" / "grades.csv").open(encoding="utf-8-sig", newline="") as file:
        return {row["id"]: row for row in csv.DictReader(file)}


def page(where: Path, name: str) -> str:
    return (where.parent / "out" / "students" / f"{name}.html").read_text(encoding="utf-8")


def overrides(where: Path, *lines: str) -> Path:
    path = where.parent / "overrides.csv"
    path.write_text("\n".join(["id,what,points,comment", *lines]) + "\n", encoding="utf-8")
    return path


def test_override_of_check_counts_in_exercise_and_total(where: Path) -> None:
    assert grade(where, "--overrides", overrides(where, "Ada,2.pitch,1.5,a good idea")) == 0
    ada = rows(where)["ada"]

    assert (ada["exercise_1"], ada["exercise_2"], ada["points"]) == ("1", "1.5", "2.5")
    assert ada["comment"] == "a good idea"
    assert "a good idea" in page(where, "ada")
    assert rows(where)["bob"]["points"] == "1"


def test_override_of_exercise_counts_in_total(where: Path) -> None:
    grade(where, "--overrides", overrides(where, "ada,1,0,copied", "ada,2,2,"))
    ada = rows(where)["ada"]

    assert (ada["exercise_1"], ada["exercise_2"], ada["points"]) == ("0", "2", "2")
    assert "copied" in page(where, "ada")


def test_total_override_gives_unjudged_submission_a_grade(where: Path) -> None:
    grade(where, "--overrides", overrides(where, "eve,total,1,shown in the lab"))

    assert rows(where)["eve"]["points"] == "1"
    assert rows(where)["eve"]["status"] == "rejected"
    assert "shown in the lab" in page(where, "eve")


def test_override_of_hidden_check_is_not_shown(where: Path) -> None:
    grade(where, "--before-due-date", "--overrides", overrides(where, "ada,2.pitch,2,a secret word"))

    assert rows(where)["ada"]["points"] == "3"
    assert "a secret word" not in page(where, "ada")


@pytest.mark.parametrize(
    ("line", "place"),
    [
        ("nobody,total,1,", "id"),
        ("ada,3,1,", "what"),
        ("ada,2.yaw,1,", "what"),
        ("ada,total,many,", "points"),
        ("ada,total,-1,", "points"),
        ("ada,total,nan,", "points"),
        (",total,1,", "id"),
        ("ada,total,1,\nADA,total,2,", "twice"),
    ],
)
def test_invalid_override_is_refused_with_reason(
    where: Path, line: str, place: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert grade(where, "--overrides", overrides(where, line)) == 2
    said = capsys.readouterr().err
    assert "overrides.csv" in said
    assert place in said


# -- grading some again -------------------------------------------------------------------------------------


def test_only_listed_students_are_graded_again(where: Path) -> None:
    grade(where, "--overrides", overrides(where, "bob,2,1,kept"))
    before = rows(where)
    for name in ("ada", "bob"):
        (where / name / "main.c").write_bytes(BAD)
    (where / "zoe").mkdir()
    (where.parent / "again.csv").write_text("id\nAda\n", encoding="utf-8")
    assert grade(where, "--only", where.parent / "again.csv") == 0
    after = rows(where)

    assert after["ada"]["status"] == "rejected"
    for name in ("bob", "eve"):
        assert {**after[name], "copies": ""} == {**before[name], "copies": ""}
    assert after["zoe"]["status"] == "rejected"
    assert "kept" in page(where, "bob")


@pytest.mark.parametrize(("line", "graded"), [("nobody", True), ("ada", False)])
def test_list_without_gradable_students_is_refused(where: Path, line: str, graded: bool) -> None:
    if graded:
        grade(where)
    (where.parent / "again.csv").write_text(f"id\n{line}\n", encoding="utf-8")

    assert grade(where, "--only", where.parent / "again.csv") == 2


# -- who is late --------------------------------------------------------------------------------------------


def test_file_times_determine_late_submissions(where: Path) -> None:
    for name, at in (("ada", "2026-11-20T23:58"), ("bob", "2026-11-22T01:00")):
        stamp = datetime.fromisoformat(at).timestamp()
        os.utime(where / name / "main.c", (stamp, stamp))
    grade(where, "--deadline", "2026-11-20T23:59")
    found = rows(where)

    assert found["ada"]["late_by"] == ""
    assert found["bob"]["late_by"] == "1 d 1 h 1 min"
    assert found["bob"]["submitted"] == "2026-11-22T01:00:00"
    assert found["bob"]["points"] == "1"
    assert " 1 d 1 h 1 min" in page(where, "bob")
    assert " 1 min" not in page(where, "ada")


def test_blackboard_names_determine_late_submissions(where: Path) -> None:
    students = [
        Handed("ada", "Ada", "L", {"main.c": GOOD}),
        Handed("bob", "Bob", "B", {"main.c": GOOD}, late=True),
    ]
    folder = write_blackboard(where.parent / "blackboard", students)
    grade(folder, "--deadline", "2026-11-20T23:59")

    assert {name: row["late_by"] for name, row in rows(where).items()} == {"ada": "", "bob": "10 h 13 min"}


def test_canvas_marks_determine_late_submissions(where: Path) -> None:
    students = [
        Handed("1", "Ada", "L", {"main.c": GOOD}),
        Handed("2", "Bob", "B", {"main.c": GOOD}, late=True),
    ]
    grade(write_canvas(where.parent / "canvas", students))

    assert {name: row["late_by"] for name, row in rows(where).items()} == {"1": "", "2": "late"}


def test_archive_of_class_keeps_times_of_files(where: Path) -> None:
    import zipfile

    write_zips(where.parent / "zips", [Handed("ada", "", "", {"main.c": GOOD})])
    with zipfile.ZipFile(where.parent / "class.zip", "w") as target:
        entry = zipfile.ZipInfo("ada.zip", (2026, 11, 21, 0, 0, 0))
        target.writestr(entry, (where.parent / "zips" / "ada.zip").read_bytes())
    grade(where.parent / "class.zip", "--deadline", "2026-11-20T23:59")

    assert rows(where)["ada"]["late_by"] == "1 min"


@pytest.mark.parametrize(("seconds", "text"), [(1, "1 min"), (3600, "1 h"), (86_400 + 60, "1 d 1 min")])
def test_duration_is_in_days_hours_and_minutes(seconds: int, text: str) -> None:
    assert duration_text(seconds) == text


# -- the late penalty ---------------------------------------------------------------------------------------

LATE_RULE = "[late]\npenalty_per_day = 0.25\ngrace_minutes = 5\n"
"""With this rule Bob loses half of his point, because he is late by a day and an hour."""


@pytest.fixture
def late(where: Path) -> Path:
    """Return a class: Ada is in time and Bob is late. Eve is also late, and her program does not compile."""
    for name, day in (("ada", 20), ("bob", 22), ("eve", 22)):
        stamp = datetime.fromisoformat(f"2026-11-{day}T01:00").timestamp()
        os.utime(where / name / "main.c", (stamp, stamp))
    with (where.parent / "little.toml").open("a", encoding="utf-8") as rubric:
        rubric.write(LATE_RULE)
    return where


def test_late_penalty_is_in_all_reports(late: Path) -> None:
    assert grade(late, "--deadline", "2026-11-20T23:59") == 0
    found = rows(late)

    assert [found[name]["points"] for name in ("ada", "bob", "eve")] == ["1", "0.5", ""]
    assert [found[name]["late_penalty"] for name in ("ada", "bob")] == ["", "0.5"]
    assert "0.5 of 3 points" in page(late, "bob")
    assert "0.5 points less" in page(late, "bob")
    assert "1 of 3 points" in page(late, "ada")
    assert "0.5 points less" in (late.parent / "out" / "index.html").read_text(encoding="utf-8")
    assert '"late_penalty": 0.5' in (late.parent / "out" / "grade.json").read_text(encoding="utf-8")


def test_late_penalty_needs_deadline_and_grace(late: Path) -> None:
    grade(late)
    assert rows(late)["bob"]["points"] == "1"
    grade(late, "--deadline", "2026-11-22T00:55")
    assert (rows(late)["bob"]["points"], rows(late)["bob"]["late_by"]) == ("1", "5 min")


@pytest.mark.parametrize(
    ("lines", "points"),
    [
        (["bob,late penalty,0,ill"], "1"),
        (["bob,late penalty,0.25,one day is excused"], "0.75"),
        (["bob,late penalty,7,"], "0"),
        (["bob,2.pitch,2,shown"], "2.5"),
        (["bob,total,3,"], "3"),
        (["bob,total,3,", "bob,late penalty,1,"], "3"),
    ],
)
def test_late_penalty_applies_to_overridden_points(late: Path, lines: list[str], points: str) -> None:
    grade(late, "--deadline", "2026-11-20T23:59", "--overrides", overrides(late, *lines))

    assert rows(late)["bob"]["points"] == points


def test_changed_late_penalty_judges_no_program_again(late: Path) -> None:
    file = late.parent / "little.toml"
    digests = []
    for rule in (LATE_RULE, '[late]\npenalty_per_day = "10 %"\n', ""):
        file.write_text(RUBRIC + rule, encoding="utf-8")
        digests.append(load_rubric(file).judging_digest)

    assert len(set(digests)) == 1


@pytest.mark.parametrize(
    ("key", "line"),
    [
        ("late.penalty_per_day", "grace_minutes = 3"),
        ("late.penalty_per_day", 'penalty_per_day = "ten"'),
        ("late.penalty_per_day", 'penalty_per_day = "110 %"'),
        ("late.penalty_per_day", "penalty_per_day = -1"),
        ("late.at_most_days", "penalty_per_day = 1\nat_most_days = 1.5"),
        ("late.penalty_per_hour", "penalty_per_hour = 1\npenalty_per_day = 1"),
    ],
)
def test_invalid_late_penalty_is_refused_with_key(tmp_path: Path, key: str, line: str) -> None:
    (tmp_path / "little.toml").write_text(f"{RUBRIC}[late]\n{line}\n", encoding="utf-8")

    with pytest.raises(RubricError) as caught:
        load_rubric(tmp_path / "little.toml")
    assert caught.value.key == key
