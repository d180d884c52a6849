"""Findings of ``fcu check`` for random mistakes: ``python -m tests.campaigns.program_mutants --count 1000 --seed 1``.

Each program is student/main.c with one or two (``--tokens 2``) small changes, built with one of three optimisations.
The table shows, by the kind of change, how many programs lose points, how many of these get a finding with a line
within two lines of a change, and how many get a finding that names a mistake.
"""

from __future__ import annotations

import argparse
import random
import re
import shutil
import subprocess
import sys
from collections import Counter
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Final, NamedTuple

from fcu_emulator.emulator.grading.judge import judge
from fcu_emulator.emulator.grading.rubric import load_rubric
from tests.arm.test_explained_formulas import WITHIN
from tests.support.arm.student_programs import FOLDER, Change, Program, build

SOURCE: Final = (FOLDER / "student" / "main.c").read_text()
LEVELS: Final = ("O0", "Og", "O2")
FIRST_LINE: Final = SOURCE[: SOURCE.index("void MagCalibration")].count("\n") + 1

AXES: Final = ("AXIS_X", "AXIS_Y", "AXIS_Z")
LOCALS: Final = ("gx", "gy", "gz", "bx", "by", "bz", "by2", "bz2", "bx3", "pitch", "roll", "azimuth")
SENSORS: Final = ("acc", "gyro", "mag")


def _others(names: Sequence[str]) -> dict[str, Sequence[str]]:
    return {rf"\b{one}\b": [other for other in names if other != one] for one in names}


OPERATORS: Final[dict[str, dict[str, Sequence[str]]]] = {
    "axis": _others(AXES),
    "name": _others(LOCALS),
    "sensor": {rf"\b{one}\.": [f"{other}." for other in SENSORS if other != one] for one in SENSORS},
    "function": {r"\bsinf\b": ["cosf", "tanf"], r"\bcosf\b": ["sinf", "tanf"], r"\bpow\b": ["fmax"]},
    "root": {r"\bsqrtf\b": ["fabsf", "cbrtf"]},
    "plus": {r" \+ ": [" - ", " * "]},
    "minus": {r"(?<!=) - ": [" + "]},
    "times": {r" \* ": [" / ", " + "]},
    "divide": {r" / ": [" * "]},
    "sign lost": {r"-gx": ["gx"], r"= -": ["= "]},
    "sign added": {r"\((?=by2|gy|pitch|roll)": ["(-"], r"= (?=acc\.|mag\.|b[xyz] )": ["= -"]},
    "arguments exchanged": {
        r"atan2f\(by2, bx3\)": ["atan2f(bx3, by2)"],
        r"atan2f\((-?g[xy]), (sqrtf\(.*\))\)": [r"atan2f(\2, \1)"],
        r"&acc, &gyro": ["&gyro, &acc"],
        r"&gyro, &mag": ["&mag, &gyro"],
        r"press_zero_level / p\b": ["p / press_zero_level"],
    },
    "other function": {r"atan2f\((by2|-?g[xy]), ": [r"atanf(\1 / "], r"sqrtf\((.*)\)\)": [r"(\1))"]},
    "comparison": {r" < ": [" > "], r" > ": [" < "]},
    "threshold": {r"> 80": ["> 8", "> 60", "> 90", "> 1.4f"]},
    "extreme": {r"\bmag_max\b": ["mag_min"], r"\bmag_min\b": ["mag_max"]},
    "number": {
        r"\b180\b": ["360", "90", "100"],
        r"\b273\.15\b": ["0", "373.15"],
        r"\b0\.0065\b": ["0.065", "0.65"],
        r"\b5\.257\b": ["5.275", "2.257"],
        r"\) / 2\b": [") / 3", ") * 2", ") / 4"],
        r"\b1000\b(?!0)": ["100", "10000"],
    },
    "integer division": {r"1 / 5\.257": ["1 / 5"]},
    "degrees": {r" \* 180 / PI": ["", " * PI / 180"]},
    "initial value": {r"\{10000, 10000, 10000\}": ["{0, 0, 0}"], r"\{-10000.*\}": ["{0, 0, 0}"]},
    "assignment": {r" -= ": [" += ", " = "]},
    "call lost": {
        rf"^  {one};": ["  ;"]
        for one in (
            r"MagCalibration\(\)",
            r"eCompass\(\)",
            r"ReadSensorRawData\(.*\)",
            r"LPS22HB_Get_Press\(&press\)",
            r"LPS22HB_Get_Temp\(&temperature\)",
            r"LPS22HB_WaitForData\(\)",
            r"initializeAllSensors\(\)",
            r"enableAllSensors\(\)",
            r"HAL_TIM_Base_Start_IT\(&htim9\)",
            r"press_zero_level = press",
        )
    },
    "call added": {r"^  samples\+\+;": ["  samples++; HAL_Delay(1);", '  samples++; PRINTF("%d", samples);']},
    "absolute value": {r"\bfabsf\b": ["", "abs"]},
    "LED": {r"\bLED1\b": ["LED2"], r"\bLED2\b": ["LED1"]},
    "switch": {r"LED_On\b": ["LED_Off"], r"LED_Off\b(?=.*[12]\);\n  })": ["LED_On"]},
    "printed": {
        r"pitch, roll, azimuth\)": ["roll, pitch, azimuth)", "pitch, roll, pitch)", "pitch, azimuth, roll)"],
        r"\\r\", press\)": ['\\\\r", temperature)', '\\\\r", press_zero_level)', '\\\\r", alt)'],
        r"\\r\", alt\)": ['\\\\r", press)', '\\\\r", pitch)'],
    },
    "format": {r"%f": ["%d", "%.0f"], r"%d": ["%f", "%u", "%x"]},
    "label": {r"(?<=\")ACC|GYR|MAG": ["TMP"], r"Altitude:": ["Alt:"], r"Pre:": ["Press:"], r"Yaw:": ["yaw:"]},
    "unit": {r"mdps": ["dps"], r"hPa": ["mbar"], r" deg": [""], r" mg ": [" g "]},
    "type": {r"^  float (?=g|b)": ["  int "], r"^float (?=pitch)": ["int "], r"(?<=\()float p\b": ["int p"]},
    "scale": {r"= (acc|mag)\.AXIS_X": [r"= 2 * \1.AXIS_X", r"= \1.AXIS_X / 1000"]},
    "volatile": {r"volatile uint32_t": ["uint32_t"]},
    "wrong read": {
        r"Get_Temp\(&temperature\)": ["Get_Press(&temperature)"],
        r"Get_Press\(&press\)": ["Get_Temp(&press)"],
    },
    "condition": {r"\(fabsf\((pitch|roll)\) > 80\)": [r"(\1 > 80)", r"(fabsf(\1) > 80 || 1)"]},
    "condition's variable": {
        r"fabsf\(pitch\)": ["fabsf(roll)", "fabsf(azimuth)"],
        r"fabsf\(roll\)": ["fabsf(pitch)"],
    },
}


class Mutant(NamedTuple):
    """A change of one line, which is unique in the source."""

    operator: str
    line: int
    old: str
    new: str


def mutants() -> Iterator[Mutant]:
    for number, line in enumerate(SOURCE.split("\n"), start=1):
        if SOURCE.count(line) != 1 or not line.strip() or line.startswith(("/*", "#")):
            continue
        for operator, table in OPERATORS.items():
            for pattern, news in table.items():
                for match in re.finditer(pattern, line):
                    if operator == "name" and re.match(r"\s*=(?!=)", line[match.end() :]):
                        continue  # the variable that is set
                    for new in news:
                        yield Mutant(
                            operator,
                            number,
                            line,
                            line[: match.start()] + match.expand(new) + line[match.end() :],
                        )


class Judged(NamedTuple):
    """What a program's verdict says: ``places``, the lines of main.c; ``causes``, the findings in words."""

    changes: tuple[Mutant, ...]
    level: str
    places: frozenset[int]
    causes: tuple[str, ...]


SAID: Final = frozenset({"", "missing", "wrong value", "stopped", "prerequisite"})
"""Findings that only tell a difference. Other findings name a mistake, such as "never lit" or "wrong format"."""


def judged(changes: tuple[Mutant, ...], level: str, folder: Path) -> Judged | None:
    """Build and judge a program; None if it does not compile, or loses no points."""
    program = Program("mutant", "", tuple(Change("main.c", one.old, one.new) for one in changes))
    try:
        elf = build(program, level, folder)
    except (AssertionError, subprocess.CalledProcessError):
        return None
    verdict = judge(str(elf), load_rubric("lab3"), seed=0)
    shutil.rmtree(elf.parent)
    failed = [one for one in verdict.checks if one.points < one.max_points]
    if not failed:
        return None
    causes = [cause for run in verdict.evidence for cause in run.causes]
    texts = [" ".join((cause.summary, *cause.details)) for cause in causes]
    texts += [one.source for one in failed]
    lines = {int(line) for text in texts for line in re.findall(r"main\.c:(\d+)", text)}
    words = [cause.summary for cause in causes]
    words += [f"{one.title}: {one.actual}" for one in failed if one.finding not in SAID]
    return Judged(changes, level, frozenset(lines), tuple(dict.fromkeys(words)))


def drawn(count: int, seed: int, tokens: int, wanted: str) -> Iterator[tuple[tuple[Mutant, ...], str]]:
    """Yield changes and the optimisation; every operator is used equally often with each optimisation."""
    random_ = random.Random(seed)
    by_operator: dict[str, list[Mutant]] = {}
    for one in mutants():
        if wanted in one.operator:
            by_operator.setdefault(one.operator, []).append(one)
    operators = sorted(by_operator)
    for number in range(count):
        changes = [random_.choice(by_operator[operators[number % len(operators)]])]
        while len(changes) < tokens:
            other = random_.choice(by_operator[random_.choice(operators)])
            if all(other.line != one.line for one in changes):
                changes.append(other)
        yield tuple(changes), LEVELS[number // len(operators) % len(LEVELS)]


def main() -> None:
    """Print a line for each program that loses points, and the table."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--count", type=int, default=100)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--tokens", type=int, default=1)
    parser.add_argument("--operator", default="", help="a part of the names of the operators")
    parser.add_argument("--jobs", type=int, default=1)
    options = parser.parse_args()
    total, placed, caused = Counter[str](), Counter[str](), Counter[str]()
    chosen = list(drawn(options.count, options.seed, options.tokens, options.operator))
    with TemporaryDirectory() as name, ProcessPoolExecutor(options.jobs) as pool:
        results = pool.map(judged, *zip(*chosen, strict=True), [Path(name)] * len(chosen))
        for found in results:
            if found is None:
                continue
            operator = found.changes[0].operator
            near = any(abs(line - one.line) <= WITHIN for line in found.places for one in found.changes)
            total[operator] += 1
            placed[operator] += near
            caused[operator] += bool(found.causes)
            what = " AND ".join(f"{one.line}: {one.new.strip()}" for one in found.changes)
            _say(
                f"{'LINE' if near else '----'} {'CAUSE' if found.causes else '-----'} {operator} {found.level} {what}"
            )
            for text in found.causes:
                _say(f"       {text}")
    _say("| change | programs | line named | cause named |\n|---|---|---|---|")
    for operator in [*sorted(total), "all"]:
        counts = [
            sum(one.values()) if operator == "all" else one[operator] for one in (total, placed, caused)
        ]
        _say(f"| {operator} | {counts[0]} | {counts[1]} | {counts[2]} |")


def _say(line: str) -> None:
    sys.stdout.write(f"{line}\n")
    sys.stdout.flush()


if __name__ == "__main__":
    main()
