"""Explanations of random wrong formulas: ``python -m tests.campaigns.formula_mutants --count 200 --seed 1``.

Each program is student/main.c with one token of a formula changed. The table shows, by operator, how many explanations
name a line within two lines of the change, and how many give a formula. Programs that print the same numbers are
omitted.
"""

from __future__ import annotations

import argparse
import random
import re
import subprocess
import sys
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import NamedTuple

from tests.arm.test_explained_formulas import WITHIN, explained
from tests.support.arm.student_programs import FOLDER, Change, Program, build

SOURCE = (FOLDER / "student" / "main.c").read_text()
FUNCTIONS = ("MagCalibration", "eCompass", "getAltitude")
LEVELS = ("O0", "Og", "O2")

NAMES = ("gx", "gy", "gz", "bx", "by", "bz", "by2", "bz2", "bx3", "pitch", "roll", "azimuth", "p", "celsius")
AXES = ("AXIS_X", "AXIS_Y", "AXIS_Z")
SWAPS = {
    "function": {"sinf": ("cosf", "tanf"), "cosf": ("sinf", "tanf"), "sqrtf": ("fabsf",), "pow": ("fmax",)},
    "operator": {" + ": (" - ",), " - ": (" + ",), " * ": (" / ", " + "), " / ": (" * ",)},
    "sign": {"-gx": ("gx",), "(by2": ("(-by2",), "= bz": ("= -bz",), "= by": ("= -by",)},
    "comparison": {" < ": (" > ",), " > ": (" < ",)},
    "extreme": {"mag_max": ("mag_min",), "mag_min": ("mag_max",)},
    "array": {"mag.": ("acc.",), "acc.": ("mag.",)},
    "number": {
        "180": ("360", "90", "100"),
        "273.15": ("273.15f * 2", "0", "373.15"),
        "0.0065": ("0.065", "0.65"),
        "5.257": ("5.275", "2.257"),
        ") / 2": (") / 3", ") * 2", ") / 4"),
    },
    "axis": {axis: tuple(one for one in AXES if one != axis) for axis in AXES},
    "name": {name: tuple(one for one in NAMES if one != name) for name in NAMES},
}


class Mutant(NamedTuple):
    """A change of one token. ``old`` is the whole line, so that it is unique."""

    operator: str
    line: int
    old: str
    new: str


def mutants() -> Iterator[Mutant]:
    lines = SOURCE.split("\n")
    inside = False
    for number, line in enumerate(lines, start=1):
        if any(line.startswith((f"void {one}(", f"float {one}(")) for one in FUNCTIONS):
            inside = True
        elif line.startswith("}"):
            inside = False
        elif inside and SOURCE.count(line) == 1 and line.strip() != "{":
            for operator, table in SWAPS.items():
                for old, news in table.items():
                    pattern = rf"\b{re.escape(old)}\b" if old.replace("_", "").isalnum() else re.escape(old)
                    for match in re.finditer(pattern, line):
                        if operator == "name" and re.match(r"\s*(?:float )?\S+ =", line[match.start() :]):
                            continue  # the variable that is set
                        for new in news:
                            changed = line[: match.start()] + new + line[match.end() :]
                            yield Mutant(operator, number, line, changed)


def main() -> None:
    """Print a line for each mutant, and the table."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--count", type=int, default=100)
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    chosen = random.Random(options.seed).sample(list(mutants()), options.count)
    total, placed, caused = Counter[str](), Counter[str](), Counter[str]()
    with TemporaryDirectory() as folder:
        for number, one in enumerate(chosen):
            level = LEVELS[number % len(LEVELS)]
            program = Program(f"mutant{number}", "", (Change("main.c", one.old, one.new),))
            try:
                found = explained(build(program, level, Path(folder)))
            except (AssertionError, subprocess.CalledProcessError):
                continue  # it does not compile
            summaries = [each.diagnosis.summary for each in found]
            lines = [int(line) for text in summaries for line in re.findall(r"main\.c:(\d+)", text)]
            total[one.operator] += 1
            placed[one.operator] += any(abs(line - one.line) <= WITHIN for line in lines)
            caused[one.operator] += bool(found)
            _say(f"{level} {one.line} {one.new.strip()} -> {'; '.join(summaries) or 'nothing'}")
    for operator in [*total, "all"]:
        numbers = [
            sum(one.values()) if operator == "all" else one[operator] for one in (total, placed, caused)
        ]
        _say("{:12} {:4} mutants, {:4} with the line, {:4} with a formula".format(operator, *numbers))


def _say(line: str) -> None:
    sys.stdout.write(f"{line}\n")
    sys.stdout.flush()


if __name__ == "__main__":
    main()
