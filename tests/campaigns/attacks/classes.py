"""Untrusted classes: damaged archives, hostile names, damaged tables. Each submission affects only itself."""

from __future__ import annotations

import io
import json
import os
import shutil
import zipfile
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, Future
from functools import partial
from pathlib import Path
from random import Random
from typing import Any

from fcu_emulator.emulator.cli.grade import _submitter
from fcu_emulator.emulator.errors import FcuError, InputError, NotJudgedError
from fcu_emulator.emulator.grading.build import Builder
from fcu_emulator.emulator.grading.grading import Grader
from fcu_emulator.emulator.grading.reports.writer import Reports
from fcu_emulator.emulator.grading.results import Graded, GradedClass
from fcu_emulator.emulator.grading.roster import Roster, Student, load_roster
from fcu_emulator.emulator.grading.rubric import load_rubric
from fcu_emulator.emulator.grading.submissions import RejectedError, Submission, find_submissions
from tests.support.arm.mutations import ANYWHERE, mutated

_NAMES = (
    *("", ".", "..", "/", "./", "//", "a/", "a", "a/b", "main.c", "MAIN.C", "./main.c", "lab3.elf", "x.zip"),
    *(
        "con",
        "NUL.c",
        "a:b.c",
        "\\\\server\\x",
        "C:\\x.c",
        "..\\x.c",
        "a/../../x.c",
        "x" * 300,
        "y/" * 40 + "z.c",
    ),
    *(
        "\u202egnp.c",
        "\x1b[31m.c",
        "a\nb.c",
        "\x00.c",
        "\udce9.c",
        "=1+1.c",
        "-rf",
        "'.c",
        "%s%n.c",
        "\U0001f600.c",
    ),
)
_PLATFORM = (
    "Eve_4242_assignsubmission_file_",
    "x_1815_assignsubmission_file_",
    "submission_1815",
    "_0_assignsubmission_",
)
_PIECES = (
    b'"',
    b",",
    b"\n",
    b"\r",
    b"\0",
    b"\xff",
    b"\xed\xa0\x80",
    b"=1+1",
    b"'",
    b"\x1b[2J",
    b"id",
    b"&a [*a]",
)
_DEEP = b"[" * 3000

# -- archives -----------------------------------------------------------------------------------------------


def archives(tries: int, random: Random, folder: Path) -> Iterator[str]:
    """Try zip files of a submission, with hostile names or damage. No file may be written beside the scratch folder."""
    path, scratch = folder / "eve.zip", folder / "scratch"
    submission = Submission(Student("eve"), path)
    before = {*folder.iterdir(), path}
    for _ in range(tries):
        data = _archive(random)
        for _ in range(random.randrange(3)):
            data = mutated(data, random, ANYWHERE)
        path.write_bytes(data)
        scratch.mkdir()
        word = _refused(lambda: submission.content(scratch), RejectedError) or "a program"
        shutil.rmtree(scratch)
        assert {*folder.iterdir()} == before
        yield word


def _archive(random: Random) -> bytes:
    sink = io.BytesIO()
    with zipfile.ZipFile(sink, "w", random.choice((zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED))) as target:
        for _ in range(random.randrange(4)):
            entry = zipfile.ZipInfo("x")
            entry.filename = random.choice(_NAMES) if random.random() < 0.6 else "main.c"
            if random.random() < 0.1:
                entry.external_attr = random.getrandbits(32)
            try:
                target.NameToInfo.clear()  # else it warns of a name that it has written before
                target.writestr(entry, random.choice((b"", b"int main(void) { return 0; }", bytes(9000))))
            except (UnicodeError, IndexError):  # a name that zipfile itself cannot write
                continue
    return sink.getvalue()


# -- names --------------------------------------------------------------------------------------------------


class _Refusing(Executor):
    """Workers that refuse every program, so that grading a class takes milliseconds."""

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        future: Future[Any] = Future()
        future.set_exception(RejectedError("is refused"))
        return future


def _no_builder() -> Builder:
    raise InputError("no compiler here")


def names(tries: int, random: Random, folder: Path) -> Iterator[str]:
    """Grade classes of files and folders with hostile names, with and without a roster, up to their reports."""
    rubric = load_rubric("lab3")
    for number in range(tries):
        where, out = folder / f"class{number}", folder / f"out{number}"
        entries = _class(where, random)
        roster = random.choice((None, Roster([Student("1815", "Ada"), Student("4242", "Eve")])))
        grader = Grader(rubric, "lab3", _Refusing(), 1, _no_builder, b"salt")
        found = find_submissions(where, roster, folder / "scratch") if entries else []
        reports = Reports(out, rubric.title)
        graded = [reports.student(one) for _, one in grader.grade(found)]
        reports.whole(_whole(graded))
        _account(entries, found, graded)
        for path in (where, out):
            shutil.rmtree(path)
        yield "all accounted for"


def _class(where: Path, random: Random) -> list[str]:
    """Create a folder of entries and return their names."""
    where.mkdir()
    for _ in range(random.randrange(8)):
        name = random.choice((*_NAMES, *_PLATFORM)) + random.choice(("", "", *_PLATFORM, "x"))
        name = name.replace("/", "_").replace("\0", "_")[:200].encode("utf-8", "surrogateescape")
        suffix, kind = random.choice(((b"", "folder"), (b".c", "file"), (b".zip", "file"), (b".elf", "link")))
        path = os.fsdecode(os.fsencode(where) + b"/" + name + suffix)
        if name + suffix in (b"", b".", b"..") or os.path.lexists(path):
            continue
        if kind == "folder":
            Path(path).mkdir()
            (Path(path) / "main.c").write_bytes(b"int x;")
        elif kind == "file":
            Path(path).write_bytes(random.choice((b"", b"PK\3\4", b"int x;")))
        else:
            Path(path).symlink_to("/etc/passwd")
    ignored = (".", "__MACOSX")
    return [path.name for path in where.iterdir() if not path.name.startswith(ignored)]


def _account(entries: list[str], found: list[Submission], graded: list[Graded]) -> None:
    """Check that every entry is in one submission."""
    listed = [name for one in found for name in one.files]
    for name in entries:
        assert listed.count(name) == 1, name
    assert len(graded) == len(found)
    assert all(one.status in ("rejected", "unjudged", "missing") for one in graded)
    for one in graded:
        _one_line(one.reason)


def _whole(graded: list[Graded]) -> GradedClass:
    rubric = load_rubric("lab3")
    return GradedClass(
        rubric="lab3",
        rubric_title=rubric.title,
        rubric_digest=rubric.digest,
        version="0",
        max_points=rubric.max_points,
        exercises=(),
        submissions=tuple(graded),
    )


# -- tables -------------------------------------------------------------------------------------------------


def tables(tries: int, random: Random, folder: Path) -> Iterator[str]:
    """Try damaged rosters, rubrics, and metadata of Gradescope."""
    rubric = (Path(__file__).parents[3] / "scenarios" / "rubrics" / "lab3.toml").read_bytes()
    roster = b"id,name,email,submission\n" + b"".join(
        b"%d,Ada %d,a%d@x.org,a%d\n" % (n, n, n, n) for n in range(20)
    )
    users = [{"id": n, "name": "Ada", "email": "a@x.org"} for n in range(3)]
    metadata = json.dumps({"id": 1, "users": users}).encode()
    students = b"submission_1:\n  :submitters:\n  - :name: Ada\n    :sid: '7'\n    :email: a@x.org\n"
    (folder / "submission_1").mkdir()
    readers: tuple[tuple[str, bytes, Callable[[Path], object]], ...] = (
        ("roster.csv", roster, load_roster),
        ("rubric.toml", rubric, load_rubric),
        ("metadata.json", metadata, _submitter),
        ("submission_metadata.yml", students, lambda path: find_submissions(path.parent, None, folder / "s")),
    )
    for number in range(tries):
        name, whole, read = readers[number % len(readers)]
        data = whole
        for _ in range(random.randrange(1, 4)):
            at = random.randrange(len(data) + 1)
            piece = random.choice((*_PIECES, _DEEP))
            data = data[:at] + piece + data[at:] if random.random() < 0.5 else mutated(data, random, ANYWHERE)
        path = folder / name
        path.write_bytes(data)
        yield _refused(partial(read, path), InputError) or "accepted"


def _refused(action: Callable[[], object], kind: type[FcuError]) -> str:
    """Return how ``action`` is refused, or "". Any other exception makes the campaign fail."""
    try:
        action()
    except NotJudgedError:
        raise
    except kind as error:
        _one_line(str(error))
        return "refused in one line"
    return ""


def _one_line(text: str) -> None:
    if "\n" in text or not text.isprintable() or len(text) > 1000:
        raise AssertionError(f"not one short printable line: {text[:200]!r}")
