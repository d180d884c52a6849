"""A class of forty in all layouts in which classes are delivered: each layout is graded, and no file may be lost.

The forty students have correct programs, mistakes, the template, two copies, a late submission, and files that are
not programs. There are also unrelated files, a student who is not on the roster, and a student without a submission.

``python -m tests.campaigns.class_of_layouts OUT [RUBRIC]`` grades them in every layout into OUT/LAYOUT, and reports
missing files; this takes about ten minutes with the lab's rubric.
"""

from __future__ import annotations

import io
import os
import shutil
import sys
import zipfile
from collections import Counter
from collections.abc import Iterator
from datetime import datetime
from pathlib import Path
from tempfile import TemporaryDirectory

from fcu_emulator.emulator.cli import execute
from fcu_emulator.emulator.grading.platforms import shown_name
from fcu_emulator.emulator.grading.results import GradedClass
from fcu_emulator.firmware_model import arm
from tests.grading.test_nothing_lost import handed_in
from tests.support.arm import student_programs
from tests.support.layouts import LAYOUTS, Handed

GRADED = ("folders", "zips", "gradescope", "moodle-flat", "canvas")
DEADLINE = "2026-11-20T23:59"
_IN_TIME, _LATE = (datetime.fromisoformat(f"2026-11-{day}T10:11:12").timestamp() for day in (20, 21))
_FIRST = ("Ada", "Bob", "Cid", "Dora", "Eve", "Finn", "Gül", "Hans")
_LAST = ("Lovelace", "von Neumann", "Ångström", "O'Neill", "Curie")
_IN_MAIN = b"  BSP_LED_Init(LED1);\n"
_CHANGES = (
    ("float pitch, roll, azimuth;", "float pich, roll, azimuth;"),
    ('PRINTF("Altitude', 'PRINTF("Height'),
    ("  BSP_LED_Init(LED1);\n", "((void (*)(void))0x20000001)();\n"),
)
"""Changes of the correct program: it does not compile, it prints another word, or it crashes."""
ODD = {
    "to whom it belongs.txt": b"who knows",
    "lab.rar": b"Rar!",
    "solution (1).zip": b"PK\3\4 damaged",
    "report.pdf": b"%PDF",
}
"""Files in the class's folder whose names do not show the student."""


def students() -> list[Handed]:
    """Return the forty students, each with an id of four digits, which every platform has."""
    return [
        Handed(str(1001 + number), _FIRST[number % 8], _LAST[number // 8], files, late=number == 7)
        for number, files in enumerate(_files())
    ]


def _files() -> Iterator[dict[str, bytes]]:
    right = (student_programs.FOLDER / "student" / "main.c").read_bytes()
    template = (arm.sources() / "template" / "main.c").read_bytes()
    elf = arm.prebuilt("solution").read_bytes()
    for number in range(10):
        own = b"  for (volatile int own = %d; own > 0; own--) { }\n%s" % (number, _IN_MAIN)
        yield {"main.c": right.replace(_IN_MAIN, own), "readme.txt": b"see main.c"}
    for old, new in _CHANGES:
        changed = right.replace(old.encode(), new.encode())
        assert changed != right, old
        yield {"main.c": changed}
    for times in (5, 6, 7):
        yield {"main.c": right.replace(_IN_MAIN, _IN_MAIN * times)}
    yield {"main.c": right + b"\nint shared;\n"}
    yield {"main.c": b"/* all my own work */\n" + right + b"\n\n int  shared ;  // mine\n"}
    yield {"main.c": template}
    yield {"lab3.elf": elf}
    yield {"main.c": right, "main_old.c": template}
    yield {"lab.zip": _zip({"lab/main.c": right.replace(_IN_MAIN, _IN_MAIN * 3)})}
    yield {"main.c": right.replace(_IN_MAIN, _IN_MAIN * 4), "notes.docx": b"PK"}
    yield {"lab.c": template.replace(_IN_MAIN, _IN_MAIN * 2)}
    odd: list[dict[str, bytes]] = [
        {"report.pdf": b"%PDF"},
        {"lab.7z": b"7z"},
        {"main.cpp": b"int main() {}"},
        {"lab3.elf": b"Please see the e-mail."},
        {"main.c": b""},
        {"main.c": b"int x;\n"},
        {"one.c": template, "two.c": template},
        {"a.elf": elf, "b.elf": arm.prebuilt("template").read_bytes()},
        {"lab.zip": b"PK\3\4"},
        {"main.c": b'#include "motion.h"\nint main(void) { return 0; }\n'},
        {"Main.C": template.replace(_IN_MAIN, _IN_MAIN * 3)},
        {"lab3.hex": b":00000001FF\n"},
        {"main.c": b"\xff\xfe" + "int main(void) { return 0; }".encode("utf-16-le")},
        {"screenshot.png": b"\x89PNG"},
        {"main.c": b"int main(void) { for (;;) { } }\n"},
        {"main.c": b"int main(void) { return 0; }\n", "Makefile": b"all:\n\trm -rf /\n"},
    ]
    yield from odd


def _zip(files: dict[str, bytes]) -> bytes:
    sink = io.BytesIO()
    with zipfile.ZipFile(sink, "w") as target:
        for name, data in files.items():
            target.writestr(zipfile.ZipInfo(name), data)
    return sink.getvalue()


def write_class(layout: str, where: Path) -> Path:
    """Write the class in a layout, with unrelated files and with the times of the files."""
    class_ = students()
    LAYOUTS[layout](where, class_)
    for name, data in ODD.items():
        (where / name).write_bytes(data)
    (late,) = (one.id for one in class_ if one.late)
    for path in where.rglob("*"):
        stamp = _LATE if late in path.relative_to(where).as_posix() else _IN_TIME
        os.utime(path, (stamp, stamp))
    return where


def write_roster(file: Path) -> None:
    """Write a roster with all students except the last one, and one student without a submission."""
    rows = [f'{one.id},"{one.name}"' for one in students()[:-1]]
    file.write_text("\n".join(["id,name", *rows, '2000,"Zoe Zuse"']) + "\n", encoding="utf-8")


def grade(layout: str, out: Path, rubric: str) -> GradedClass:
    """Grade the class in a layout into OUT/LAYOUT, and reuse verdicts of other layouts."""
    with TemporaryDirectory() as folder:
        where, roster = write_class(layout, Path(folder) / "class"), Path(folder) / "roster.csv"
        write_roster(roster)
        command = ["grade", str(where), "--rubric", rubric, "--roster", str(roster)]
        code = execute([*command, "--deadline", DEADLINE, "--out", str(out / layout)])
        assert code == 0, code
        whole = GradedClass.from_json((out / layout / "grade.json").read_bytes())
        listed = Counter(name for one in whole.submissions for name in one.files)
        lost = Counter(map(shown_name, handed_in(where)))
        lost.subtract(listed)
        assert not +lost, f"not in the results: {sorted(+lost)}"
        assert not -lost, f"more than once in the results: {sorted(-lost)}"
    return whole


def main(out: Path, rubric: str = "lab3") -> None:
    """Grade every layout, and print the counts and the students whose points differ."""
    points: dict[str, set[float]] = {}
    earlier: Path | None = None
    for layout in GRADED:
        if earlier is not None:
            shutil.copytree(earlier, out / layout / "kept", dirs_exist_ok=True)
        earlier = out / layout / "kept"
        whole = grade(layout, out, rubric)
        for one in whole.submissions:
            if one.points is not None:
                points.setdefault(one.id, set()).add(one.points)
        counts = Counter(one.status for one in whole.submissions)
        said = ", ".join(f"{count} {status}" for status, count in sorted(counts.items()))
        copies, late = (
            sum(bool(one.copies) for one in whole.submissions),
            sum(one.late for one in whole.submissions),
        )
        words = f"{layout}: {whole.handed_in} files and folders, all accounted for; {said}; "
        sys.stdout.write(f"{words}{copies} identical, {late} late\n")
    different = sorted(name for name, values in points.items() if len(values) > 1)
    sys.stdout.write(f"points that depend on the layout: {', '.join(different) or 'none'}\n")
    assert not different


if __name__ == "__main__":
    main(Path(sys.argv[1]), *sys.argv[2:3])
