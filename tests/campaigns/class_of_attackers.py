"""A class of 78 attackers and a few honest students, whose points must not depend on the attackers.

``python -m tests.campaigns.class_of_attackers OUT`` grades the honest students alone, then with the attackers, by
LAB3's rubric, into the folder OUT. It prints a line for each attacker and the time. The exit code is 1 if the points
of an honest student have changed, or a submission is missing.
"""

from __future__ import annotations

import os
import shutil
import sys
import time
import zipfile
from collections.abc import Callable, Iterator
from pathlib import Path
from random import Random
from tempfile import TemporaryDirectory

from fcu_emulator.emulator.cli import execute
from fcu_emulator.emulator.grading.results import Graded, GradedClass
from fcu_emulator.firmware_model.arm import prebuilt, sources
from tests.campaigns.class_of_forty import archive, write_hostile
from tests.support.arm.heavy_programs import all_programs
from tests.support.arm.mutations import ANYWHERE, OF_ELF, mutated

ATTACKERS = 78
_HONEST = "honest"
Write = Callable[[Path], None]
"""Function that writes a submission; the path is without a suffix."""


def honest(folder: Path) -> None:
    """Write the shipped programs as files and as source."""
    for name in ("solution", "template"):
        shutil.copyfile(prebuilt(name), folder / f"{_HONEST}-{name}.elf")
        shutil.copytree(sources() / name, folder / f"{_HONEST}-{name}-source")


def _zip(name: str, contents: bytes = b"int main(void) { return 0; }", kind: int = 0) -> Write:
    def write(path: Path) -> None:
        entry = zipfile.ZipInfo("x")
        entry.filename, entry.external_attr = name, kind << 16
        archive(path.with_suffix(".zip"), {entry: contents})

    return write


def _source(text: str, name: str = "main.c") -> Write:
    def write(path: Path) -> None:
        path.mkdir()
        (path / name).write_text(text, encoding="utf-8")

    return write


def _file(suffix: str, contents: bytes) -> Write:
    return lambda path: path.with_name(path.name + suffix).write_bytes(contents) and None


def _named(name: str | bytes) -> Write:
    def write(path: Path) -> None:
        target = os.fsencode(path.parent) + b"/" + (name.encode() if isinstance(name, str) else name)
        Path(os.fsdecode(target)).write_bytes(b"int main(void) { return 0; }")

    return write


def _pipe(path: Path) -> None:
    path.mkdir()
    os.mkfifo(path / "main.c")


def _link(path: Path) -> None:
    path.with_suffix(".c").symlink_to("/etc/passwd")


def _damaged(path: Path, seed: int) -> None:
    random = Random(seed)
    data = prebuilt("solution").read_bytes()
    for _ in range(5):
        data = mutated(data, random, OF_ELF)
    path.with_suffix(".elf").write_bytes(data)


def _hex(path: Path) -> None:
    from tests.arm.test_run_built_firmware import as_intel_hex, flash_contents

    data = as_intel_hex(flash_contents("template")).encode()
    path.with_suffix(".hex").write_bytes(mutated(data, Random(3), ANYWHERE))


_MAIN = "int main(void) { return 0; }\n"
_PLUS = "1" + "+1" * 200_000
_FORGED = "cc1: fatal error: Killed signal terminated program cc1: No space left on device"
KINDS: dict[str, Write] = {
    "entry without a name": _zip(""),
    "entry of dots": _zip(".."),
    "absolute entry": _zip("/etc/main.c"),
    "entry on a drive": _zip("C:\\main.c"),
    "device in an archive": _zip("main.c", kind=0o020666),
    "entry of 300 characters": _zip("x" * 300 + ".c"),
    "entry with control characters": _zip("\x1b[2J.c"),
    "archive of noise": _file(".zip", Random(1).randbytes(5000)),
    "empty archive": _file(".zip", b""),
    "damaged archive": _file(".zip", b"PK\x05\x06" + b"\xff" * 18),
    "another archive": _file(".rar", b"Rar!"),
    "name that is not UTF-8": _named(b"jos\xe9.c"),
    "name with an escape sequence": _named("\x1b]0;owned\x07.c"),
    "name that reorders": _named("\u202ec.evil.c"),
    "name that is a formula": _named("=HYPERLINK(1).c"),
    "name with two ids": _named("Eve_4242_assignsubmission_file_x_1815_assignsubmission_file_.c"),
    "name that is an option": _named("-rf.c"),
    "name on two lines": _named("two\nlines.c"),
    "pipe": _pipe,
    "link": _link,
    "includes itself": _source('#include "main.c"\n'),
    "includes a device": _source('#include "/dev/zero"\n'),
    "includes a terminal": _source('#include "/dev/ptmx"\n' + _MAIN),
    "reads a file with the assembler": _source('asm(".incbin \\"/etc/shadow\\"");\n' + _MAIN),
    "repeats in the assembler": _source('asm(".rept 100000000\\n.word 1\\n.endr");\n' + _MAIN),
    "nests macros": _source(
        "#define A(x) x x x x x x x x x x\nint z = A(A(A(A(A(A(A(A(A(1)))))))));\n" + _MAIN
    ),
    "adds 200,000 numbers": _source(f"int z(int a) {{ return a+{_PLUS}; }}\n" + _MAIN),
    "forges a full disk": _source(f'#error "{_FORGED}"\n'),
    "prints escape sequences while compiling": _source('#error "\x1b[2J\x1b]0;owned\x07"\n'),
    "gives 10,000 warnings": _source("".join(f"static int u{n};\n" for n in range(10_000)) + _MAIN),
    "name that make expands": _source(_MAIN, "$(shell touch owned).c"),
    "damaged ELF": lambda path: _damaged(path, 1),
    "more damaged ELF": lambda path: _damaged(path, 2),
    "damaged HEX": _hex,
}


def _attacker(number: int) -> str:
    """Return the name of an attacker's entry, which has no meaning."""
    return f"attacker-{number:02}"


def attackers(folder: Path) -> Iterator[str]:
    """Write 78 hostile submissions into ``folder``; return the attack of each."""
    write_hostile(folder)
    yield from (path.stem for path in sorted(folder.iterdir()))
    for number, (what, write) in enumerate(KINDS.items()):
        write(folder / _attacker(number))
        yield what
    left = ATTACKERS - len(list(folder.iterdir()))
    programs = all_programs()
    step = len(programs) / left
    for number in range(left):
        what = list(programs)[int(number * step)]
        (folder / f"{_attacker(90 + number)}.bin").write_bytes(programs[what])
        yield what


def grade(folder: Path, out: Path, salt: Path) -> tuple[int, GradedClass]:
    """Return the exit code and the graded class."""
    code = execute(["grade", str(folder), "--rubric", "lab3", "--out", str(out), "--salt", str(salt)])
    return int(code), GradedClass.from_json((out / "grade.json").read_bytes())


def main(out: Path) -> int:
    """Grade both classes and compare them; return 1 if an honest student has lost or gained points."""
    with TemporaryDirectory() as scratch:
        alone, together = Path(scratch) / "alone", Path(scratch) / "together"
        alone.mkdir()
        together.mkdir()
        honest(alone)
        _, before = grade(alone, out / "alone", out / "salt.key")
        did = list(attackers(together))
        entries = len(list(together.iterdir()))
        honest(together)
        began_s = time.monotonic()
        code, after = grade(together, out / "together", out / "salt.key")
        took_s = time.monotonic() - began_s
    for one in after.submissions:
        points = "-" if one.points is None else f"{one.points:g}"
        sys.stdout.write(f"{one.id[:40]!r:<44} {one.status:<9} {points:>5}  {one.reason[:110]}\n")
    changed = _points(before) != _points(after)
    lost = len(after.submissions) != entries + len(before.submissions)
    sys.stdout.write(f"{entries} attackers, {len(did)} kinds; exit code {code}; {took_s:.0f} s\n")
    sys.stdout.write(
        f"honest: {'CHANGED' if changed else _points(after)}{'; SUBMISSIONS LOST' if lost else ''}\n"
    )
    return int(changed or lost or entries != ATTACKERS)


def _points(whole: GradedClass) -> dict[str, float | None]:
    """Return the points of the honest students."""
    ours: list[Graded] = [one for one in whole.submissions if one.id.startswith(_HONEST)]
    return {one.id: one.points for one in ours}


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1])))
