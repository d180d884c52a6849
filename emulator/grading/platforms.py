"""Layouts of class folders: the submitted entries, and the student whom each entry names.

An entry has a student's name, or a name that a platform has given in its download:

- Moodle: ``Full Name_1234_assignsubmission_file_/...`` or
  ``Full Name_1234_assignsubmission_file_main.c``;
  typed text: ``..._assignsubmission_onlinetext_...``;
- Canvas: ``lovelaceada_1234_5678_main.c``, ``lovelaceada_LATE_1234_5678_main.c``;
  5678 is the file's number;
- Blackboard: ``Lab 3_ada_attempt_2026-11-20-10-11-12_main.c``, and ``.txt`` with name and comment;
- Ilias: ``Lovelace_Ada_login_1234/...``, teams in ``Team 12/``,
  late files ``Late Submission - ...``;
- Gradescope: ``submission_1234/...`` beside ``submission_metadata.yml`` (needs PyYAML).

Decision: a student is identified only by those parts of a name that a platform has added, because students
choose file names. An ambiguous name is not divided, because a guess could give the file to another student.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from datetime import datetime
from itertools import takewhile
from pathlib import Path
from typing import Any, Final, NamedTuple

from fcu_emulator.emulator.errors import InputError
from fcu_emulator.emulator.grading.roster import Student
from fcu_emulator.emulator.text import one_line

_METADATA = "submission_metadata.yml"
_LARGEST_METADATA = 16 << 20
_LARGEST_TEXT = 1 << 16  # maximum size in bytes
_OF_SYSTEMS: Final = {
    *(_METADATA, "thumbs.db", "desktop.ini", ".ds_store", ".localized", ".directory"),
    *(".gitignore", ".gitattributes", ".gitkeep"),
}
_TABLES: Final = {".xlsx", ".xls", ".csv", ".md"}
"""Files that Ilias puts beside the students' folders."""
_MOODLE = re.compile(r"(?P<name>.*?)_(?P<id>\d+)_assignsubmission_", re.DOTALL | re.ASCII)
_MOODLES_FILE = re.compile(r".*?_assignsubmission_(file|onlinetext)_(?P<file>.+)", re.DOTALL)
_CANVAS = re.compile(
    r"(?P<name>[^\W\d_][\w-]*?)(?P<late>_late)?_(?P<id>[0-9]+)(?P<file_id>_[0-9]+_|_(?=(text|link)\.html$))"
    r"(?P<file>.+)",
    re.DOTALL | re.IGNORECASE,
)
_ATTEMPT = re.compile(r"_attempt_(?P<at>\d{4}-\d\d-\d\d-\d\d-\d\d-\d\d)(?=[_.]|$)", re.ASCII)
_BLACKBOARDS_NAME = re.compile(r"Name:\s*(?P<name>.*)\((?P<login>[^()\s]+)\)\s*")
_ILIAS = re.compile(r"(?P<last>[^_]+)_(?P<rest>.+)_(?P<id>\d+)", re.DOTALL | re.ASCII)
_LATE_MARK = re.compile(r"^(Late Submission|Versp(ä|ae|a)tete Abgabe) - ")
"""Ilias' prefix of a late file."""
_TEAM = re.compile(r"\w+ \d+")
_GRADESCOPE = re.compile(r"submission_(?P<id>\d+)", re.ASCII)


@dataclass(frozen=True)
class SubmittedEntry:
    """One submitted file or folder, possibly missing.

    ``ids`` and ``names``: keys in a roster. Students can choose ``names``. ``group``: key of the
    submission to which the entry belongs, or "". ``own_name``: the name that the student gave to a
    renamed file. ``attempt``: time at which the attempt was handed in. Only the latest attempt of a group is judged.
    """

    path: Path
    student: Student
    ids: tuple[str, ...] = ()
    names: tuple[str, ...] = ()
    group: str = ""
    own_name: str = ""
    attempt: str = ""
    problem: str = ""
    team: str = ""
    """Id of the student whose board the team shares."""
    handed_in: datetime | None = field(default=None, compare=False)
    """Local time of submission; None if unknown."""
    late: bool = False
    is_there: bool = True

    @property
    def has_own_time(self) -> bool:
        return self.is_there and not self.group.startswith("canvas")

    @property
    def is_renamed(self) -> bool:
        """Return whether the platform may have added marks to file names."""
        return self.group.startswith("ilias")

    def without_mark(self, name: str) -> str:
        return _LATE_MARK.sub("", name) if self.is_renamed else name


def entries(folder: Path) -> list[SubmittedEntry]:
    """Return the entries in alphabetical order. Raises InputError."""
    folder = _ilias_folder(folder)
    paths = _submitted_paths(folder)
    told = _gradescope_submitters(folder)
    blackboard, ilias = _blackboard(paths), _ilias(paths)
    canvas = _canvas([path for path in paths if path not in blackboard])
    if ilias.entries:
        paths = [path for path in paths if not _is_table(path)]
    found: list[SubmittedEntry] = []
    for path in paths:
        if path in ilias.teams:
            found += (ilias.entries[member] for member in ilias.teams[path])
        elif path.name in told:
            found += (replace(one, path=path) for one in told[path.name])
        else:
            found.append(
                _moodle(path)
                or blackboard.get(path)
                or canvas.get(path)
                or ilias.entries.get(path)
                or _by_name(path)
            )
    there = {path.name for path in paths}
    for name, submitters in told.items():
        if name not in there:
            reason = (
                f"the download lists the folder {one_line(name, 60)}, but does not contain it; download again"
            )
            found += (replace(one, path=folder / name, problem=reason, is_there=False) for one in submitters)
    return found


def stem(path: Path) -> str:
    """Return a folder's name, or a file's name without suffix."""
    name = path.name if path.is_dir() else path.stem
    return name if name.strip() else repr(name)


def shown_name(name: str) -> str:
    """Return a name for reports. If a name consists of spaces only, it is quoted."""
    return one_line(name, 200) or repr(name)


def _submitted_paths(folder: Path) -> list[Path]:
    return [path for path in sorted(folder.iterdir()) if not _is_of_a_system(path)]


def _is_of_a_system(path: Path) -> bool:
    name = path.name.casefold()
    return name in _OF_SYSTEMS or name.startswith(("._", "__macosx")) or (name[0] == "." and path.is_dir())


def _by_name(path: Path) -> SubmittedEntry:
    name = stem(path)
    if match := _GRADESCOPE.fullmatch(name):
        return SubmittedEntry(path, Student(match["id"]), ids=(match["id"],))
    return SubmittedEntry(path, Student(name))


def _moodle(path: Path) -> SubmittedEntry | None:
    name = stem(path)
    heads = _MOODLE.findall(path.name)
    if len(heads) + (bool(heads) and _CANVAS.fullmatch(path.name) is not None) > 1:
        problem = (
            f"the name {one_line(path.name)!r} must have one id, not two; download the submissions again"
        )
        return SubmittedEntry(path, Student(name), problem=problem)
    if not (match := _MOODLE.match(name)):
        return None
    own = _MOODLES_FILE.fullmatch(path.name) if not path.is_dir() else None
    return SubmittedEntry(
        path,
        Student(match["id"], match["name"]),
        ids=(match["id"],),
        names=(match["name"],),
        group=f"moodle {match['id']} {match['name']}",
        own_name=own["file"] if own else "",
    )


def _canvas(paths: Sequence[Path]) -> dict[Path, SubmittedEntry]:
    """Return the entries of a download from Canvas. Each id must have one name, and each file a unique number."""
    matches = {path: match for path in paths if (match := _CANVAS.fullmatch(path.name)) and not path.is_dir()}
    names: dict[str, set[str]] = {}
    for match in matches.values():
        names.setdefault(match["id"], set()).add(match["name"].casefold())
    files = Counter(match["file_id"] for match in matches.values() if match["file_id"] != "_")
    return {
        path: SubmittedEntry(
            path,
            Student(match["id"], match["name"]),
            ids=(match["id"],),
            names=(match["name"],),
            group=f"canvas {match['id']}",
            own_name=match["file"],
            late=bool(match["late"]),
        )
        for path, match in matches.items()
        if len(names[match["id"]]) == 1 and files[match["file_id"]] <= 1
    }


def _blackboard(paths: Sequence[Path]) -> dict[Path, SubmittedEntry]:
    """Return the entries of a download from Blackboard. The login follows the assignment's name."""
    found = {path: list(_ATTEMPT.finditer(path.name)) for path in paths if not path.is_dir()}
    found = {path: matches for path, matches in found.items() if matches}
    sure = {path: matches[0] for path, matches in found.items() if len(matches) == 1}
    logins = _logins({path: path.name[: match.start()] for path, match in sure.items()})
    entries = {}
    for path in found:
        if path not in sure:
            problem = f"the name {one_line(path.name)!r} must have one attempt, not two; download the submissions again"
            entries[path] = SubmittedEntry(path, Student(path.stem), problem=problem)
            continue
        match, rest = sure[path], path.name[sure[path].end() :]
        who = logins[path.name[: match.start()]]
        entries[path] = SubmittedEntry(
            path,
            Student(who.logins[0], who.name),
            ids=who.logins,
            names=(who.name,) if who.name else (),
            group=f"blackboard {path.name[: match.start()]}",
            own_name=rest[1:] if rest.startswith("_") and rest[1:] else path.name,
            attempt=match["at"],
            handed_in=_time(match["at"], "%Y-%m-%d-%H-%M-%S"),
        )
    return entries


class _Owner(NamedTuple):
    logins: tuple[str, ...]
    name: str = ""


def _logins(heads: Mapping[Path, str]) -> dict[str, _Owner]:
    said = {}
    for path, head in heads.items():
        match = _BLACKBOARDS_NAME.match(_beginning(path)) if path.suffix == ".txt" else None
        if match and path.stem.startswith(f"{head}_attempt_") and head.endswith(f"_{match['login']}"):
            said[head] = _Owner((match["login"],), match["name"].strip())
    different = sorted(set(heads.values()))
    common = _common_words(different)
    found = {}
    for head in different:
        words = head.split("_")
        rests = ["_".join(words[number:]) for number in range(1, len(words))] or [head]
        likely = head.removeprefix(f"{common}_") if common else rests[-1]
        found[head] = said.get(head) or _Owner(tuple(dict.fromkeys((likely, *rests))))
    times = Counter(who.logins[0].casefold() for who in found.values())
    return {
        head: who if times[who.logins[0].casefold()] == 1 else _Owner((head,), who.name)
        for head, who in found.items()
    }


def _common_words(names: Sequence[str]) -> str:
    if len(names) < 2:
        return ""
    columns = zip(*(name.split("_")[:-1] for name in names), strict=False)
    return "_".join(words[0] for words in takewhile(lambda words: len(set(words)) == 1, columns))


def _beginning(path: Path) -> str:
    try:
        if path.is_symlink() or not path.is_file():
            return ""
        with path.open("rb") as file:
            return file.read(_LARGEST_TEXT).decode("utf-8", errors="replace").removeprefix("\ufeff")
    except OSError:
        return ""


class _Ilias(NamedTuple):
    entries: dict[Path, SubmittedEntry]
    teams: dict[Path, list[Path]]
    """Folders of the members, by team."""


def _ilias(paths: Sequence[Path]) -> _Ilias:
    """Return the entries of a download from Ilias, if most folders have names as Ilias gives them."""
    teams = {
        path: _submitted_paths(path) for path in paths if _TEAM.fullmatch(path.name) and _is_folder(path)
    }
    teams = {
        path: members
        for path, members in teams.items()
        if members and all(_is_ilias(member) for member in members)
    }
    folders = [path for path in paths if _is_folder(path) and path not in teams]
    folders += [member for members in teams.values() for member in members]
    matches = {path: match for path in folders if (match := _ILIAS.fullmatch(path.name)) and _is_ilias(path)}
    ids = Counter(match["id"] for match in matches.values())
    if any(count > 1 for count in ids.values()) or 2 * len(matches) <= len(folders):
        return _Ilias({}, {})
    return _Ilias({path: _iliass_entry(path, match) for path, match in matches.items()}, teams)


def _iliass_entry(path: Path, match: re.Match[str]) -> SubmittedEntry:
    words = match["rest"].split("_")
    first = " ".join(words[: max(1, len(words) - 1)])
    logins = tuple("_".join(words[number:]) for number in range(1, len(words)))
    return SubmittedEntry(
        path,
        Student(match["id"], f"{first} {match['last']}"),
        ids=(match["id"], *logins),
        names=(f"{first} {match['last']}", f"{match['last']}, {first}"),
        group=f"ilias {match['id']}",
    )


def _is_ilias(path: Path) -> bool:
    if path.name.startswith("multi_feedback_"):  # the folder of Ilias that contains all submissions
        return False
    return path.name.count("_") >= 3 and bool(_ILIAS.fullmatch(path.name)) and _is_folder(path)


def _is_folder(path: Path) -> bool:
    return path.is_dir() and not path.is_symlink()


def _ilias_folder(folder: Path) -> Path:
    """Return the parent of the students' folders: this folder, or a folder at most two levels below."""
    here = folder
    for _ in range(3):
        paths = _submitted_paths(here)
        if _ilias(paths).entries:
            return here
        folders = [path for path in paths if _is_folder(path)]
        if len(folders) != 1 or any(not _is_table(path) for path in paths if path not in folders):
            return folder
        here = folders[0]
    return folder


def _is_table(path: Path) -> bool:
    return path.suffix.casefold() in _TABLES and path.is_file()


# -- Gradescope's table -------------------------------------------------------------------------------------


def _gradescope_submitters(folder: Path) -> dict[str, list[SubmittedEntry]]:
    file = folder / _METADATA
    if not file.is_file():
        return {}
    table = _yaml(file)
    found: dict[str, list[SubmittedEntry]] = {}
    for name, entry in table.items() if isinstance(table, dict) else ():
        submitters = entry.get(":submitters") if isinstance(entry, dict) else None
        listed = [one for one in submitters if isinstance(one, dict)] if isinstance(submitters, list) else []
        students = [_submitter(str(name), one) for one in listed]
        board = min((student.id for student in students), default="")
        at = _time(str(entry.get(":created_at")) if isinstance(entry, dict) else "")
        found[str(name)] = [
            SubmittedEntry(
                folder / str(name),
                student,
                ids=tuple(filter(None, (student.id, student.email))),
                names=(student.name,) if student.name else (),
                team=board if len(students) > 1 else "",
                handed_in=at,
            )
            for student in students
        ]
    return {name: students for name, students in found.items() if students}


def _yaml(file: Path) -> Any:
    if file.stat().st_size > _LARGEST_METADATA:
        raise InputError(f"{file} must have at most {_LARGEST_METADATA >> 20} MiB")
    try:
        import yaml
    except ImportError as error:  # without PyYAML, grades would belong to submission numbers, not to students
        problem = f"cannot read {file} without PyYAML; install it: pip install PyYAML"
        raise InputError(problem, kind="not_installed") from error
    try:
        return yaml.safe_load(file.read_bytes())
    except MemoryError:
        raise
    except Exception as error:  # PyYAML raises many kinds of errors for damaged files
        raise InputError(f"{file} must be YAML: {one_line(str(error), 80)}") from error


def _submitter(folder: str, entry: Mapping[object, object]) -> Student:
    told = {key: _word(entry.get(f":{key}")) for key in ("sid", "name", "email")}
    return Student(told["sid"] or told["email"] or folder, told["name"], told["email"])


def _word(value: object) -> str:
    """Return a text or a number as text. Return "" for other values."""
    return str(value) if isinstance(value, str | int) else ""


def _time(text: str, form: str = "") -> datetime | None:
    """Return a platform's time in local time, or None."""
    try:
        at = datetime.strptime(text, form) if form else datetime.fromisoformat(text)
    except ValueError:
        return None
    return at.astimezone().replace(tzinfo=None) if at.tzinfo else at
