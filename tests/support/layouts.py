"""Class folders as they are collected by hand and as learning platforms create them."""

from __future__ import annotations

import re
import zipfile
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Final


@dataclass(frozen=True)
class Handed:
    """The files of one student. ``name_in_ids``: replacement of the id if a platform needs a number."""

    id: str
    first: str
    last: str
    files: Mapping[str, bytes]
    late: bool = False

    @property
    def name(self) -> str:
        return f"{self.first} {self.last}"

    @property
    def number(self) -> str:
        return "".join(sign for sign in self.id if sign.isdigit())


def _write(folder: Path, files: Mapping[str, bytes]) -> None:
    for name, data in files.items():
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(data)
    folder.mkdir(parents=True, exist_ok=True)


def write_folders(where: Path, students: list[Handed]) -> Path:
    for one in students:
        _write(where / one.id, one.files)
    return where


def write_zips(where: Path, students: list[Handed]) -> Path:
    where.mkdir(parents=True, exist_ok=True)
    for one in students:
        with zipfile.ZipFile(where / f"{one.id}.zip", "w", zipfile.ZIP_DEFLATED) as target:
            for name, data in one.files.items():
                target.writestr(name, data)
    return where


def write_gradescope(where: Path, students: list[Handed], *, team: bool = False) -> Path:
    """Write Gradescope's layout. With ``team``, the first student's folder belongs to all students."""
    lines = ["# Gradescope"]
    where.mkdir(parents=True, exist_ok=True)
    for one in students[:1] if team else students:
        _write(where / f"submission_{one.number}", one.files)
        lines.append(f"submission_{one.number}:\n  :submitters:")
        lines += (
            f"  - :name: {member.name}\n    :sid: '{member.id}'\n    :email: {member.id}@x.org"
            for member in (students if team else [one])
        )
        lines.append(f"  :created_at: 2026-11-2{1 if one.late else 0} 10:11:12.000000000 Z")
    (where / "submission_metadata.yml").write_text("\n".join(lines) + "\n", encoding="utf-8")
    return where


def write_moodle_folders(where: Path, students: list[Handed]) -> Path:
    for one in students:
        _write(where / f"{one.name}_{one.number}_assignsubmission_file_", one.files)
    return where


def write_moodle_flat(where: Path, students: list[Handed]) -> Path:
    for one in students:
        head = f"{one.name}_{one.number}_assignsubmission_file_"
        _write(where, {f"{head}{name.replace('/', '_')}": data for name, data in one.files.items()})
    return where


def write_canvas(where: Path, students: list[Handed]) -> Path:
    number = 7_000
    for one in students:
        head = re.sub(r"\W", "", f"{one.last}{one.first}").lower() + ("_LATE" if one.late else "")
        for name, data in one.files.items():
            number += 1
            _write(where, {f"{head}_{one.number}_{number}_{name.replace('/', '_')}": data})
    return where


def write_blackboard(where: Path, students: list[Handed]) -> Path:
    for one in students:
        head = f"Lab 3_{one.id}_attempt_2026-11-2{1 if one.late else 0}-10-11-12"
        said = f"Name: {one.name} ({one.id})\nAssignment: Lab 3\nDate Submitted: Friday, 20 November 2026\n"
        _write(where, {f"{head}_{name.replace('/', '_')}": data for name, data in one.files.items()})
        _write(where, {f"{head}.txt": said.encode()})
    return where


def write_ilias(where: Path, students: list[Handed]) -> Path:
    """Write a download of all submissions: the students' folders in a folder beside a table."""
    for one in students:
        _write(where / "Submissions" / f"{one.last}_{one.first}_{one.id}_{one.number}", one.files)
    where.mkdir(parents=True, exist_ok=True)
    (where / "Lab_3.xlsx").write_bytes(b"PK")
    return where


def write_ilias_feedback(where: Path, students: list[Handed]) -> Path:
    """Write the layout for feedback to several students, with its tables."""
    folder = where / "multi_feedback_Lab_3_12"
    for one in students:
        _write(folder / f"{one.last}_{one.first}_{one.id}_{one.number}", one.files)
    folder.mkdir(parents=True, exist_ok=True)
    for name in ("status.xlsx", "status.csv", "README.md"):
        (folder / name).write_bytes(b"")
    return where


def write_ilias_teams(where: Path, students: list[Handed]) -> Path:
    for number, one in enumerate(students):
        folder = where / "Submissions" / f"Team {number + 1}"
        _write(folder / f"{one.last}_{one.first}_{one.id}_{one.number}", one.files)
    return where


LAYOUTS: Final[Mapping[str, Callable[[Path, list[Handed]], Path]]] = {
    "folders": write_folders,
    "zips": write_zips,
    "gradescope": write_gradescope,
    "moodle-folders": write_moodle_folders,
    "moodle-flat": write_moodle_flat,
    "canvas": write_canvas,
    "blackboard": write_blackboard,
    "ilias": write_ilias,
    "ilias-feedback": write_ilias_feedback,
}
