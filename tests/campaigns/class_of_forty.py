"""An artificial class, which is graded like a real class: from the submitted files to the table of points.

The class has the programs of :mod:`tests.support.arm.graded_programs` (the exercises one after the other, correct
variants, typical mistakes, constants), and other submissions: hostile programs and archives, no program, two programs.

``python -m tests.campaigns.class_of_forty OUT [NAME ...]`` grades all programs, or the named programs, into the folder
OUT, prints the table, and lists the students with unexpected points.
"""

from __future__ import annotations

import shutil
import sys
import zipfile
from collections.abc import Iterator, Mapping
from pathlib import Path
from tempfile import TemporaryDirectory

from fcu_emulator.emulator.cli import execute
from fcu_emulator.emulator.grading.results import Graded, GradedClass
from fcu_emulator.firmware_model.arm import prebuilt
from tests.support.arm import student_programs

EVIL_TEXT = r"<script>document.title = 1</script>\033[2J\033]0;owned\007</pre>"
_PRINT = 'PRINTF("Altitude: %f m \\n\\r", alt);'
_IN_MAIN = "  BSP_LED_Init(LED1);\n"
SOURCES = {
    "writes markup and escape sequences": (_PRINT, f'{_PRINT}\n    PRINTF("{EVIL_TEXT}\\n");'),
    "does not compile": ("float pitch, roll, azimuth;", "float pich, roll, azimuth;"),
    "includes a file of the grader's": ("#include <math.h>", '#include "/etc/passwd"\n#include <math.h>'),
    "floods the terminal": (_IN_MAIN, 'for (;;) PRINTF("all work and no play ");\n'),
    "crashes": (_IN_MAIN, "((void (*)(void))0x20000001)();\n"),
    "spins for ever": (_IN_MAIN, "for (volatile int i = 0;; i++) { }\n"),
    "resets for ever": (_IN_MAIN, "*(volatile uint32_t *)0xE000ED0C = 0x05FA0004;\n"),
}
"""Changes of the correct program, by their result."""
JUDGED = {
    "writes markup and escape sequences": 20.0,
    "floods the terminal": 1.0,
    "crashes": 0.0,
    "spins for ever": 1.0,
    "resets for ever": 0.0,
}
"""Points of the programs that are judged. A program that floods or loops continues to run, which gives one point."""
REJECTED = {
    "does not compile": "does not compile",
    "includes a file of the grader's": "No such file",
    "zip bomb": "times its size",
    "leads out of its archive": "../main.c",
    "link in an archive": "link or a device",
    "no file": "no program",
    "two programs": "0.elf, 1.elf",
    "wrong chip": "x86-64",
    "no program but a text": "is a text",
}
"""Reasons for the programs that are not judged."""


def write_hostile(folder: Path) -> None:
    """Write an entry for each of :data:`JUDGED` and :data:`REJECTED`, with its name."""
    right = (student_programs.FOLDER / "student" / "main.c").read_text(encoding="utf-8")
    for name, (old, new) in SOURCES.items():
        assert right.count(old) == 1, old
        (folder / name).mkdir(parents=True)
        (folder / name / "main.c").write_text(right.replace(old, new), encoding="utf-8")
    archive(folder / "zip bomb.zip", {"lab3.elf": bytes(40 << 20)})
    archive(folder / "leads out of its archive.zip", {"../main.c": b"int main(void) { return 0; }"})
    link = zipfile.ZipInfo("main.c")
    link.create_system, link.external_attr = 3, 0o120777 << 16
    archive(folder / "link in an archive.zip", {link: b"/etc/passwd"})
    (folder / "no file").mkdir()
    (folder / "two programs").mkdir()
    for number, program in enumerate(("solution", "template")):
        shutil.copyfile(prebuilt(program), folder / "two programs" / f"{number}.elf")
    foreign = bytearray(prebuilt("solution").read_bytes())
    foreign[18] = 0x3E  # e_machine: x86-64
    (folder / "wrong chip.elf").write_bytes(foreign)
    (folder / "no program but a text.elf").write_text("Please see the e-mail.", encoding="utf-8")


def archive(path: Path, files: Mapping[str | zipfile.ZipInfo, bytes]) -> None:
    """Return a zip file with these files."""
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as target:
        for name, data in files.items():
            target.writestr(name, data)


def grade(folder: Path, out: Path, rubric: str = "lab3") -> GradedClass:
    """Return the result of ``fcu grade`` for the submissions in ``folder``."""
    code = execute(["grade", str(folder), "--rubric", rubric, "--out", str(out)])
    assert code == 0, code
    return GradedClass.from_json((out / "grade.json").read_bytes())


def wrong(one: Graded, loses: Mapping[str, tuple[str, ...]]) -> str:
    """Return the difference of a grade from the expected grade, or ""."""
    name = one.id
    if name in REJECTED:
        fits = one.status == "rejected" and one.points is None and REJECTED[name] in one.reason
        return "" if fits else f"should be rejected: {REJECTED[name]}"
    if name in JUDGED:
        return "" if one.points == JUDGED[name] else f"should get {JUDGED[name]:g}"
    found = lost(one)
    return "" if found == loses[name] else f"should lose {' '.join(loses[name]) or 'nothing'}"


def lost(one: Graded) -> tuple[str, ...]:
    """Return the checks that did not give all their points."""
    checks = one.verdict.checks if one.verdict else ()
    return tuple(check.check for check in checks if check.points < check.max_points)


def table(whole: GradedClass, loses: Mapping[str, tuple[str, ...]]) -> Iterator[str]:
    """Yield a line for each program, and another line for each program with unexpected points."""
    for one in whole.submissions:
        points = "-" if one.points is None else f"{one.points:g}"
        yield f"{one.id:<36} {points:>5}  {one.reason or ' '.join(lost(one))}"
        if problem := wrong(one, loses):
            yield f"{'':36} {'!':>5}  {problem}"


def main(out: Path, names: list[str]) -> int:
    """Write the class, grade it, print the table; return the number of unexpected results."""
    from tests.support.arm import graded_programs

    loses = {}
    with TemporaryDirectory() as scratch:
        folder = Path(scratch) / "submissions"
        write_hostile(folder)
        for name, build, expected in graded_programs.a_class(Path(scratch)):
            if names and name not in names:
                continue
            loses[name] = expected
            (folder / name).mkdir()
            shutil.copyfile(build(), folder / name / "lab3.elf")
        for path in folder.iterdir() if names else ():
            if path.stem not in names:
                shutil.rmtree(path) if path.is_dir() else path.unlink()
        whole = grade(folder, out)
    for line in table(whole, loses):
        sys.stdout.write(f"{line}\n")
    return sum(bool(wrong(one, loses)) for one in whole.submissions)


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1]), sys.argv[2:]) > 0)
