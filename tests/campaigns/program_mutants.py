"""Findings of ``fcu check`` for random mistakes: ``python -m tests.campaigns.program_mutants --count 1000 --seed 1``.

Each program is student/main.c with one or two (``--tokens 2``) small mistakes, built with one of three optimisations.
The table shows, by operator, how many of the programs that lose points get a finding with a line within two lines of
a mistake, and how many get a finding whose words contain what the operator predicts.
"""

from __future__ import annotations

import argparse
import json
import random
import re
import subprocess
import sys
from collections import Counter
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Final, NamedTuple

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


class Finding(NamedTuple):
    lost: bool
    lines: list[list[int]]
    """Lines of main.c by finding: all in the text."""
    texts: list[str]


def judged(changes: Sequence[Mutant], level: str, folder: Path, number: int) -> Finding | None:
    """Return what ``fcu check`` finds; None if the program does not compile."""
    program = Program(f"mutant{number}", "", tuple(Change("main.c", one.old, one.new) for one in changes))
    try:
        elf = build(program, level, folder)
    except (AssertionError, subprocess.CalledProcessError):
        return None
    record = folder / f"{number}.json"
    command = [sys.executable, "-m", "fcu_emulator", "check", str(elf), "--json", str(record)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if not record.exists():
        raise RuntimeError(done.stderr)
    verdict = json.loads(record.read_text())
    texts = [
        "\n".join([cause["summary"], *cause["details"]])
        for run in verdict["evidence"]
        for cause in run["causes"]
    ]
    texts += [run["stopped"] for run in verdict["evidence"] if run["stopped"]]
    texts += [
        f"{one['title']}: {one['actual']}\n{one['source']}" for one in verdict["checks"] if one["source"]
    ]
    texts = list(dict.fromkeys(texts))
    lost = any(check["points"] < check["max_points"] for check in verdict["checks"])
    return Finding(lost, [[int(one) for one in re.findall(r"main\.c:(\d+)", text)] for text in texts], texts)


def main() -> None:
    """Print a line for each mutant, and the table."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--count", type=int, default=100)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--tokens", type=int, default=1)
    parser.add_argument("--operator", default="")
    parser.add_argument("--jobs", type=int, default=1)
    options = parser.parse_args()
    draw = random.Random(options.seed)
    by_operator: dict[str, list[Mutant]] = {}
    for one in mutants():
        if options.operator in one.operator:
            by_operator.setdefault(one.operator, []).append(one)
    chosen = []
    for number in range(options.count):
        first = draw.choice(by_operator[sorted(by_operator)[number % len(by_operator)]])
        changes = [first]
        while len(changes) < options.tokens:
            other = draw.choice(by_operator[draw.choice(sorted(by_operator))])
            if all(other.line != one.line for one in changes):
                changes.append(other)
        chosen.append(changes)
    total, placed = Counter[str](), Counter[str]()
    with TemporaryDirectory() as name, ThreadPoolExecutor(options.jobs) as pool:
        for level in LEVELS:
            build(Program("warm", ""), level, Path(name))
        results = pool.map(
            lambda item: judged(item[1], LEVELS[item[0] % len(LEVELS)], Path(name), item[0]),
            enumerate(chosen),
        )
        for number, (changes, found) in enumerate(zip(chosen, results, strict=True)):
            if found is None or not found.lost:
                continue
            operator = changes[0].operator
            near = [
                text.split("\n")[0]
                for text, lines in zip(found.texts, found.lines, strict=True)
                if any(abs(line - one.line) <= WITHIN for line in lines for one in changes)
            ]
            total[operator] += 1
            placed[operator] += bool(near)
            mark = "LINE" if near else "----"
            what = " AND ".join(f"{one.line}: {one.new.strip()}" for one in changes)
            _say(f"{mark} {operator} {LEVELS[number % len(LEVELS)]} {what}")
            for text in found.texts:
                _say(f"       {text.splitlines()[0]}")
    for operator in [*total, "all"]:
        numbers = [sum(one.values()) if operator == "all" else one[operator] for one in (total, placed)]
        _say("{:22} {:4} mutants, {:4} with the line".format(operator, *numbers))


def _say(line: str) -> None:
    sys.stdout.write(f"{line}\n")
    sys.stdout.flush()


if __name__ == "__main__":
    main()
