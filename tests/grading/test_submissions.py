"""Assignment of submissions to students, and selection of the program in each submission."""

from __future__ import annotations

import os
import sys
import zipfile
from pathlib import Path
from tempfile import mkdtemp

import pytest

from fcu_emulator.emulator.errors import InputError
from fcu_emulator.emulator.grading.roster import Roster, Student, load_roster
from fcu_emulator.emulator.grading.submissions import (
    RejectedError,
    Submission,
    SubmittedFirmware,
    SubmittedSource,
    find_submissions,
)
from tests.support.words import Words

ELF = b"\x7fELF one"


def tree(folder: Path, **files: bytes) -> Path:
    for name, data in files.items():
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(data)
    return folder


def zipped(path: Path, **files: bytes) -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    with zipfile.ZipFile(path, "w") as target:
        for name, data in files.items():
            target.writestr(name, data)
    return path


def only(where: Path, scratch: Path) -> Submission:
    (found,) = find_submissions(where, None, scratch)
    return found


def content(where: Path, take: str | None = None) -> SubmittedFirmware | SubmittedSource:
    scratch = Path(mkdtemp(dir=where.parent))
    return only(where, scratch / "class").content(scratch / "one", take)  # type: ignore[arg-type]


def refusal(where: Path, take: str | None = None) -> RejectedError:
    with pytest.raises(RejectedError) as refused:
        content(where, take)
    assert str(refused.value).isprintable()
    return refused.value


# -- what ---------------------------------------------------------------------------------------------------


def test_submitted_source_is_main_and_neighbouring_files(tmp_path: Path) -> None:
    where = tree(
        tmp_path / "class",
        **{
            "ada/lab/main.c": b"1",
            "ada/lab/angles.c": b"2",
            "ada/lab/angles.h": b"3",
            "ada/lab/Makefile": b"all: ; rm -rf /",
            "ada/lab/support/board.c": b"4",
            "ada/lab/build/I2C2/lab3.elf": ELF,
            "ada/__MACOSX/lab/main.c": b"5",
            "ada/lab/.git/main.c": b"6",
        },
    )
    found = content(where)

    assert isinstance(found, SubmittedSource)
    assert found.files == {"main.c": b"1", "angles.c": b"2", "angles.h": b"3"}


def test_source_is_preferred_unless_firmware_is_requested(tmp_path: Path) -> None:
    where = tree(tmp_path / "class", **{"ada/main.c": b"1", "ada/lab3.elf": ELF})

    assert isinstance(content(where), SubmittedSource)
    assert content(where, "firmware") == SubmittedFirmware("lab3.elf", ELF)


@pytest.mark.parametrize(
    ("name", "built"), [("my-program.c", "my-program.c"), ("my program.c", "main.c"), ("LAB.C", "main.c")]
)
def test_single_c_file_is_program(name: str, built: str, tmp_path: Path) -> None:
    found = content(tree(tmp_path / "class", **{f"ada/{name}": b"1", "ada/notes.txt": b""}))

    assert isinstance(found, SubmittedSource)
    assert found.files == {built: b"1"}


def test_one_build_in_several_forms_is_one_program(tmp_path: Path) -> None:
    where = tree(
        tmp_path / "class", **{"ada/a.bin": b"x", "ada/a.hex": b":", "ada/a.elf": ELF, "ada/Debug/b.elf": ELF}
    )
    found = content(where)

    assert isinstance(found, SubmittedFirmware)
    assert found.data == ELF


@pytest.mark.parametrize("name", ["ada.c", "ada.elf", "ada.hex", "ada.bin", "ada.ELF"])
def test_submission_may_be_single_file(name: str, tmp_path: Path) -> None:
    where = tree(tmp_path / "class", **{name: b"data"})

    assert only(where, tmp_path / "s").student.id == "ada"
    assert content(where) in (SubmittedSource({"main.c": b"data"}), SubmittedFirmware(name, b"data"))


def test_archive_in_folder_is_unpacked(tmp_path: Path) -> None:
    where = tmp_path / "class"
    zipped(where / "ada.zip", **{"lab/main.c": b"1"})
    assert content(where) == SubmittedSource({"main.c": b"1"})

    zipped(tmp_path / "zips" / "ada.zip", **{"lab/lab.zip": (where / "ada.zip").read_bytes()})
    assert content(tmp_path / "zips") == SubmittedSource({"main.c": b"1"})

    other = tmp_path / "other"
    zipped(other / "ada" / "lab.zip", **{"lab/main.c": b"1"})
    assert content(other) == SubmittedSource({"main.c": b"1"})


@pytest.mark.parametrize(
    ("files", "kind"),
    [
        ({"ada/notes.txt": b""}, "no_program"),
        ({"ada/one/main.c": b"1", "ada/two/main.c": b"2"}, "several"),
        ({"ada/a.elf": b"1", "ada/b.elf": b"2"}, "several"),
        ({"ada/lab.rar": b"Rar!"}, "archive_type"),
        ({"ada/main.cpp": b"1"}, "language"),
        ({"ada.7z": b"7z"}, "archive_type"),
        ({"ada/main.c": b"1", "ada/a b.c": b"2"}, "file_name"),
        ({"ada/main.c": b"1", "ada/-o.c": b"2"}, "file_name"),
        ({"ada/main.c": bytes(5 << 20)}, "too_large"),
        ({"ada/main.c": "int x;".encode("utf-16")}, "encoding"),
    ],
)
def test_unusable_submission_is_refused_with_reason(
    files: dict[str, bytes], kind: str, tmp_path: Path, words: Words
) -> None:
    refused = refusal(tree(tmp_path / "class", **files))

    assert refused.kind == kind
    words("grade", str(refused))


def test_hostile_archive_affects_only_its_own_submission(tmp_path: Path, words: Words) -> None:
    where = tree(tmp_path / "class", **{"ada/main.c": b"1"})
    zipped(where / "eve.zip", **{"../../main.c": b"2"})
    ada, eve = find_submissions(where, None, tmp_path / "s")

    assert isinstance(ada.content(tmp_path / "s1"), SubmittedSource)
    with pytest.raises(RejectedError) as refused:
        eve.content(tmp_path / "s2")
    assert refused.value.kind == "leads_out"
    words("grade", str(refused.value))


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="this system has no named pipes")
def test_links_and_pipes_are_not_followed(tmp_path: Path) -> None:
    secret = tree(tmp_path, **{"secret/main.c": b"secret"}) / "secret"
    where = tree(tmp_path / "class", **{"bob/notes.txt": b"", "eve/notes.txt": b""})
    (where / "ada").symlink_to(secret)
    (where / "bob" / "main.c").symlink_to(secret / "main.c")
    os.mkfifo(where / "eve" / "main.c")
    kinds = {}
    for submission in find_submissions(where, None, tmp_path / "s"):
        with pytest.raises(RejectedError) as refused:
            submission.content(tmp_path / "s")
        kinds[submission.student.id] = refused.value.kind

    assert kinds == {"ada": "link", "bob": "no_program", "eve": "no_program"}


def test_digest_depends_on_names_and_contents() -> None:
    sources = [{"main.c": b"ab"}, {"main.c": b"a", "b.c": b""}, {"main.cb": b"a"}, {"main.c": b"a"}]

    assert len({SubmittedSource(one).digest for one in sources}) == len(sources)


# -- who ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "stolen",
    [
        "Eve_4242_assignsubmission_file_x_1815_assignsubmission_file_.c",  # by a file's name
        "Eve_1815_assignsubmission_file__4242_assignsubmission_file_x.c",  # by a name in the wiring
        "eve_4242_1_x_1815_assignsubmission_file_.c",  # Moodle's id in the name of a file on Canvas
    ],
)
def test_name_with_two_ids_is_rejected(tmp_path: Path, stolen: str) -> None:
    own = "Ada_1815_assignsubmission_file_main.c"
    where = tree(tmp_path / "class", **{stolen: b"1", own: b"2"})
    roster = Roster([Student("1815", "Ada"), Student("4242", "Eve")])
    found = {one.student.id: one for one in find_submissions(where, roster, tmp_path / "s")}

    assert found["1815"].path == where / own
    assert found["1815"].problem == ""
    assert found["4242"].path is None
    thief = found[stolen.removesuffix(".c")]
    assert not thief.known
    with pytest.raises(RejectedError, match="one id"):
        thief.content(tmp_path / "s")


@pytest.mark.parametrize("suffix", ["c", "h"])
def test_file_with_another_platform_id_is_not_added(suffix: str, tmp_path: Path) -> None:
    files = {
        "Ada_1815_assignsubmission_file_main.c": b"1",
        f"Ada_777_assignsubmission_file_x.{suffix}": b"2",
    }
    where = tree(tmp_path / "class", **files)
    roster = Roster([Student("1815", "Ada")])
    found = {one.student.id: one for one in find_submissions(where, roster, tmp_path / "s")}
    other = f"Ada_777_assignsubmission_file_x.{suffix}"

    assert found.pop("1815").path == where / "Ada_1815_assignsubmission_file_main.c"
    ((name, rejected),) = found.items()
    assert name == other.removesuffix(f".{suffix}")
    with pytest.raises(RejectedError, match="another submission"):
        rejected.content(tmp_path / "s")


def test_moodle_folders_are_recognised_by_number_and_name(tmp_path: Path) -> None:
    where = tree(tmp_path / "class", **{"Ada Lovelace_1815_assignsubmission_file_/main.c": b"1"})
    found = only(where, tmp_path / "s")
    assert (found.student.id, found.student.name) == ("1815", "Ada Lovelace")

    for key in ("Participant 1815,x", "1815,x", "7,Ada Lovelace"):
        roster = tmp_path / "roster.csv"
        roster.write_text(f"Identifier,Full name,Email address\n{key},ada@example.org\n", encoding="utf-8")
        (found,) = find_submissions(where, load_roster(roster), tmp_path / "s")
        assert found.known
        assert found.student.email == "ada@example.org"


def test_gradescope_folders_are_recognised_by_table(tmp_path: Path) -> None:
    pytest.importorskip("yaml")
    where = tree(tmp_path / "class", **{"submission_77/main.c": b"1", "submission_78/main.c": b"1"})
    (where / "submission_metadata.yml").write_text(
        "submission_77:\n  :submitters:\n  - :name: Ada Lovelace\n    :sid: '1815'\n    :email: a@b.org\n"
    )
    first, second = find_submissions(where, None, tmp_path / "s")

    assert (first.student.id, first.student.name) == ("1815", "Ada Lovelace")
    assert second.student.id == "78"


def test_class_may_be_one_archive(tmp_path: Path) -> None:
    file = zipped(tmp_path / "class.zip", **{"ada/main.c": b"1", "bob/main.c": b"2"})

    assert [one.student.id for one in find_submissions(file, None, tmp_path / "s")] == ["ada", "bob"]


def test_roster_determines_order_and_missing_submissions(tmp_path: Path, words: Words) -> None:
    where = tree(tmp_path / "class", **{"ada/main.c": b"1", "x/main.c": b"1", "zoe@example.org/main.c": b"2"})
    roster = tmp_path / "roster.csv"
    roster.write_text("id,email\n9,zoe@example.org\nbob,\nada,\n")
    found = find_submissions(where, load_roster(roster), tmp_path / "s")

    known = [(one.student.id, one.known) for one in found]
    assert known == [("9", True), ("bob", True), ("ada", True), ("x", False)]
    assert (found[1].path, found[1].entries) == (None, ())
    with pytest.raises(RejectedError):
        found[1].content(tmp_path / "s")
    words("grade", found[1].problem)


def test_two_submissions_of_one_student_are_rejected(tmp_path: Path, words: Words) -> None:
    where = tree(tmp_path / "class", **{"ada/main.c": b"1", "ada.elf": ELF})

    words("grade", str(refusal(where)))


def test_folder_without_submissions_is_usage_error(tmp_path: Path) -> None:
    (tmp_path / "empty").mkdir()
    for name, kind in (("empty", "no_submissions"), ("nowhere", "no_such_folder")):
        with pytest.raises(InputError) as refused:
            find_submissions(tmp_path / name, None, tmp_path / "s")
        assert refused.value.kind == kind


@pytest.mark.parametrize("with_roster", [False, True])
def test_every_submitted_file_is_in_result(tmp_path: Path, with_roster: bool) -> None:
    names = ["main.txt", "olaf.cpp", "pia.ino", "Ada_1_assignsubmission_file_report.pdf", "README", "eve.c"]
    where = tree(
        tmp_path / "class", **dict.fromkeys(names, b"int x;"), **{".DS_Store": b"", "Thumbs.db": b""}
    )
    roster = Roster([Student("pia"), Student("zoe")]) if with_roster else None
    found = find_submissions(where, roster, tmp_path / "s")

    handed_in = {one.path.name: one for one in found if one.path is not None}
    assert set(handed_in) == set(names)
    assert [one.student.id for one in found if one.path is None] == (["zoe"] if with_roster else [])
    for name, one in handed_in.items():
        assert one.known is (one.student.id == "pia" if with_roster else None)
        if name != "eve.c":
            with pytest.raises(RejectedError, match="hand in"):
                one.content(tmp_path / "s")


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no such files")
def test_pipe_is_rejected_without_waiting(tmp_path: Path) -> None:
    (tmp_path / "class").mkdir()
    os.mkfifo(tmp_path / "class" / "eve.c")
    (found,) = find_submissions(tmp_path / "class", None, tmp_path / "s")

    with pytest.raises(RejectedError):
        found.content(tmp_path / "s")


def test_gradescope_export_without_yaml_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    where = tree(tmp_path, **{"submission_1/main.c": b"", "submission_metadata.yml": b"{}"})
    monkeypatch.setitem(sys.modules, "yaml", None)

    with pytest.raises(InputError) as refused:
        find_submissions(where, None, tmp_path / "s")
    assert refused.value.kind == "not_installed"
    assert "PyYAML" in str(refused.value)


FLAT = {
    "moodle": ("Ada Lovelace_1815_assignsubmission_file_{}", "Bob_1816_assignsubmission_file_{}"),
    "canvas": ("lovelaceada_1815_7{n}_{}", "boolegeorge_LATE_1816_8{n}_{}"),
    "blackboard": (
        "Lab_3_1815_attempt_2026-11-20-10-11-12_{}",
        "Lab_3_1816_attempt_2026-11-21-08-00-00_{}",
    ),
}


def flat(pattern: str, files: dict[str, bytes]) -> dict[str, bytes]:
    """Return the files of one student in a platform's folder for all students."""
    return {pattern.format(name, n=n): data for n, (name, data) in enumerate(files.items())}


@pytest.mark.parametrize("platform", FLAT)
def test_files_in_flat_folder_are_one_submission(tmp_path: Path, platform: str) -> None:
    ada, bob = FLAT[platform]
    files = {"main.c": b"1", "motion.c": b"2", "motion.h": b"3", "report.pdf": b"4"}
    where = tree(tmp_path / "class", **flat(ada, files), **flat(bob, {"lab3.elf": ELF}))
    found = {one.student.id: one for one in find_submissions(where, None, tmp_path / "s")}

    assert set(found) == {"1815", "1816"}
    scratch = Path(mkdtemp(dir=tmp_path))
    source = found["1815"].content(scratch)
    assert isinstance(source, SubmittedSource)
    assert source.files == {"main.c": b"1", "motion.c": b"2", "motion.h": b"3"}
    program = found["1816"].content(Path(mkdtemp(dir=tmp_path)))
    assert isinstance(program, SubmittedFirmware)
    assert program.data == ELF
