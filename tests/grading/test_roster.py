"""The class's CSV file in the formats of platforms and spreadsheets."""

from __future__ import annotations

from pathlib import Path

import pytest

from fcu_emulator.emulator.errors import InputError
from fcu_emulator.emulator.grading.roster import Student, load_roster
from tests.support.words import Words


def roster(tmp_path: Path, data: str | bytes) -> Path:
    path = tmp_path / "roster.csv"
    path.write_bytes(data.encode() if isinstance(data, str) else data)
    return path


@pytest.mark.parametrize(
    "text",
    [
        "id,name,email\n7,Ada Lovelace,ada@example.org\n",
        "\ufeffEmail;SID;Name\nada@example.org;7;Ada Lovelace\n",
        "First Name,Last Name,Student ID,Email Address\r\nAda,Lovelace,7,ada@example.org\r\n\r\n",
        "name\tid\temail\nAda Lovelace\t7\tada@example.org\n",
    ],
)
def test_columns_are_found_by_name(text: str, tmp_path: Path) -> None:
    assert load_roster(roster(tmp_path, text)).students == (Student("7", "Ada Lovelace", "ada@example.org"),)


def test_names_are_loaded_unchanged(tmp_path: Path) -> None:
    path = roster(tmp_path, 'id,name\n1,"Ada\nLovelace"\n2,../../etc\n3,\x1b[31mEve\n')

    assert [one.name for one in load_roster(path).students] == ["Ada\nLovelace", "../../etc", "\x1b[31mEve"]


def test_non_utf8_roster_is_read_as_windows_1252(tmp_path: Path) -> None:
    found = load_roster(roster(tmp_path, "id,name\n1,Jürg\n".encode("cp1252")))

    assert found.students[0].name == "Jürg"
    assert "Windows-1252" in found.notes[0]


def test_submission_name_resolves_to_student(tmp_path: Path) -> None:
    text = "id,name,email,submission\n1,Ada L,ada@x.org,\n2,Bob B,bob@x.org,lab_2\n3,Bob B,bo@x.org,\n"
    found = load_roster(roster(tmp_path, text))
    means = {
        key: student and student.id
        for key in ("1", "ADA l", "ada@x.org", "bo", "lab_2", "Bob B", "nobody")
        for student in [found.find(key)]
    }

    assert means == {
        "1": "1",
        "ADA l": "1",
        "ada@x.org": "1",
        "bo": "3",
        "lab_2": "2",
        "Bob B": None,
        "nobody": None,
    }


@pytest.mark.parametrize(
    ("data", "line"),
    [
        ("name,email\nAda,a@x\n", ":1"),
        ("id\n1\n1\n", ":3"),
        ("id,name\n,Ada\n", ":2"),
        ('id,name\n1,"Ada\n', ":2"),
        ("id,name\n1," + "x" * 2000 + "\n", ":2"),
        (b"x" * (9 << 20), ""),
        ("", ":1"),
    ],
)
def test_roster_error_shows_file_and_line(data: str | bytes, line: str, tmp_path: Path, words: Words) -> None:
    file = roster(tmp_path, data)
    with pytest.raises(InputError) as refused:
        load_roster(file)

    assert str(refused.value).startswith(f"{file}{line}: ")
    words("grade", str(refused.value))
