"""An artificial class, judged by the lab's rubric, with the checks that each program should fail.

The class has the shipped solution with one more exercise in each program, and other correct programs. It also has
programs with one typical mistake each (tests/arm/mistakes), and a program that prints constants without reading a
sensor.

``python -m tests.support.arm.graded_programs [NAME ...]`` judges all programs, or the named programs, ten seconds
each, prints a table of programs and points, and lists programs with unexpected points.
"""

from __future__ import annotations

import shutil
import sys
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from tempfile import mkdtemp

from fcu_emulator.emulator.grading.judge import judge
from fcu_emulator.emulator.grading.rubric import load_rubric
from fcu_emulator.emulator.grading.verdict import Verdict
from fcu_emulator.firmware_model import arm
from tests.support.arm import student_programs
from tests.support.arm.student_programs import Change, Program, build

EXERCISES = ("1", "2", "3", "4", "5")
OPTIMISATION = "O2"

_UNDONE = (
    (2, "    PrintPlot();\n"),
    (3, '  PRINTF("Pitch: %f deg Roll: %f deg Yaw: %f deg \\n\\r", pitch, roll, azimuth);\n'),
    (3, "  eCompass();\n"),
    (3, "  Show(LED1, pitch);\n"),
    (4, "  Show(LED2, roll);\n"),
    (5, "  MagCalibration();\n"),
)
"""Each line of the solution's main.c that an exercise adds, with the number of the exercise."""

CONSTANTS = Program(
    "constants",
    "Prints constants, and reads the sensors for the looks of it",
    (
        Change("main.c", "acc.AXIS_X, acc.AXIS_Y, acc.AXIS_Z);", "0, 0, 1000);"),
        Change("main.c", "gyro.AXIS_X, gyro.AXIS_Y, gyro.AXIS_Z);", "0, 0, 0);"),
        Change("main.c", "mag.AXIS_X, mag.AXIS_Y, mag.AXIS_Z);", "200, 0, -400);"),
        Change("main.c", '"Pre: %f hPa \\n\\r", press', '"Pre: %f hPa \\n\\r", 985.0'),
        Change("main.c", "pitch, roll, azimuth);\n    PRINTF", "0.0, 0.0, 0.0);\n    PRINTF"),
        Change("main.c", '"Altitude: %f m \\n\\r", alt', '"Altitude: %f m \\n\\r", 0 * alt'),
        Change("main.c", "fabsf(pitch) > 80", "fabsf(pitch) > 800"),
        Change("main.c", "fabsf(roll) > 80", "fabsf(roll) > 800"),
    ),
)

CONSTANTS_LOSE = (
    *("1.acc", "1.gyr", "1.mag", "1.pre", "2.altitude"),
    *("3.pitch", "3.roll", "3.yaw", "3.led1", "4.led2", "5.yaw"),
)


def staged(done: int, into: Path) -> Path:
    """Build the shipped solution with exercises 1 to ``done``."""
    project = Path(mkdtemp(prefix=f"stage-{done}-", dir=into))
    shutil.copytree(student_programs.base(OPTIMISATION, "I2C2", into), project, dirs_exist_ok=True)
    for name in ("main.c", "motion.c", "motion.h"):
        shutil.copyfile(arm.sources() / "solution" / name, project / name)
    main = project / "main.c"
    text = main.read_text()
    for exercise, line in _UNDONE:
        assert text.count(line) == 1, line
        text = text.replace(line, "") if exercise > done else text
    main.write_text(text)
    return student_programs.make(project, OPTIMISATION, "I2C2", {})


def lost(verdict: Verdict) -> tuple[str, ...]:
    """Return the checks that have points and did not give all their points."""
    return tuple(check.check for check in verdict.checks if check.points < check.max_points)


def loses(program: Program) -> tuple[str, ...]:
    """Return the checks that a program should fail; the number of an exercise means all its checks."""
    return tuple(one for one in expected(0) if {one, one.partition(".")[0]} & set(program.loses))


def expected(done: int) -> tuple[str, ...]:
    """Return the checks that a program with exercises 1 to ``done`` should fail."""
    rubric = load_rubric("lab3")
    return tuple(
        f"{exercise.id}.{check.id}"
        for exercise in rubric.exercises
        if int(exercise.id) > done
        for check in exercise.check
        if check.points
    )


def a_class(into: Path) -> Iterator[tuple[str, Callable[[], Path], tuple[str, ...]]]:
    """Yield name, builder of the ELF file, and checks that should fail, one program after the other."""
    for done in range(1, len(EXERCISES) + 1):
        yield f"exercises 1 to {done}", partial(staged, done, into), expected(done)
    yield CONSTANTS.name, partial(build, CONSTANTS, OPTIMISATION, into), CONSTANTS_LOSE
    for table in ("variants.toml", "mistakes.toml"):
        for program in student_programs.programs(table).values():
            yield program.name, partial(build, program, OPTIMISATION, into), loses(program)


def _print_table(names: list[str]) -> int:
    rubric, wrong = load_rubric("lab3"), 0
    for name, elf, should_lose in a_class(Path(mkdtemp())):
        if names and name not in names:
            continue
        verdict = judge(elf(), rubric, seed=1)
        found = lost(verdict)
        sums = " ".join(f"{sum(one.points for one in verdict.of(exercise)):4g}" for exercise in EXERCISES)
        lines = [f"{name:<30} {verdict.points:5g}  {sums}  {' '.join(found)}"]
        if found != should_lose:
            wrong += 1
            lines.append(f"{'':30} should lose {' '.join(should_lose) or 'nothing'}")
        sys.stdout.writelines(f"{line}\n" for line in lines)
        sys.stdout.flush()
    return wrong


if __name__ == "__main__":
    sys.exit(_print_table(sys.argv[1:]) > 0)
