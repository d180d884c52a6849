"""``fcu grade`` for a teacher: it reads a folder of submissions and writes reports."""

from __future__ import annotations

import csv
import itertools
import json
import os
import re
import shutil
import signal
import sys
import zipfile
from contextlib import closing
from pathlib import Path

import pytest

from fcu_emulator.emulator.chip import library
from fcu_emulator.emulator.cli import execute
from fcu_emulator.emulator.errors import InputError, NotJudgedError
from fcu_emulator.emulator.grading.build import Builder
from fcu_emulator.emulator.grading.grading import Grader
from fcu_emulator.emulator.grading.results import GradedClass
from fcu_emulator.emulator.grading.rubric import load_rubric
from fcu_emulator.emulator.grading.store import Store
from fcu_emulator.emulator.grading.submissions import find_submissions
from fcu_emulator.emulator.grading.tasks import Task, code_digest, judge_task
from fcu_emulator.emulator.grading.workers import LocalWorkers
from fcu_emulator.firmware_model.arm import prebuilt
from tests.grading.test_build import needs_compiler, needs_sandbox
from tests.support.words import Words

RUBRIC = """
schema = 1
title = "A little lab"

[run.still]
question = "What is printed?"
duration = "1.2s"

[[exercise]]
id = "1"
title = "Sensors"
run = "still"
[[exercise.check]]
id = "acc"
title = "The accelerometer is printed"
expect = [{ kind = "field", name = "ACC.z", value = 1000, tolerance = 150 }]
[[exercise.check]]
id = "warnings"
title = "The compiler has no warnings"
points = 0
expect = [{ kind = "no_warnings" }]

[[exercise]]
id = "2"
title = "Angles"
run = "still"
[[exercise.check]]
id = "pitch"
title = "Pitch is printed"
points = 2
visible = "after_due_date"
hint = "Print what eCompass computes."
expect = [{ kind = "field", name = "Pitch", truth = true, tolerance = 8 }]
"""


@pytest.fixture
def out(kept: Path, tmp_path: Path) -> Path:
    """Return the folder of the reports; the two programs have been judged before."""
    shutil.copytree(kept, tmp_path / "out" / "kept")
    return tmp_path / "out"


@pytest.fixture
def rubric(tmp_path: Path) -> Path:
    path = tmp_path / "little.toml"
    path.write_text(RUBRIC, encoding="utf-8")
    return path


@pytest.fixture
def submissions(tmp_path: Path) -> Path:
    """Return a folder with the solution, the template, and other submissions."""
    folder = tmp_path / "submissions"
    for name, program in (("ada", "solution"), ("bob", "template")):
        (folder / name).mkdir(parents=True)
        shutil.copyfile(prebuilt(program), folder / name / "lab3.elf")
    (folder / "empty").mkdir()
    (folder / "text.elf").write_text("this is no program")
    x86 = bytearray(prebuilt("solution").read_bytes())
    x86[18] = 0x3E  # e_machine: x86-64
    (folder / "chip.elf").write_bytes(x86)
    with zipfile.ZipFile(folder / "out.zip", "w") as target:
        target.writestr("../../evil.elf", b"x")
    with zipfile.ZipFile(folder / "bomb.zip", "w", zipfile.ZIP_DEFLATED) as target:
        target.writestr("lab3.elf", bytes(80 << 20))
    return folder


@pytest.fixture(scope="module")
def kept(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the stored verdicts of the two programs, which later runs find."""
    folder = tmp_path_factory.mktemp("kept")
    (folder / "little.toml").write_text(RUBRIC, encoding="utf-8")
    for name, program in (("ada", "solution"), ("bob", "template")):
        (folder / "submissions" / name).mkdir(parents=True)
        shutil.copyfile(prebuilt(program), folder / "submissions" / name / "lab3.elf")
    assert grade(folder / "submissions", "--rubric", folder / "little.toml", "--out", folder / "out") == 0
    return folder / "out" / "kept"


def grade(*arguments: object) -> int:
    return int(execute(["grade", *map(str, arguments), "--jobs", "1"]))


def table(out: Path) -> dict[str, dict[str, str]]:
    with (out / "grades.csv").open(encoding="utf-8-sig", newline="") as file:
        return {row["id"]: row for row in csv.DictReader(file)}


def test_bad_submission_affects_only_its_own_result(
    submissions: Path,
    rubric: Path,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
    words: Words,
) -> None:
    monkeypatch.setattr("fcu_emulator.emulator.cli.grade.monotonic", lambda: 0.0)
    out = tmp_path / "out"
    before = set(tmp_path.iterdir())

    assert grade(submissions, "--rubric", rubric, "--out", out) == 0
    assert set(tmp_path.iterdir()) - before == {out}
    found = table(out)
    assert {name: row["points"] for name, row in found.items() if row["points"]} == {"ada": "3", "bob": "1"}
    reasons = {name: row["reason"] for name, row in found.items() if row["status"] == "rejected"}
    assert reasons.keys() == {"empty", "text", "chip", "out", "bomb"}
    assert "outside of the archive" in reasons["out"]
    assert "must unpack to at most" in reasons["bomb"]
    assert "x86-64" in reasons["chip"]
    assert str(tmp_path) not in json.dumps(found)
    whole = GradedClass.from_json((out / "grade.json").read_bytes())
    assert [one.id for one in whole.submissions] == sorted(found)
    assert len({one.seed for one in whole.submissions if one.status == "judged"}) == 2
    for name in found:
        assert (out / "students" / f"{name}.html").is_file()
    page = (out / "students" / "bob.html").read_text(encoding="utf-8")
    assert "Print what eCompass computes." in page
    said = capsys.readouterr()
    assert said.out.endswith(f": {out / 'index.html'}\n")
    words("grade", said.out)
    assert said.err == ""  # no time has passed


def test_progress_of_class_is_logged(
    rubric: Path,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
    words: Words,
) -> None:
    """Lines come for each tenth of the class, at least ten seconds apart, and after two minutes without a line."""
    folder = tmp_path / "submissions"
    folder.mkdir()
    for number in range(20):
        (folder / f"{number}.elf").write_text("this is no program")
    took_s = [0.5] * 8 + [8] + [10] * 3 + [130] + [0.1] * 7
    clock_s = itertools.accumulate(took_s, initial=0)
    monkeypatch.setattr("fcu_emulator.emulator.cli.grade.monotonic", lambda: next(clock_s))

    assert grade(folder, "--rubric", rubric, "--out", tmp_path / "out") == 0
    said = capsys.readouterr().err
    assert [re.findall(r"\d+", line) for line in said.splitlines()] == [
        ["9", "20", "12"],
        ["10", "20", "22"],
        ["12", "20", "42"],
        ["13", "20", "172"],
    ]
    words("grade", said)


def test_second_run_uses_stored_verdicts_with_new_hints(
    submissions: Path, rubric: Path, out: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    grade(submissions, "--rubric", rubric, "--out", out)
    first = table(out)
    before = (out / "students" / "bob.html").read_text(encoding="utf-8")
    monkeypatch.setattr(LocalWorkers, "submit", None)  # nothing is judged any more
    kept = {path: path.stat().st_mtime_ns for path in (out / "kept" / "verdicts").rglob("*.json")}
    assert len(kept) == 2
    shutil.rmtree(submissions / "empty")
    for name in ("text.elf", "chip.elf", "out.zip", "bomb.zip"):
        (submissions / name).unlink()
    assert grade(submissions, "--rubric", rubric, "--out", out) == 0
    assert {name: row["points"] for name, row in table(out).items()} == {"ada": "3", "bob": "1"}
    assert (out / "students" / "bob.html").read_text(encoding="utf-8") == before
    assert first["ada"] == table(out)["ada"]

    rubric.write_text(
        RUBRIC.replace("Print what", "Show what").replace("Pitch is", "Pitch must be"), encoding="utf-8"
    )
    assert grade(submissions, "--rubric", rubric, "--out", out) == 0
    page = (out / "students" / "bob.html").read_text(encoding="utf-8")
    assert "Show what eCompass computes." in page
    assert "Pitch must be printed" in page
    assert {path: path.stat().st_mtime_ns for path in kept} == kept

    rubric.write_text(RUBRIC.replace("tolerance = 8", "tolerance = 7.9"), encoding="utf-8")
    assert grade(submissions, "--rubric", rubric, "--out", out) == 4  # it would have to be judged anew


def test_roster_determines_order_and_missing_students(
    submissions: Path, rubric: Path, out: Path, tmp_path: Path
) -> None:
    roster = tmp_path / "roster.csv"
    roster.write_text(
        'id,name,email,submission\n7,"Bob <b>\nB",b@x.org,bob\n9,Zoë,z@x.org,\n', encoding="utf-8"
    )
    grade(submissions, "--rubric", rubric, "--out", out, "--roster", roster)
    found = table(out)

    assert list(found)[:2] == ["7", "9"]
    assert found["7"]["name"] == "Bob <b>\\x0aB"
    assert found["7"]["points"] == "1"
    assert found["9"]["status"] == "missing"
    assert found["9"]["points"] == ""
    assert found["ada"]["points"] == "3"
    assert [found[who]["on_roster"] for who in ("7", "9", "ada")] == ["yes", "yes", "no"]
    assert "roster" in (out / "index.html").read_text(encoding="utf-8")


def test_anonymous_reports_contain_no_names(
    submissions: Path, rubric: Path, out: Path, tmp_path: Path
) -> None:
    roster = tmp_path / "roster.csv"
    roster.write_text("id,name,email,submission\n17-4711,Bob Bobson,bob@x.org,bob\n", encoding="utf-8")
    grade(submissions, "--rubric", rubric, "--out", out, "--roster", roster)
    grade(submissions, "--rubric", rubric, "--out", out, "--roster", roster, "--anonymous")
    files = [path for path in out.rglob("*") if path.is_file() and "kept" not in path.parts]
    programs = {"17-4711": "template", "ada": "solution"}
    salt = (out / "kept" / "salt.key").read_bytes()
    seeds = [str(seed_of(rubric, *one, salt)) for one in programs.items()]

    assert len(files) == 4 + 7 + 2
    for path in files:
        text = path.name + path.read_text(encoding="utf-8")
        names = ("4711", "Bob", "bob", "ada")  # whole words: a pseudonym is drawn, and may have "ada" in it
        assert not [name for name in names if re.search(rf"\b{name}\b", text)], path
        assert not [seed for seed in seeds if seed in text], path
    key = (out / "kept" / "who-is-who.csv").read_text(encoding="utf-8")
    assert "17-4711,Bob Bobson" in key
    assert sorted(row["points"] for row in table(out).values() if row["points"]) == ["1", "3"]


def test_students_see_less_before_due_date(
    submissions: Path, rubric: Path, out: Path, tmp_path: Path
) -> None:
    grade(submissions, "--rubric", rubric, "--out", out, "--before-due-date")

    assert "Pitch" not in (out / "students" / "bob.html").read_text(encoding="utf-8").partition("<pre>")[0]
    assert table(out)["bob"]["points"] == "1"


# -- what goes wrong around a program is not the program's --------------------------------------------------


class Killed(LocalWorkers):
    """Workers in which the process of one student's task is killed each time."""

    def submit(self, fn, /, *args, **kwargs):  # type: ignore[no-untyped-def]
        return super().submit(kill_worker if args[0].seed == self.victim else fn, *args)


def kill_worker(task: Task) -> str:
    os.kill(os.getpid(), signal.SIGKILL)
    return ""


def grader(workers: LocalWorkers, rubric: Path, kept: Path | None = None) -> Grader:
    loaded = load_rubric(rubric)
    store = Store(kept, loaded) if kept else None
    return Grader(loaded, str(rubric), workers, workers.slots, lambda: Builder(sandbox=False), SALT, store)


SALT = b"known to the tests"


def seed_of(rubric: Path, student: str, program: str, salt: bytes = SALT) -> int:
    """Return the seed of a student who submits a shipped program."""
    return load_rubric(rubric).seed_for(student, prebuilt(program).read_bytes(), salt)


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no SIGKILL")
def test_killed_worker_leaves_one_submission_unjudged(
    submissions: Path, rubric: Path, tmp_path: Path
) -> None:
    found = find_submissions(submissions, None, tmp_path / "s")
    with Killed(2) as workers:
        workers.victim = seed_of(rubric, "bob", "template")  # type: ignore[attr-defined]
        results = {one.id: one for _, one in grader(workers, rubric, tmp_path / "kept").grade(found)}

    assert results["ada"].points == 3
    assert results["bob"].status == "unjudged"
    assert results["bob"].points is None
    assert "(SIGKILL)" in results["bob"].reason
    with LocalWorkers(1) as workers:
        again = {one.id: one for _, one in grader(workers, rubric, tmp_path / "kept").grade(found)}
    assert again["bob"].points == 1


def test_interrupted_grading_can_be_resumed(submissions: Path, rubric: Path, tmp_path: Path) -> None:
    found = find_submissions(submissions, None, tmp_path / "s")
    workers = LocalWorkers(1)
    with closing(grader(workers, rubric, tmp_path / "kept").grade(found)) as running:
        next(one for _, one in running if one.status == "judged")

    assert workers.pids == []
    assert len(list((tmp_path / "kept").rglob("*.json"))) == 1
    with LocalWorkers(1) as workers:
        results = [one for _, one in grader(workers, rubric, tmp_path / "kept").grade(found)]
    assert len([one for one in results if one.status == "judged"]) == 2


def test_submission_with_damaged_stored_verdict_is_judged_again(
    submissions: Path, rubric: Path, out: Path, tmp_path: Path
) -> None:
    grade(submissions, "--rubric", rubric, "--out", out)
    for number, path in enumerate((out / "kept" / "verdicts").rglob("*.json")):
        path.write_bytes(path.read_bytes()[:100] if number else b"\xff")

    assert grade(submissions, "--rubric", rubric, "--out", out) == 0
    assert {row["points"] for row in table(out).values()} == {"3", "1", ""}


def test_worker_of_other_version_or_rubric_is_refused(rubric: Path) -> None:
    digest = load_rubric(rubric).digest
    task = Task(prebuilt("template").read_bytes(), "a.elf", str(rubric), digest, 1, code_digest())
    for changed, kind in (("code", "version_differs"), ("rubric_digest", "rubric_differs")):
        with pytest.raises(NotJudgedError) as refused:
            judge_task(Task(**{**vars(task), changed: "another"}))
        assert refused.value.kind == kind


def test_missing_c_library_is_machine_fault(rubric: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    digest = load_rubric(rubric).digest
    task = Task(prebuilt("template").read_bytes(), "a.elf", str(rubric), digest, 1, code_digest())

    def missing() -> None:
        raise InputError("no library", kind="no_library")

    monkeypatch.setattr(library, "load", missing)

    with pytest.raises(NotJudgedError) as refused:
        judge_task(task)
    assert refused.value.kind == "no_library"


# -- source -------------------------------------------------------------------------------------------------


@needs_compiler
@needs_sandbox
def test_source_is_built_and_warnings_are_reported(rubric: Path, tmp_path: Path) -> None:
    template = (prebuilt("template").parents[1] / "template" / "main.c").read_text(encoding="utf-8")
    folder = tmp_path / "submissions"
    for name, source in (
        ("ada", template + "\nstatic int unused;\n"),
        ("eve", "int main(void) { return x; }"),
    ):
        (folder / name).mkdir(parents=True)
        (folder / name / "main.c").write_text(source, encoding="utf-8")
        (folder / name / "Makefile").write_text("all:\n\ttouch " + str(tmp_path / "owned"))
    out = tmp_path / "out"

    assert grade(folder, "--rubric", rubric, "--out", out) == 0
    assert not (tmp_path / "owned").exists()
    found = table(out)
    assert found["ada"]["points"] == "1"
    assert found["eve"]["status"] == "rejected"
    assert "does not compile: main.c:1:25: error: 'x' undeclared" in found["eve"]["reason"]
    assert "defined but not used" in (out / "students" / "ada.html").read_text(encoding="utf-8")


@needs_compiler
@needs_sandbox
@pytest.mark.parametrize("option", [(), ("--build-without-sandbox",)])
def test_source_reads_machine_files_only_without_sandbox(
    option: tuple[str, ...], rubric: Path, tmp_path: Path
) -> None:
    folder = tmp_path / "submissions"
    (folder / "eve").mkdir(parents=True)
    (folder / "eve" / "main.c").write_text('#include "/etc/passwd"\n', encoding="utf-8")
    out = tmp_path / "out"

    assert grade(folder, "--rubric", rubric, "--out", out, *option) == 0
    (eve,) = table(out).values()
    assert eve["status"] == "rejected"
    assert ("No such file" in eve["reason"]) is (not option)


def test_missing_compiler_affects_only_source_submissions(
    submissions: Path,
    rubric: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    (submissions / "carl.c").write_text("int main(void) { return 0; }")
    monkeypatch.setenv("PATH", "/nowhere")

    assert grade(submissions, "--rubric", rubric, "--out", tmp_path / "out") == 4
    found = table(tmp_path / "out")
    assert found["carl"]["status"] == "unjudged"
    assert "sudo apt install" in found["carl"]["reason"]
    assert {name: row["points"] for name, row in found.items() if row["points"]} == {"ada": "3", "bob": "1"}
    assert (
        grade(submissions, "--rubric", rubric, "--out", tmp_path / "out", "--submission-type", "firmware")
        == 0
    )


@pytest.mark.parametrize(
    "arguments",
    [
        ["nowhere", "--out", "o"],
        [],
        ["."],
        ["--gradescope", "--autograder", "nowhere"],
        [".", "--out", "o", "--roster", "nowhere"],
    ],
)
def test_wrong_arguments_are_explained(
    arguments: list[str],
    words: Words,
    rubric: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)

    assert grade(*arguments, "--rubric", rubric) == 2
    words("grade", capsys.readouterr().err.replace(os.sep, "/"))
