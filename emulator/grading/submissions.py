"""What was handed in: finding each student's program among folders, archives and files.

SUBMISSIONS is a folder with an entry for each student (a folder, a zip file, a ``.c``, ``.elf``, ``.hex`` or
``.bin`` file), as one collects them by hand, or as learning platforms export them:

- Moodle: ``Full Name_1234_assignsubmission_file_/...``, in a folder or still in its zip file. A name with
  two such ids is rejected: the student chooses a part of it, and could name another student's id;
  Or all files in one folder, ``Full Name_1234_assignsubmission_file_main.c``;
- Canvas: all files in one folder, ``lovelaceada_1234_5678_main.c``;
- Gradescope: ``submission_1234/...`` with ``submission_metadata.yml`` beside them (needs PyYAML).

A submission is what is in it: **source** if there is one ``main.c`` (or just one C file), with the C files
and headers beside it; otherwise **firmware**, the one ELF, HEX or BIN file. What the build made (``build``,
``support``), what systems leave behind (``__MACOSX``, names with a dot) and everything else is not looked at.

Decision: source goes before firmware, because an ELF in a student's folder is as old as the last ``make``.
Everything that cannot be taken has a reason of one line and costs only itself.
"""

from __future__ import annotations

import hashlib
import os
import re
import stat
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Final, Literal, TypeAlias

from fcu_emulator.emulator.errors import InputError, NotJudgedError
from fcu_emulator.emulator.files import is_about_the_name
from fcu_emulator.emulator.grading.archives import CLASS, ArchiveError, unpack
from fcu_emulator.emulator.grading.roster import Roster, Student
from fcu_emulator.emulator.text import one_line

Take: TypeAlias = Literal["source", "firmware"]

_FIRMWARE: Final = (".elf", ".axf", ".out", ".hex", ".bin")
"""In the order of preference where one build made several."""
_SOURCE: Final = (".c", ".h")
_MADE = {"build", "support"}
_FOREIGN_ARCHIVES = {".rar", ".7z", ".tar", ".gz", ".tgz", ".xz", ".bz2"}
_MOST_ENTRIES = 5_000  # of one submission's folders
_DEEPEST = 12
_LARGEST = 64 << 20  # bytes, of one file
_LARGEST_SOURCE = 4 << 20  # of all C files together
_METADATA = "submission_metadata.yml"
_LARGEST_METADATA = 16 << 20
_OF_SYSTEMS = {_METADATA, "thumbs.db", "desktop.ini"}
_MOODLE = re.compile(r"(?P<name>.*?)_(?P<id>\d+)_assignsubmission_", re.DOTALL | re.ASCII)
_CANVAS = re.compile(r"(?P<name>[a-z-]+)(_LATE)?_(?P<id>\d+)_\d+_(?P<file>.+)", re.DOTALL | re.ASCII)
_MOODLES_FILE = re.compile(r".*?_assignsubmission_(file|onlinetext)_(?P<file>.+)", re.DOTALL)
_GRADESCOPE = re.compile(r"submission_(?P<id>\d+)", re.ASCII)


class RejectedError(InputError):
    """A submission that cannot be judged as it was handed in; the message says why, for the student."""


@dataclass(frozen=True)
class Firmware:
    """A built program: the file's bytes, and what it is called."""

    name: str
    data: bytes = field(repr=False)


@dataclass(frozen=True)
class Source:
    """A program to build: its C files and headers by name. One is ``main.c``."""

    files: Mapping[str, bytes] = field(repr=False)

    @property
    def digest(self) -> str:
        """Of names and contents."""
        digest = hashlib.sha256()
        for name, data in sorted(self.files.items()):
            digest.update(f"{name}\0{len(data)}\0".encode())
            digest.update(data)
        return digest.hexdigest()


@dataclass(frozen=True)
class Submission:
    """One student's entry. ``path`` is None for a student of the roster who handed in nothing."""

    student: Student
    path: Path | None
    known: bool = True
    """Whether the student is on the roster, or there is no roster."""
    problem: str = ""
    """Why it cannot be taken, known already from where it lies."""
    more: tuple[Path, ...] = ()
    """Further files, if the platform has put all files of the class into one folder."""

    def content(self, scratch: Path, take: Take | None = None) -> Firmware | Source:
        """Return the program in it; archives are unpacked into ``scratch``, an empty folder.

        ``take``: only source, or only firmware; None: what there is, source first. Raises RejectedError if
        the submission is at fault, NotJudgedError if this machine is.
        """
        if self.problem:
            raise RejectedError(self.problem)
        assert self.path is not None
        try:
            if self.more:
                gathered = _gathered((self.path, *self.more), scratch / "gathered")
                return _content(gathered, scratch / "unpacked", take)
            return _content(self.path, scratch, take)
        except ArchiveError as error:
            raise RejectedError(f"the archive {error}") from error
        except OSError as error:
            reason = f"cannot be read: {one_line(error.strerror or str(error), 80)}"
            if is_about_the_name(error):
                raise RejectedError(reason) from error
            raise NotJudgedError(f"the submission {reason}") from error


# -- who ----------------------------------------------------------------------------------------------------


def find_submissions(where: Path, roster: Roster | None, scratch: Path) -> list[Submission]:
    """All submissions, in the roster's order, then by name. Raises InputError if there are none.

    ``where`` may be the archive of a class, which is unpacked into ``scratch``.
    """
    folder = _class_folder(where, scratch)
    told = _gradescope_students(folder)
    found: dict[str, Submission] = {}
    for path in _entries(folder):
        student, known, problem = _student_of(path, roster, told)
        first = found.setdefault(student.id.casefold(), Submission(student, path, known, problem))
        if first.path is not None and first.path is not path:
            if _own_name(first.path) and _own_name(path) and not first.problem:
                found[student.id.casefold()] = replace(first, more=(*first.more, path))
                continue
            both = f"{one_line(first.path.name)!r} and {one_line(path.name)!r}"
            problem = f"two submissions for one student: {both}"
            found[student.id.casefold()] = replace(first, problem=problem)
    if not found:
        raise InputError(f"{where}: has no submissions; give a folder with an entry for each student")
    if roster is None:
        return sorted(found.values(), key=lambda one: one.student.id.casefold())
    listed = [
        found.pop(student.id.casefold(), Submission(student, None, problem="nothing was handed in"))
        for student in roster.students
    ]
    return [*listed, *found.values()]


def _class_folder(where: Path, scratch: Path) -> Path:
    if where.is_dir():
        return where
    if where.suffix.casefold() != ".zip" or not where.is_file():
        raise InputError(f"{where}: is no folder and no zip file; give the folder with the submissions")
    try:
        unpack(where, scratch, CLASS)
    except ArchiveError as error:
        raise InputError(f"{where}: {error}") from error
    inside = _entries(scratch)
    return inside[0] if len(inside) == 1 and inside[0].is_dir() else scratch


def _entries(folder: Path) -> list[Path]:
    """Return everything that was handed in; files of the platform and of operating systems are left out."""
    return [
        path
        for path in sorted(folder.iterdir())
        if not path.name.startswith((".", "__MACOSX")) and path.name.casefold() not in _OF_SYSTEMS
    ]


def _student_of(path: Path, roster: Roster | None, told: Mapping[str, Student]) -> tuple[Student, bool, str]:
    """Return the student of a submission, whether the roster knows the student, and a problem of the name.

    The platform's own word counts, else the file's name.
    """
    name = path.name if path.is_dir() else path.stem
    if len(_MOODLE.findall(path.name)) > 1:
        problem = f"the name {one_line(path.name)!r} has two ids in it; download the submissions again"
        return Student(name), roster is None, problem
    keys = [path.name, name]
    student = told.get(path.name)
    if student is not None:
        keys += [student.id, student.email]
    elif moodle := _MOODLE.match(name):
        student = Student(moodle["id"], moodle["name"])
        keys += [moodle["id"], moodle["name"]]
    elif canvas := _CANVAS.fullmatch(path.name):
        student = Student(canvas["id"], canvas["name"])
        keys += [canvas["id"], canvas["name"]]
    elif gradescope := _GRADESCOPE.fullmatch(name):
        student = Student(gradescope["id"])
        keys.append(gradescope["id"])
    if roster is None:
        return student or Student(name), True, ""
    listed = roster.find(*keys)
    return (listed, True, "") if listed else (student or Student(name), False, "")


def _own_name(path: Path) -> str:
    """Return the student's own name of a file that the platform has put into a flat folder; else ""."""
    match = _MOODLES_FILE.fullmatch(path.name) or _CANVAS.fullmatch(path.name)
    return match["file"] if match and path.is_file() and not path.is_symlink() else ""


def _gathered(paths: Sequence[Path], folder: Path) -> Path:
    """Copy one student's files into a folder, under the student's own names."""
    folder.mkdir()
    for path in paths:
        target = folder / _own_name(path)
        if target.exists():
            raise RejectedError(f"has two files {one_line(target.name, 60)!r}; hand in one")
        target.write_bytes(_read(path, _LARGEST))
    return folder


def _gradescope_students(folder: Path) -> dict[str, Student]:
    """Return the students by the names of their folders; none if there is no such file."""
    file = folder / _METADATA
    if not file.is_file():
        return {}
    if file.stat().st_size > _LARGEST_METADATA:
        raise InputError(f"{file}: must have at most {_LARGEST_METADATA >> 20} MiB")
    try:
        import yaml
    except ImportError as error:  # without it, grades would go to numbers instead of students
        raise InputError(f"{file}: reading it needs PyYAML; install it with: pip install PyYAML") from error
    try:
        table = yaml.safe_load(file.read_bytes())
    except MemoryError:
        raise
    except Exception as error:  # PyYAML raises many kinds of errors for damaged files
        raise InputError(f"{file}: is no YAML: {one_line(str(error), 80)}") from error
    students = {}
    for name, entry in table.items() if isinstance(table, dict) else ():
        submitters = entry.get(":submitters") if isinstance(entry, dict) else None
        first = submitters[0] if isinstance(submitters, list) and submitters else None
        if isinstance(first, dict):
            told = {key: _word(first.get(f":{key}")) for key in ("sid", "name", "email")}
            students[str(name)] = Student(
                told["sid"] or told["email"] or str(name), told["name"], told["email"]
            )
    return students


def _word(value: object) -> str:
    """Return text or a number of a YAML file as text; a nested value could be huge, and says nothing."""
    return str(value) if isinstance(value, str | int) else ""


# -- what ---------------------------------------------------------------------------------------------------


def _content(path: Path, scratch: Path, take: Take | None) -> Firmware | Source:
    if path.is_symlink():
        raise RejectedError("is a link; hand in the file itself")
    if path.is_dir():
        return _choose(path, scratch, take)
    if not path.is_file():
        raise RejectedError(f"is not an ordinary file; hand in {_wanted(take)}")
    suffix = path.suffix.casefold()
    if suffix == ".zip":
        unpack(path, scratch)
        return _choose(scratch, None, take)
    if suffix == ".c" and take != "firmware":
        return Source({"main.c": _read(path, _LARGEST_SOURCE)})
    if suffix in _FIRMWARE and take != "source":
        return Firmware(one_line(path.name), _read(path, _LARGEST))
    raise RejectedError(_nothing(take, [path]))


def _choose(folder: Path, scratch: Path | None, take: Take | None) -> Firmware | Source:
    """The one program in a folder. ``scratch``: where an archive in it may be unpacked; None: it may not."""
    files = list(_walk(folder))
    own = [path for path in files if not _MADE & set(path.relative_to(folder).parts[:-1])]
    if take != "firmware":
        mains = [path for path in own if path.name == "main.c"] or [
            path for path in own if path.suffix.casefold() == ".c"
        ]
        if len(mains) == 1:
            return _source(mains[0])
        if mains:
            raise RejectedError(_several("C programs", mains, folder))
    if take != "source":
        images = [path for path in own if path.suffix.casefold() in _FIRMWARE]
        images = images or [path for path in files if path.suffix.casefold() in _FIRMWARE]
        if images:
            return _firmware(images, folder)
    archives = [path for path in own if path.suffix.casefold() == ".zip"]
    if len(archives) == 1 and scratch is not None:
        unpack(archives[0], scratch)
        return _choose(scratch, None, take)
    raise RejectedError(_nothing(take, own))


def _walk(folder: Path) -> Iterator[Path]:
    """Ordinary files, links not followed, in alphabetical order; bounded in number and depth."""
    count = 0
    for where, folders, files in os.walk(folder, onerror=_raise):
        here = Path(where)
        if len(here.relative_to(folder).parts) >= _DEEPEST:
            folders.clear()
        folders[:] = sorted(name for name in folders if not name.startswith((".", "__MACOSX")))
        count += len(folders) + len(files)
        if count > _MOST_ENTRIES:
            raise RejectedError(f"has more than {_MOST_ENTRIES} files; hand in main.c, or the ELF file")
        for name in sorted(files):
            path = here / name
            if not name.startswith(".") and stat.S_ISREG(path.lstat().st_mode):
                yield path


def _raise(error: OSError) -> None:
    """Let :func:`os.walk` fail; left alone, it takes a folder that it cannot read for an empty one."""
    raise error


def _source(main: Path) -> Source:
    """``main`` with the C files and headers beside it."""
    left = _LARGEST_SOURCE
    files = {}
    for path in sorted(main.parent.iterdir()):
        wanted = path.suffix.casefold() in _SOURCE and stat.S_ISREG(path.lstat().st_mode)
        if wanted and re.fullmatch(r"\w[\w+.-]{0,79}", path.name, re.ASCII) is None:
            raise RejectedError(f"the file {one_line(path.name, 60)!r} has a name that make cannot take")
        if wanted:
            data = _read(path, left)
            left -= len(data)
            files["main.c" if path == main else path.name] = data
    return Source(files)


def _firmware(images: list[Path], folder: Path) -> Firmware:
    """The one program that ``images`` are: a build may have made several forms and copies of it."""
    kinds = {path.suffix.casefold() for path in images}
    preferred = next(suffix for suffix in _FIRMWARE if suffix in kinds)
    of_kind = [path for path in images if path.suffix.casefold() == preferred]
    contents = {_read(path, _LARGEST): path for path in reversed(of_kind)}
    if len(contents) > 1:
        raise RejectedError(_several("programs", of_kind, folder))
    ((data, path),) = contents.items()
    return Firmware(one_line(path.name), data)


def _read(path: Path, most: int) -> bytes:
    with path.open("rb") as file:
        data = file.read(most + 1)
    if len(data) > most:
        raise RejectedError(f"{one_line(path.name, 60)} is too large: {most >> 20} MiB are allowed in all")
    return data


def _several(what: str, paths: list[Path], folder: Path) -> str:
    names = ", ".join(one_line(path.relative_to(folder).as_posix(), 60) for path in paths[:4])
    more = f" and {len(paths) - 4} more" if len(paths) > 4 else ""
    return f"has {len(paths)} {what} ({names}{more}); hand in one"


def _nothing(take: Take | None, paths: list[Path]) -> str:
    wanted = _wanted(take)
    foreign = next((path for path in paths if path.suffix.casefold() in _FOREIGN_ARCHIVES), None)
    if foreign is not None:
        return f"{one_line(foreign.name, 60)} is an archive of another kind; hand in a zip file, or {wanted}"
    return f"has no program in it; hand in {wanted}"


def _wanted(take: Take | None) -> str:
    named = {"source": "main.c", "firmware": "an ELF, HEX or BIN file"}
    return named.get(take or "", "main.c or an ELF file")
