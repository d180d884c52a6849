"""Every submitted file and folder is in the results, with any name."""

from __future__ import annotations

import csv
import json
import os
import shutil
from collections.abc import Iterator
from concurrent.futures import Executor, Future
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st

from fcu_emulator.emulator.cli import execute
from fcu_emulator.emulator.grading.build import Built, CompileError
from fcu_emulator.emulator.grading.platforms import shown_name
from fcu_emulator.emulator.grading.results import GradedClass
from fcu_emulator.emulator.grading.submissions import RejectedError, SubmittedFirmware, SubmittedSource
from tests.grading.test_grade import RUBRIC
from tests.grading.test_reports import assert_harmless, check, verdict
from tests.support.layouts import LAYOUTS, Handed
from tests.support.words import Words

VERDICT = verdict(check("1.a", points=1, outcome="passed"))
GOOD, BAD = b"int main(void) { return 0; }", b"this does not compile"
ON_ROSTER = {True: "yes", False: "no", None: ""}
PLATFORMS_OWN = {"submission_metadata.yml", "Lab_3.xlsx", "status.xlsx", "status.csv", "README.md"}


class FakeBuilder:
    """Builder that builds every source except :data:`BAD`."""

    def __init__(self, *arguments: Any, **options: Any) -> None:
        del arguments, options

    def build(self, source: SubmittedSource) -> Built:
        if BAD in source.files.values():
            raise CompileError("main.c:1:1: error: this is no C")
        return Built(SubmittedFirmware("lab3.elf", b"\x7fELF" + source.digest.encode()), "")

    def close(self) -> None:
        """Do nothing, because there are no files to remove."""


class FakeWorkers(Executor):
    """Workers that give every ELF file the same verdict, and refuse all other files."""

    slots = 1

    def submit(self, fn: Any, /, *args: Any, **kwargs: Any) -> Future[Any]:
        del fn, kwargs
        future: Future[Any] = Future()
        if args[0].firmware.startswith(b"\x7fELF"):
            future.set_result(VERDICT.to_json())
        else:
            future.set_exception(RejectedError("is not a firmware file"))
        return future


@contextmanager
def fake_workers(options: object) -> Iterator[FakeWorkers]:
    del options
    yield FakeWorkers()


@pytest.fixture
def no_machine(monkeypatch: pytest.MonkeyPatch) -> None:
    """Replace compiler and emulator, because these tests only check the listed students."""
    monkeypatch.setattr("fcu_emulator.emulator.cli.grade._workers", fake_workers)
    monkeypatch.setattr("fcu_emulator.emulator.cli.grade.Builder", FakeBuilder)


WORDS = st.text("abcé ü'", min_size=1, max_size=5).map(lambda text: f"N{text.strip()}")
PROGRAMS = st.dictionaries(
    st.sampled_from(
        ["main.c", "lab.c", "main.C", "my lab.c", "lab3.elf", "lab.hex", "notes.txt", "old.zip", "x.rar"]
    ),
    st.sampled_from([GOOD, BAD, b"", b"\x7fELF", b"PK\3\4"]),
    max_size=3,
)
STUDENTS = st.lists(
    st.builds(Handed, st.integers(1, 99).map(str), WORDS, WORDS, PROGRAMS, st.booleans()),
    max_size=5,
    unique_by=lambda one: one.id,
)
ODD_NAMES = st.one_of(
    st.sampled_from(
        [
            *(
                "ada.c",
                "ada.elf",
                "Ada.zip",
                "olaf.cpp",
                "README",
                ".ada.c",
                "..c",
                "con.c",
                "=1+1.c",
                "-rf.c",
            ),
            *("Eve_7_assignsubmission_file_x_8_assignsubmission_file_.c", "x_1_assignsubmission_file_main.c"),
            *("Lab_1_attempt_2026-11-20-10-11-12_main.c", "Lab_1_attempt_2026-11-20-10-11-12.txt"),
            *("Lab_eve_attempt_2026-11-20-10-11-12_Lab_1_attempt_2026-11-20-10-11-12.c", "x_attempt_.c"),
            *(
                "evewe_1_7001_main.c",
                "evewe_LATE_2_7002_main.c",
                "evewe_1_text.html",
                "submission_1",
                "1",
                "2.c",
            ),
            *("Ewe_Eve_1_1", "Ewe_Eve_x_1_2", "Team 1", "\u202egnp.c", "a\nb.c"),
        ]
    ),
    st.text(
        st.characters(exclude_characters="/\0", categories=("L", "N", "P", "S", "Z", "Cc", "Cf")),
        min_size=1,
        max_size=12,
    ),
)
ODD = st.dictionaries(
    ODD_NAMES.filter(lambda name: name not in (".", "..") and len(name.encode()) < 200),
    st.sampled_from(["file", "folder", "empty folder", "link"]),
    max_size=4,
)
ROSTERS = st.none() | st.lists(
    st.tuples(st.integers(1, 99).map(str), st.just("") | WORDS), unique_by=lambda row: row[0], max_size=5
)


def write_odd(where: Path, odd: dict[str, str]) -> None:
    where.mkdir(parents=True, exist_ok=True)
    for name, kind in odd.items():
        path = where / name
        if os.path.lexists(path) or (name.startswith(".") and "folder" in kind):
            continue
        if kind == "link":
            path.symlink_to("/etc/passwd")
        elif kind == "file":
            path.write_bytes(GOOD)
        else:
            path.mkdir()
            if kind == "folder":
                (path / "main.c").write_bytes(GOOD)


def handed_in(where: Path) -> list[str]:
    """Return the names in a folder, except those that systems and platforms write."""
    systems = ("._", "__macosx", ".ds_store", "thumbs.db", "desktop.ini")
    return [
        path.name
        for path in where.iterdir()
        if path.name not in PLATFORMS_OWN and not path.name.casefold().startswith(systems)
    ]


@settings(max_examples=40, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@example("folders", [], {"ada.c": "file", "0\t": "folder"}, None)
@example("moodle-flat", [], {" ": "file", "\n": "file", "ada.c": "link"}, [("ada", "")])
@given(st.sampled_from(sorted(set(LAYOUTS) - {"ilias", "ilias-feedback"})), STUDENTS, ODD, ROSTERS)
def test_every_entry_is_in_one_result(
    no_machine: None,
    layout: str,
    students: list[Handed],
    odd: dict[str, str],
    roster: list[tuple[str, str]] | None,
) -> None:
    with TemporaryDirectory() as folder:
        where = Path(folder) / "class"
        LAYOUTS[layout](where, students)
        write_odd(where, odd)
        assert_nothing_is_lost(where, handed_in(where), roster)


@settings(max_examples=20, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.sampled_from(["ilias", "ilias-feedback"]), STUDENTS.filter(bool), ROSTERS)
def test_every_folder_of_ilias_is_in_one_result(
    no_machine: None, layout: str, students: list[Handed], roster: list[tuple[str, str]] | None
) -> None:
    with TemporaryDirectory() as folder:
        where = LAYOUTS[layout](Path(folder) / "class", students)
        inside = next(path for path in where.iterdir() if path.is_dir())
        assert_nothing_is_lost(where, handed_in(inside), roster)


def assert_nothing_is_lost(where: Path, names: list[str], roster: list[tuple[str, str]] | None) -> None:
    """Grade a folder, and check that each name in it and each student of the roster is listed."""
    out = where.parent / "out"
    rubric = where.parent / "little.toml"
    rubric.write_text(RUBRIC, encoding="utf-8")
    options: list[object] = ["--rubric", rubric, "--out", out]
    if roster is not None:
        file = where.parent / "roster.csv"
        file.write_text("id,name\n" + "".join(f"{one},{name}\n" for one, name in roster), encoding="utf-8")
        options += ["--roster", file]
    code = execute(["grade", str(where), *map(str, options)])
    if code == 2:
        assert not names, names
        return
    assert code == 0
    whole = GradedClass.from_json((out / "grade.json").read_bytes())
    listed = sorted(name for one in whole.submissions for name in one.files)

    assert listed == sorted(map(shown_name, names))
    assert whole.handed_in == sum(one.handed_in for one in whole.submissions) == len(names)
    for one in whole.submissions:
        assert one.status in ("judged", "rejected", "missing")
        assert (one.points is not None) is (one.status == "judged")
        assert bool(one.reason) is (one.status != "judged")
        assert one.reason.isprintable()
        assert bool(one.files) is (one.status != "missing")
        assert (out / "students" / f"{one.report}.html").is_file()
    ids = {student for student, _ in roster or ()}
    assert {one.id for one in whole.submissions if one.on_roster is not False} == (
        ids if roster is not None else set_of(whole)
    )
    assert {one.id for one in whole.submissions if one.status == "missing"} <= ids
    assert_reports_agree(whole, out)


def set_of(whole: GradedClass) -> set[str]:
    return {one.id for one in whole.submissions}


def assert_reports_agree(whole: GradedClass, out: Path) -> None:
    """Assert that the table, the machine-readable list and the page have the same students."""
    with (out / "grades.csv").open(encoding="utf-8-sig", newline="") as file:
        rows = list(csv.DictReader(file))
    page = assert_harmless((out / "index.html").read_text(encoding="utf-8"))
    links = {attributes["href"] for tag, attributes in page.tags if tag == "a"}

    assert [row["status"] for row in rows] == [one.status for one in whole.submissions]
    assert [int(row["handed_in"]) for row in rows] == [one.handed_in for one in whole.submissions]
    assert [row["on_roster"] for row in rows] == [ON_ROSTER[one.on_roster] for one in whole.submissions]
    assert links == {f"students/{one.report}.html" for one in whole.submissions}
    assert len({one.report for one in whole.submissions}) == len(whole.submissions)
    assert json.loads((out / "grade.json").read_bytes())["handed_in"] == whole.handed_in


def test_missing_folder_of_download_is_reported(no_machine: None, tmp_path: Path, words: Words) -> None:
    pytest.importorskip("yaml")
    students = [Handed(number, "A", "B", {"main.c": GOOD}) for number in ("1", "2")]
    where = LAYOUTS["gradescope"](tmp_path / "class", students)
    shutil.rmtree(where / "submission_2")
    assert execute(["grade", str(where), "--rubric", "lab3", "--out", str(tmp_path / "out")]) == 0
    whole = GradedClass.from_json((tmp_path / "out" / "grade.json").read_bytes())

    assert [(one.id, one.status, one.handed_in) for one in whole.submissions] == [
        ("1", "judged", 1),
        ("2", "rejected", 0),
    ]
    words("grade", whole.submissions[1].reason)
