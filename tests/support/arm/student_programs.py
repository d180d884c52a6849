"""Programs of students: changes of one correct LAB3, built with make in the way that ``fcu new`` sets up.

The objects of the unchanged program are built once for each optimisation and bus and copied, so that a program only
costs the compilation of its changes.

``python -m tests.support.arm.student_programs`` writes the messages in
tests/arm/mistakes/messages.md and docs/mistakes.md again.
"""

from __future__ import annotations

import itertools
import re
import shutil
import subprocess
import sys
import tomllib
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from tempfile import mkdtemp
from typing import Any

from fcu_emulator import Board
from fcu_emulator.emulator.analysis.mistakes import explain
from fcu_emulator.emulator.analysis.recorder import TruthRecorder
from fcu_emulator.emulator.chip.diagnosis import Diagnosis
from fcu_emulator.firmware_model import arm

FOLDER = Path(__file__).parents[2] / "arm" / "mistakes"
OPTIMISATIONS = ("O0", "O2")
COMPILER = "arm-none-eabi-gcc"


@dataclass(frozen=True)
class Change:
    """A change of ``old``, which must occur in ``file`` exactly ``times`` times."""

    file: str
    old: str
    new: str
    times: int = 1


@dataclass(frozen=True)
class Program:
    """A student's program: its changes, and its run."""

    name: str
    title: str
    change: tuple[Change, ...] = ()
    scenario: str | None = None
    wiring: str | None = None
    bus: str = "I2C2"
    seconds: float = 2.2
    silent: str = ""
    add: tuple[str, ...] = ()
    """Files of tests/arm/mistakes that are added beside main.c, or replace it."""
    make: dict[str, str] = field(default_factory=dict)
    loses: tuple[str, ...] = ()
    """The checks of the lab's rubric that the program fails; see tests/support/arm/graded_programs.py."""
    leads: tuple[str, ...] = ()
    """Words that both ``fcu run`` and ``fcu check`` must show for this program."""


def programs(file: str) -> dict[str, Program]:
    """Return the programs of one table."""
    with (FOLDER / file).open("rb") as table:
        return {name: _program(name, entry) for name, entry in tomllib.load(table).items()}


def _program(name: str, entry: dict[str, Any]) -> Program:
    changes = tuple(Change(**change) for change in entry.pop("change", ()))
    lists = {key: tuple(entry.pop(key, ())) for key in ("add", "loses", "leads")}
    return Program(name, entry.pop("title"), changes, **lists, **entry)


def is_buildable() -> bool:
    """Return whether this machine has the compiler and make."""
    return all(map(shutil.which, (COMPILER, "make")))


def build(program: Program, optimisation: str, into: Path) -> Path:
    """Build the program in a new folder of ``into``; return the ELF file. A change that does not match is an error."""
    project = Path(mkdtemp(prefix=f"{program.name}-{optimisation}-", dir=into))
    shutil.copytree(base(optimisation, program.bus, into), project, dirs_exist_ok=True)
    for name in program.add:
        target = project / ("main.c" if name.startswith("main_") else Path(name).name)
        shutil.copyfile(FOLDER / name, target)
    for change in program.change:
        file = project / change.file
        text = file.read_text()
        assert text.count(change.old) == change.times, f"{change.file} has not {change.old!r}"
        file.write_text(text.replace(change.old, change.new))
    return make(project, optimisation, program.bus, program.make)


@cache
def base(optimisation: str, bus: str, into: Path) -> Path:
    """Build the student's program without changes."""
    project = Path(mkdtemp(prefix=f"student-{optimisation}-{bus}-", dir=into))
    shutil.copytree(arm.sources() / "support", project / "support")
    shutil.copy2(arm.sources() / "scaffold" / "Makefile", project)
    shutil.copy2(FOLDER / "student" / "main.c", project)
    make(project, optimisation, bus, {})
    return project


def make(project: Path, optimisation: str, bus: str, settings: dict[str, str]) -> Path:
    """Run make, and return the ELF file."""
    given = [f"{name}={value}" for name, value in settings.items()]
    command = ["make", "-s", f"OPT=-{optimisation}", f"BUS={bus}", *given]
    done = subprocess.run(command, cwd=project, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return project / "lab3.elf"


def explanations(
    program: Program, file: Path, seconds: float | None = None, scenario: str | None = None
) -> list[str]:
    """Return the explanations of a run: each finding without lists of callers and transfers."""
    board = Board(file, wiring=program.wiring, scenario=scenario or program.scenario)
    recorder = TruthRecorder(board)
    board.run_for(program.seconds if seconds is None else seconds)
    return [_short(diagnosis) for diagnosis in explain(board, recorder)]


def _short(diagnosis: Diagnosis) -> str:
    """Return the lines before the first list."""
    sentences = itertools.takewhile(lambda line: not line.endswith(":"), diagnosis.details)
    return "\n".join((diagnosis.summary, *(f"  {line}" for line in sentences)))


def without_numbers(text: str) -> str:
    """Return a text without times, addresses and counts, which depend on compiler and optimisation.

    Places in the source remain, because they depend on neither.
    """
    return re.sub(r"(?<![\w.:])-?(?:0x[0-9A-F]+|\d+(?:\.\d+)?)", "#", text)


MESSAGES = FOLDER / "messages.md"
GUIDE = Path(__file__).parents[3] / "docs" / "mistakes.md"
"""The guide has the first line of each message, and some whole messages."""
EXAMPLE = re.compile(r"^<!-- (\w+) -->\n```text\n(.*?)\n```$", re.DOTALL | re.MULTILINE)


def examples() -> dict[str, str]:
    """Return the messages by the name of the mistake; ``_O0`` if both builds differ."""
    return dict(EXAMPLE.findall(MESSAGES.read_text(encoding="utf-8")))


def _rewrite_messages(names: Sequence[str]) -> None:
    """Write the messages again, also in the guide. They must be read before they are kept."""
    messages, guide = (path.read_text(encoding="utf-8") for path in (MESSAGES, GUIDE))
    known = examples()
    into = Path(mkdtemp())
    every = programs("mistakes.toml")
    for program in [every[name] for name in names or every]:
        words = {
            one: "\n".join(explanations(program, build(program, one, into)))
            for one in OPTIMISATIONS
            if one != program.silent
        }
        blocks = {program.name: words["O2"]}
        if len({without_numbers(one) for one in words.values()}) > 1:
            blocks[f"{program.name}_O0"] = words["O0"]
        for name, block in blocks.items():
            assert block, f"{name} is not explained in scenario {program.scenario}"
            begin = f"<!-- {name} -->\n```text\n"
            if name not in known and name != program.name:
                before = f"<!-- {program.name} -->\n```text\n{blocks[program.name]}\n```\n"
                added = f"{before}\nWithout optimisation:\n\n{begin}{block}\n```\n"
                messages = messages.replace(before, added)
                continue
            assert name in known, f"{MESSAGES.name} has no block {name}"
            messages = messages.replace(f"{begin}{known[name]}\n```", f"{begin}{block}\n```")
            guide = guide.replace(f"\n{known[name]}\n```", f"\n{block}\n```")
            guide = guide.replace(f"| `{_first(known[name])}` |", f"| `{_first(block)}` |")
    MESSAGES.write_text(messages, encoding="utf-8")
    GUIDE.write_text(guide, encoding="utf-8")


def _first(message: str) -> str:
    return message.partition("\n")[0]


if __name__ == "__main__":
    _rewrite_messages(sys.argv[1:])
