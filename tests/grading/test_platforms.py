"""Downloads of learning platforms, and folders that were collected by hand: each student is one submission."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from tempfile import mkdtemp

import pytest

from fcu_emulator.emulator.grading.roster import Roster, Student
from fcu_emulator.emulator.grading.submissions import (
    RejectedError,
    Submission,
    SubmittedSource,
    find_submissions,
)
from tests.grading.test_submissions import tree
from tests.support.layouts import LAYOUTS, Handed, write_gradescope, write_ilias_teams
from tests.support.words import Words

ADA = Handed(
    "1815", "Ada", "Lovelace", {"main.c": b"1", "motion.c": b"2", "motion.h": b"3", "notes.txt": b"4"}
)
BOB = Handed("1816", "Bob", "von Neumann", {"lab.c": b"5"})
ROSTER = Roster(
    [Student("1815", "Ada Lovelace", "ada@x.org"), Student("1816", "Bob von Neumann"), Student("7", "Zoe Z")]
)


def found(where: Path, roster: Roster | None = None) -> dict[str, Submission]:
    scratch = Path(mkdtemp(dir=where.parent))
    return {one.student.id: one for one in find_submissions(where, roster, scratch)}


def source(one: Submission, where: Path) -> dict[str, bytes]:
    program = one.content(Path(mkdtemp(dir=where.parent)))
    assert isinstance(program, SubmittedSource)
    return dict(program.files)


@pytest.mark.parametrize("with_roster", [False, True])
@pytest.mark.parametrize("layout", LAYOUTS.values(), ids=LAYOUTS)
def test_layout_gives_one_submission_per_student(
    layout: Callable[[Path, list[Handed]], Path], with_roster: bool, tmp_path: Path
) -> None:
    where = layout(tmp_path / "class", [ADA, BOB])
    all_found = found(where, ROSTER if with_roster else None)

    assert all_found.keys() == ({"1815", "1816", "7"} if with_roster else {"1815", "1816"})
    assert source(all_found["1815"], tmp_path) == {"main.c": b"1", "motion.c": b"2", "motion.h": b"3"}
    assert source(all_found["1816"], tmp_path) == {"lab.c": b"5"}
    assert {one.known for one in all_found.values()} == {True if with_roster else None}


@pytest.mark.parametrize("layout", LAYOUTS.values(), ids=LAYOUTS)
def test_layout_lists_students_not_on_roster(
    layout: Callable[[Path, list[Handed]], Path], tmp_path: Path
) -> None:
    all_found = found(layout(tmp_path / "class", [ADA, BOB]), Roster([Student("1815", "Ada Lovelace")]))

    assert [one.known for one in all_found.values()] == [True, False]
    assert source(all_found["1816"], tmp_path) == {"lab.c": b"5"}


def test_blackboard_text_resolves_login_with_underscores(tmp_path: Path) -> None:
    head = "Lab_3_a_lovelace_attempt_2026-11-20-10-11-12"
    where = tree(tmp_path / "class", **{f"{head}_main.c": b"1", f"{head}.txt": b"Name: Ada L (a_lovelace)\n"})
    one = found(where)["a_lovelace"]

    assert (one.student.name, source(one, tmp_path)) == ("Ada L", {"main.c": b"1"})


def test_latest_blackboard_attempt_is_judged_with_note(tmp_path: Path) -> None:
    names = [f"Lab_ada_attempt_2026-11-{day}-10-11-12_main.c" for day in (20, 21)]
    where = tree(tmp_path / "class", **{names[1]: b"new", names[0]: b"old"})
    one = found(where)["ada"]

    assert source(one, tmp_path) == {"main.c": b"new"}
    assert one.files == tuple(names)
    assert "2 attempts" in one.note


@pytest.mark.parametrize(
    "stolen",
    [
        "Lab_eve_attempt_2026-11-20-10-11-12_Lab_ada_attempt_2026-11-20-10-11-12_main.c",
        "Lab_eve_attempt_2026-11-20-10-11-12_x_attempt_2026-11-20-10-11-12.txt",
    ],
)
def test_name_with_two_attempts_is_rejected(tmp_path: Path, stolen: str) -> None:
    own = "Lab_ada_attempt_2026-11-20-10-11-12_main.c"
    where = tree(tmp_path / "class", **{stolen: b"1", own: b"2"})
    all_found = found(where, Roster([Student("ada"), Student("eve")]))

    assert all_found["ada"].files == (own,)
    assert all_found["eve"].path is None
    with pytest.raises(RejectedError, match="one attempt"):
        all_found[stolen.rpartition(".")[0]].content(tmp_path)


def test_blackboard_text_cannot_name_another_student(tmp_path: Path) -> None:
    files = {"Lab_eve_attempt_2026-11-20-10-11-12.txt": b"Name: Ada (ada)\n"}
    files |= {
        "Lab_eve_attempt_2026-11-20-10-11-12_main.c": b"1",
        "Lab_ada_attempt_2026-11-20-10-11-13_main.c": b"2",
    }
    all_found = found(tree(tmp_path / "class", **files))

    assert set(all_found) == {"ada", "eve"}
    assert source(all_found["ada"], tmp_path) == {"main.c": b"2"}


def test_participant_number_equal_to_another_id_is_rejected(tmp_path: Path) -> None:
    """Participant numbers of Moodle are not the ids of the roster."""
    name = "Eve Ewe_1815_assignsubmission_file_main.c"
    roster = Roster([Student("1815", "Ada Lovelace"), Student("4242", "Eve Ewe")])
    all_found = found(tree(tmp_path / "class", **{name: b"1"}), roster)

    assert all_found["1815"].path is None
    with pytest.raises(RejectedError, match=r"Ada Lovelace \(1815\) or Eve Ewe \(4242\)"):
        all_found[name.removesuffix(".c")].content(tmp_path)


def test_file_with_name_of_another_student_is_rejected(tmp_path: Path) -> None:
    own, other = "Ada_1815_assignsubmission_file_main.c", "Ada_99_assignsubmission_file_main.c"
    all_found = found(tree(tmp_path / "class", **{own: b"1", other: b"2"}), Roster([Student("1815", "Ada")]))

    assert source(all_found["1815"], tmp_path) == {"main.c": b"1"}
    with pytest.raises(RejectedError, match="the name of Ada"):
        all_found[other.removesuffix(".c")].content(tmp_path)


def test_ambiguous_ilias_login_is_rejected(tmp_path: Path, words: Words) -> None:
    names = ("Ewe_Eve_ada_eve_9", "Lovelace_Ada_ada_8")
    where = tree(tmp_path / "class", **{f"{name}/main.c": b"1" for name in names})
    all_found = found(where, Roster([Student("ada_eve"), Student("eve"), Student("ada")]))

    assert all_found["ada"].files == (names[1],)
    assert all_found["eve"].path is all_found["ada_eve"].path is None
    with pytest.raises(RejectedError):
        all_found[names[0]].content(tmp_path)
    words("grade", all_found[names[0]].problem)


def test_ilias_late_marks_are_removed_from_names(tmp_path: Path) -> None:
    files = {"main.c": b"1", "Late Submission - motion.c": b"2", "Verspaetete Abgabe - motion.h": b"3"}
    where = tree(tmp_path / "class", **{f"Lovelace_Ada_ada_8/{name}": data for name, data in files.items()})

    assert source(found(where)["8"], tmp_path) == {"main.c": b"1", "motion.c": b"2", "motion.h": b"3"}


def test_ilias_folders_of_teams_contain_their_members(tmp_path: Path) -> None:
    all_found = found(write_ilias_teams(tmp_path / "class", [ADA, BOB]))

    assert set(all_found) == {"1815", "1816"}


def test_folders_similar_to_ilias_keep_their_names(tmp_path: Path) -> None:
    names = {"lab_group_ada_3", "lab_group_bob_3"}

    assert set(found(tree(tmp_path / "class", **{f"{name}/main.c": b"1" for name in names}))) == names


def test_files_similar_to_canvas_keep_their_names(tmp_path: Path) -> None:
    names = {"lab_2026_11_ada", "lab_2026_11_bob", "lab_2026_12_cid"}

    assert set(found(tree(tmp_path / "class", **{f"{name}.c": b"1" for name in names}))) == {
        "lab_2026_11_ada",
        "lab_2026_11_bob",
        "2026",
    }


def test_moodle_online_text_belongs_to_submission_with_files(tmp_path: Path) -> None:
    head = "Ada Lovelace_1815_assignsubmission"
    where = tree(
        tmp_path / "class", **{f"{head}_file_/main.c": b"1", f"{head}_onlinetext_/onlinetext.html": b"2"}
    )

    assert source(found(where)["1815"], tmp_path) == {"main.c": b"1"}


def test_gradescope_team_shares_one_board(tmp_path: Path) -> None:
    pytest.importorskip("yaml")
    where = write_gradescope(tmp_path / "class", [ADA, BOB], team=True)
    all_found = found(where, ROSTER)

    assert {one.files for one in (all_found["1815"], all_found["1816"])} == {("submission_1815",)}
    assert all_found["1815"].board == all_found["1816"].board == "1815"


def test_missing_gradescope_folder_is_reported(tmp_path: Path, words: Words) -> None:
    pytest.importorskip("yaml")
    where = write_gradescope(tmp_path / "class", [ADA, BOB])
    (where / "submission_1816" / "lab.c").unlink()
    (where / "submission_1816").rmdir()
    for roster in (None, ROSTER):
        one = found(where, roster)["1816"]

        assert one.path is None
        assert one.files == ()
        with pytest.raises(RejectedError):
            one.content(tmp_path)
        words("grade", one.problem)
