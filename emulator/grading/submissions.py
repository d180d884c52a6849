"""Submissions: find each student's program among folders, archives and files.

A submission is **source** if it has exactly one ``main.c``, or exactly one C file. The source is
this file, with the C files and headers beside it. Otherwise the submission is **firmware**: its
only ELF, HEX or BIN file.

Decision: source takes precedence over firmware, because an ELF file may be outdated.
"""

from __future__ import annotations

import hashlib
import os
import re
import stat
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from datetime import datetime
from pathlib import Path
from typing import Final, Literal, NamedTuple, TypeAlias

from fcu_emulator.emulator.errors import InputError, NotJudgedError
from fcu_emulator.emulator.grading import platforms
from fcu_emulator.emulator.grading.archives import CLASS, ArchiveError, unpack
from fcu_emulator.emulator.grading.platforms import SubmittedEntry
from fcu_emulator.emulator.grading.roster import Roster, Student
from fcu_emulator.emulator.host.files import is_about_the_name
from fcu_emulator.emulator.text import one_line, shown

Take: TypeAlias = Literal["source", "firmware"]

_FIRMWARE: Final = (".elf", ".axf", ".out", ".hex", ".bin")
"""Suffixes in the order of preference."""
_SOURCE: Final = (".c", ".h")
_MADE = {"build", "support"}
_FOREIGN_ARCHIVES = {".rar", ".7z", ".tar", ".gz", ".tgz", ".xz", ".bz2"}
_OTHER_LANGUAGES = {".cpp", ".cc", ".cxx", ".ino", ".py", ".rs"}
_MOST_ENTRIES = 5_000  # per submission
_DEEPEST = 12
_LARGEST = 64 << 20  # bytes of one file
_LARGEST_SOURCE = 4 << 20  # bytes of all C files


class RejectedError(InputError):
    """A submission that cannot be judged. The message is for the student."""


@dataclass(frozen=True)
class SubmittedFirmware:
    """A built program: the file's name and bytes."""

    name: str
    data: bytes = field(repr=False)


@dataclass(frozen=True)
class SubmittedSource:
    """A program to build: C files and headers, keyed by name."""

    files: Mapping[str, bytes] = field(repr=False)

    @property
    def digest(self) -> str:
        digest = hashlib.sha256()
        for name, data in sorted(self.files.items()):
            digest.update(f"{name}\0{len(data)}\0".encode())
            digest.update(data)
        return digest.hexdigest()


@dataclass(frozen=True)
class Submission:
    """Submission of one student. ``path`` is None if it is missing."""

    student: Student
    path: Path | None
    known: bool | None = None
    """Whether the roster has the student, or None without a roster."""
    problem: str = ""
    """Reason for a rejection that is known before the files are read."""
    entries: tuple[SubmittedEntry, ...] = ()
    """All entries of the student."""

    @property
    def files(self) -> tuple[str, ...]:
        if self.entries:
            return tuple(entry.path.name for entry in self.entries if entry.is_there)
        return (self.path.name,) if self.path is not None else ()

    @property
    def board(self) -> str:
        """Return the id that selects the board. A team has one board."""
        return next((entry.team for entry in self.entries if entry.team), self.student.id)

    @property
    def note(self) -> str:
        """Return a note on the judged files, or ""."""
        attempts = {entry.attempt for entry in self.entries}
        return f"the last of {len(attempts)} attempts is graded" if len(attempts) > 1 else ""

    @property
    def counted(self) -> list[SubmittedEntry]:
        """Return the entries of the latest attempt, which is judged."""
        last = max((entry.attempt for entry in self.entries), default="")
        return [entry for entry in self.entries if entry.attempt == last and entry.is_there]

    @property
    def is_marked_late(self) -> bool:
        return any(entry.late for entry in self.counted)

    def submitted(self) -> datetime | None:
        """Return the local time of submission, from the platform or else from the newest file.

        Return None for Canvas, because its files have the time of the download.
        """
        times = []
        for entry in self.counted:
            if entry.has_own_time:
                with suppress(OSError, ValueError, OverflowError, RejectedError):
                    times.append(entry.handed_in or _newest(entry.path))
        return max(times, default=None)

    def content(self, scratch: Path, take: Take | None = None) -> SubmittedFirmware | SubmittedSource:
        """Return the submitted program. Archives are unpacked into the empty folder ``scratch``.

        ``take``: the only type to accept. If it is None, both types are accepted, and source is preferred. Raises
        RejectedError if the submission is at fault, NotJudgedError if this machine is at fault.
        """
        if self.problem:
            raise RejectedError(self.problem, kind="problem")
        assert self.path is not None
        counted = self.counted
        try:
            if len(counted) > 1 or any(entry.own_name or entry.is_renamed for entry in counted):
                gathered = _gathered(counted, scratch / "gathered")
                return _content(gathered, scratch / "unpacked", take)
            return _content(counted[0].path if counted else self.path, scratch, take)
        except ArchiveError as error:
            raise RejectedError(f"the archive {error}", kind=error.kind) from error
        except OSError as error:
            reason = f"cannot be read: {one_line(error.strerror or str(error), 80)}"
            if is_about_the_name(error):
                raise RejectedError(reason) from error
            raise NotJudgedError(f"the submission {reason}") from error


# -- students -----------------------------------------------------------------------------------------------


def _newest(path: Path) -> datetime:
    files = _walk(path) if path.is_dir() else [path]
    return datetime.fromtimestamp(max(one.lstat().st_mtime for one in files))


class _Resolved(NamedTuple):
    """An entry and its student. ``sure``: False if the student was found by a name that students can choose."""

    entry: SubmittedEntry
    student: Student
    known: bool | None
    problem: str
    sure: bool = True


def find_submissions(where: Path, roster: Roster | None, scratch: Path) -> list[Submission]:
    """Return all submissions in the order of the roster, then of names. Raises InputError if no
    submission is found.

    An archive is unpacked into ``scratch``.
    """
    handed_in = platforms.entries(_class_folder(where, scratch))
    found: dict[str, Submission] = {}
    resolved = [_resolved(entry, roster) for entry in handed_in]
    for one in sorted(resolved, key=lambda one: not one.sure):
        first = found.get(one.student.id.casefold())
        if first is not None and not one.sure and one.entry.group != first.entries[0].group:
            student = Student(platforms.stem(one.entry.path))
            problem = f"it has the name of {_shown(first.student)}, who has another submission"
            one = _Resolved(one.entry, student, None if roster is None else False, problem)  # noqa: PLW2901
            first = found.get(student.id.casefold())
        found[one.student.id.casefold()] = _joined(first, one)
    if not found:
        problem = f"{where} must have an entry for each student, but is empty"
        raise InputError(problem, kind="no_submissions")
    if roster is None:
        return sorted(found.values(), key=lambda one: one.student.id.casefold())
    listed = [
        found.pop(student.id.casefold(), Submission(student, None, known=True, problem="no submission"))
        for student in roster.students
    ]
    return [*listed, *sorted(found.values(), key=lambda one: one.student.id.casefold())]


def _joined(first: Submission | None, one: _Resolved) -> Submission:
    entry = one.entry
    if first is None:
        return Submission(
            one.student, entry.path if entry.is_there else None, one.known, one.problem, (entry,)
        )
    together = (*first.entries, entry)
    if entry.group and {other.group for other in first.entries} == {entry.group}:
        return replace(first, entries=together, problem=first.problem or one.problem)
    names = [repr(one_line(other.path.name, 60)) for other in together]
    listed = ", ".join(names[:3]) + (f" and {len(names) - 3} more" if len(names) > 3 else "")
    return replace(first, entries=together, problem=f"two submissions for one student: {listed}; keep one")


def _class_folder(where: Path, scratch: Path) -> Path:
    if where.is_dir():
        return where
    if where.suffix.casefold() != ".zip" or not where.is_file():
        problem = f"SUBMISSIONS must be a folder or a zip file, not {shown(str(where))}"
        raise InputError(problem, kind="no_such_folder")
    try:
        unpack(where, scratch, CLASS)
    except ArchiveError as error:
        raise InputError(f"{where}: {error}") from error
    inside = [path for path in scratch.iterdir() if not path.name.startswith((".", "__MACOSX"))]
    return inside[0] if len(inside) == 1 and inside[0].is_dir() else scratch


def _resolved(entry: SubmittedEntry, roster: Roster | None) -> _Resolved:
    """Find the student by the roster's column of submissions, then by ids, then by names."""
    unknown = Student(platforms.stem(entry.path))
    if entry.problem and entry.is_there:  # ambiguous name
        return _Resolved(entry, unknown, None if roster is None else False, entry.problem)
    if roster is None:
        return _Resolved(entry, entry.student, None, entry.problem)
    if listed := roster.find(entry.path.name, unknown.id):
        return _Resolved(entry, listed, True, entry.problem)
    by_id = [listed for key in entry.ids if (listed := roster.find(key))]
    by_name = [listed for key in entry.names if (listed := roster.find(key))]
    students = list(dict.fromkeys((*by_id, *by_name)))
    if len(students) > 1:
        could_be = " or ".join(map(_shown, students[:3]))
        problem = (
            f"its name fits more than one student: {could_be}; add the file to the roster's column submission"
        )
        return _Resolved(entry, unknown, False, problem)
    if students:
        return _Resolved(entry, students[0], True, entry.problem, sure=bool(by_id))
    return _Resolved(entry, entry.student, False, entry.problem)


def _shown(student: Student) -> str:
    return one_line(f"{student.name} ({student.id})" if student.name else student.id, 60)


def _gathered(handed_in: Sequence[SubmittedEntry], folder: Path) -> Path:
    folder.mkdir(parents=True)
    left = _LARGEST
    for source, name in _own_files(handed_in):
        target = folder / name
        if target.exists():
            raise RejectedError(
                f"must have one file {one_line(target.name, 60)!r}, not two", kind="same_name"
            )
        target.parent.mkdir(parents=True, exist_ok=True)
        data = _read(source, left)
        left -= len(data)
        target.write_bytes(data)
    return folder


def _own_files(handed_in: Sequence[SubmittedEntry]) -> Iterator[tuple[Path, str]]:
    for entry in handed_in:
        kind = entry.path.lstat().st_mode
        if stat.S_ISLNK(kind) or not (stat.S_ISREG(kind) or stat.S_ISDIR(kind)):
            raise RejectedError("is a link or a device; hand in the file itself", kind="link")
        if stat.S_ISREG(kind):
            yield entry.path, entry.own_name or entry.path.name
            continue
        for path in _walk(entry.path):
            yield path, entry.without_mark(path.relative_to(entry.path).as_posix())


# -- programs -----------------------------------------------------------------------------------------------


def _content(path: Path, scratch: Path, take: Take | None) -> SubmittedFirmware | SubmittedSource:
    if path.is_symlink():
        raise RejectedError("is a link; hand in the file itself", kind="link")
    if path.is_dir():
        return _choose(path, scratch, take)
    if not path.is_file():
        raise RejectedError(f"is not an ordinary file; hand in {_wanted(take)}", kind="no_file")
    suffix = path.suffix.casefold()
    if suffix == ".zip":
        unpack(path, scratch / "outer")
        return _choose(scratch / "outer", scratch / "inner", take)
    if suffix == ".c" and take != "firmware":
        return SubmittedSource({"main.c": _read(path, _LARGEST_SOURCE)})
    if suffix in _FIRMWARE and take != "source":
        return SubmittedFirmware(one_line(path.name), _read(path, _LARGEST))
    raise _nothing(take, [path])


def _choose(folder: Path, scratch: Path | None, take: Take | None) -> SubmittedFirmware | SubmittedSource:
    """Return the only program in a folder. ``scratch``: folder for unpacking, or None."""
    files = list(_walk(folder))
    own = [path for path in files if not _MADE & set(path.relative_to(folder).parts[:-1])]
    if take != "firmware":
        mains = [path for path in own if path.name == "main.c"] or [
            path for path in own if path.suffix.casefold() == ".c"
        ]
        if len(mains) == 1:
            return _source(mains[0])
        if mains:
            raise _several("C programs", mains, folder)
    if take != "source":
        images = [path for path in own if path.suffix.casefold() in _FIRMWARE]
        images = images or [path for path in files if path.suffix.casefold() in _FIRMWARE]
        if images:
            return _firmware(images, folder)
    archives = [path for path in own if path.suffix.casefold() == ".zip"]
    if len(archives) == 1 and scratch is not None:
        unpack(archives[0], scratch)
        return _choose(scratch, None, take)
    raise _nothing(take, own)


def _walk(folder: Path) -> Iterator[Path]:
    """Yield ordinary files, not links. Raises RejectedError for more than 5,000 entries."""
    count = 0
    for where, folders, files in os.walk(folder, onerror=_raise):
        here = Path(where)
        if len(here.relative_to(folder).parts) >= _DEEPEST:
            folders.clear()
        folders[:] = sorted(name for name in folders if not name.startswith((".", "__MACOSX")))
        count += len(folders) + len(files)
        if count > _MOST_ENTRIES:
            problem = f"must have at most {_MOST_ENTRIES} files; hand in main.c, or the ELF file"
            raise RejectedError(problem, kind="too_many")
        for name in sorted(files):
            path = here / name
            if not name.startswith(".") and stat.S_ISREG(path.lstat().st_mode):
                yield path


def _raise(error: OSError) -> None:
    """Raise the error that :func:`os.walk` reports."""
    raise error


def _source(main: Path) -> SubmittedSource:
    """Return ``main``, with a valid name, and the files beside it."""
    left = _LARGEST_SOURCE
    files = {}
    for path in sorted(main.parent.iterdir()):
        wanted = path.suffix.casefold() in _SOURCE and stat.S_ISREG(path.lstat().st_mode)
        if wanted and re.fullmatch(r"\w[\w+.-]{0,79}", path.name, re.ASCII) is None:
            if path == main:
                files["main.c"] = _read(path, left)
                left -= len(files["main.c"])
                continue
            problem = (
                f"the file {one_line(path.name, 60)!r} must have a name without spaces or special characters"
            )
            raise RejectedError(problem, kind="file_name")
        if wanted:
            data = _read(path, left)
            if data.startswith((b"\xff\xfe", b"\xfe\xff")):
                problem = f"{one_line(path.name, 60)} must be UTF-8, not UTF-16"
                raise RejectedError(problem, kind="encoding")
            left -= len(data)
            files[path.name if path != main or path.suffix == ".c" else "main.c"] = data
    return SubmittedSource(files)


def _firmware(images: list[Path], folder: Path) -> SubmittedFirmware:
    kinds = {path.suffix.casefold() for path in images}
    preferred = next(suffix for suffix in _FIRMWARE if suffix in kinds)
    of_kind = [path for path in images if path.suffix.casefold() == preferred]
    contents = {_read(path, _LARGEST): path for path in reversed(of_kind)}
    if len(contents) > 1:
        raise _several("programs", of_kind, folder)
    ((data, path),) = contents.items()
    return SubmittedFirmware(one_line(path.name), data)


def _read(path: Path, most: int) -> bytes:
    with path.open("rb") as file:
        data = file.read(most + 1)
    if len(data) > most:
        problem = (
            f"{one_line(path.name, 60)} is too large: all files together must have at most {most >> 20} MiB"
        )
        raise RejectedError(problem, kind="too_large")
    return data


def _several(what: str, paths: list[Path], folder: Path) -> RejectedError:
    names = ", ".join(one_line(path.relative_to(folder).as_posix(), 60) for path in paths[:4])
    more = f" and {len(paths) - 4} more" if len(paths) > 4 else ""
    return RejectedError(f"has {len(paths)} {what} ({names}{more}); hand in one", kind="several")


def _nothing(take: Take | None, paths: list[Path]) -> RejectedError:
    wanted = _wanted(take)
    foreign = next((path for path in paths if path.suffix.casefold() in _FOREIGN_ARCHIVES), None)
    if foreign is not None:
        problem = f"{one_line(foreign.name, 60)} must be a zip archive; hand in a zip file, or {wanted}"
        return RejectedError(problem, kind="archive_type")
    other = next((path for path in paths if path.suffix.casefold() in _OTHER_LANGUAGES), None)
    if other is not None and take != "firmware":
        return RejectedError(
            f"{one_line(other.name, 60)} must be a C file; hand in {wanted}", kind="language"
        )
    return RejectedError(f"has no program; hand in {wanted}", kind="no_program")


def _wanted(take: Take | None) -> str:
    named = {"source": "main.c", "firmware": "an ELF, HEX or BIN file"}
    return named.get(take or "", "main.c or an ELF file")
