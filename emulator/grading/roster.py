"""Roster of a class: a CSV file with a line for each student.

Columns are found by name. Only the column of ids is required. If a file is not UTF-8, it is read as
Windows-1252.
"""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Final

from fcu_emulator.emulator.errors import InputError
from fcu_emulator.emulator.text import one_line

_LARGEST = 8 << 20  # bytes
_MOST_ROWS = 100_000
_LONGEST_FIELD = 1_000
_COLUMNS: Final = {
    "id": ("id", "sid", "student id", "student_id", "studentid", "identifier", "id number", "username"),
    "name": ("name", "full name", "fullname", "student", "student name"),
    "first": ("first name", "firstname", "given name"),
    "last": ("last name", "lastname", "surname", "family name"),
    "email": ("email", "e-mail", "email address", "mail"),
    "submission": ("submission", "file", "folder"),
}
_IDENTIFIER_PREFIX = "Participant "  # as in "Participant 1234" of Moodle


@dataclass(frozen=True)
class Student:
    """One line of the roster, in valid Unicode. Seeds and file names depend on ``id``."""

    id: str
    name: str = ""
    email: str = ""
    submission: str = ""
    """Name of the student's file or folder, if the roster gives one."""

    def __post_init__(self) -> None:
        for field in fields(self):
            text = getattr(self, field.name).encode("utf-8", "backslashreplace").decode("utf-8")
            object.__setattr__(self, field.name, text)


class Roster:
    """All students, in the order of the file."""

    def __init__(self, students: Iterable[Student], notes: Iterable[str] = ()) -> None:
        self.students = tuple(students)
        self.notes = tuple(notes)
        self._by_key: dict[str, Student | None] = {}
        for student in self.students:
            ids = {student.id, student.id.removeprefix(_IDENTIFIER_PREFIX)}
            for key in ids | {student.name, student.email, student.email.partition("@")[0]} - {""}:
                known = self._by_key.setdefault(_key(key), student)
                if known is not student:  # two students have this name
                    self._by_key[_key(key)] = None
        for student in self.students:  # ids and explicit names have precedence
            self._by_key[_key(student.id)] = student
            if student.submission:
                self._by_key[_key(student.submission)] = student

    def find(self, *keys: str) -> Student | None:
        """Return the student of the first key that names exactly one student."""
        found = (self._by_key.get(_key(key)) for key in keys if key.strip())
        return next(filter(None, found), None)


def load_roster(path: Path) -> Roster:
    """Read a CSV file. Raises InputError with file and line."""
    text, notes = read_csv(path)
    lines = csv.reader(io.StringIO(text, newline=""), delimiter=delimiter(text), strict=True)
    students: dict[str, Student] = {}
    try:
        columns = _columns(path, next(lines, []))
        for row in lines:
            if not any(field.strip() for field in row):
                continue
            student = _student(path, lines.line_num, columns, row)
            if student.id.casefold() in students:
                problem = f"id must be unique, but {one_line(student.id, 40)!r} is given twice"
                raise InputError(f"{path}:{lines.line_num}: {problem}", kind="same_id")
            students[student.id.casefold()] = student
            if len(students) > _MOST_ROWS:
                raise InputError(f"{path}: must have at most {_MOST_ROWS} students")
    except csv.Error as error:
        raise InputError(f"{path}:{lines.line_num}: must be CSV: {one_line(str(error), 80)}") from error
    return Roster(students.values(), notes)


def read_csv(path: Path) -> tuple[str, list[str]]:
    """Return the file's text, and notes for the user. Raises InputError."""
    try:
        if path.exists() and not path.is_file():
            raise InputError(f"{path}: must be a regular file; give a CSV file that has a column named id")
        with path.open("rb") as file:
            data = file.read(_LARGEST + 1)
    except OSError as error:
        problem = f"cannot be read: {error.strerror or error}; give a CSV file that has a column named id"
        raise InputError(f"{path}: {problem}") from error
    if len(data) > _LARGEST:
        raise InputError(f"{path}: must have at most {_LARGEST >> 20} MiB; give a smaller CSV file")
    try:
        return data.decode("utf-8-sig"), []
    except UnicodeDecodeError:
        note = f"{path}: is not UTF-8 and was read as Windows-1252; check the names"
        return data.decode("cp1252", errors="replace"), [note]


def delimiter(text: str) -> str:
    """Return the separator that is most frequent in the header."""
    header = text.partition("\n")[0]
    return max(",;\t", key=header.count)


def _columns(path: Path, header: list[str]) -> dict[str, int]:
    names = [one_line(name, 60).casefold() for name in header]
    found = {
        what: names.index(known)
        for what, spellings in _COLUMNS.items()
        for known in spellings[::-1]  # the first spelling has precedence
        if known in names
    }
    if "id" not in found:
        has = ", ".join(filter(None, names)) or "nothing"
        problem = f"{path}:1: must have a column named id (its columns: {has}); rename one"
        raise InputError(problem, kind="no_id_column")
    return found


def _student(path: Path, line: int, columns: dict[str, int], row: list[str]) -> Student:
    def field(what: str) -> str:
        index = columns.get(what)
        text = row[index] if index is not None and index < len(row) else ""
        if len(text) > _LONGEST_FIELD:
            raise InputError(f"{path}:{line}: {what} must have at most {_LONGEST_FIELD} characters")
        return text.strip()

    if not field("id"):
        raise InputError(f"{path}:{line}: must have an id")
    name = field("name") or f"{field('first')} {field('last')}".strip()
    return Student(field("id"), name, field("email"), field("submission"))


def _key(text: str) -> str:
    return " ".join(text.split()).casefold()
