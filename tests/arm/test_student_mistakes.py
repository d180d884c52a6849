"""Each mistake of a student is explained as in mistakes/messages.md, and correct programs get no explanation.

With FCU_ALL_STUDENTS=1 each program is built with and without optimisation, and the correct programs run through all
scenarios, which takes a quarter of an hour. Otherwise each program is built one way, and half of the scenarios are
run.
"""

from __future__ import annotations

import os
import re
from collections.abc import Iterable, Sequence
from dataclasses import replace
from pathlib import Path

import pytest

from fcu_emulator import Board
from fcu_emulator.emulator.analysis.mistakes import explain
from fcu_emulator.emulator.analysis.recorder import TruthRecorder
from fcu_emulator.emulator.grading.rubric import load_rubric
from tests.integration.test_cli import fcu
from tests.support.arm import student_programs
from tests.support.arm.graded_programs import staged
from tests.support.arm.student_programs import OPTIMISATIONS, Program, build, explanations, without_numbers
from tests.support.arm.vendor_programs import file

MISTAKES = student_programs.programs("mistakes.toml")
VARIANTS = student_programs.programs("variants.toml")
SCENARIOS = sorted(path.stem for path in (Path(__file__).parents[2] / "scenarios").glob("*.toml"))
SLOW = {"slow_bus"}  # where the callback is too slow on purpose, and said to be
QUIET_SCENARIOS = [name for name in SCENARIOS if name not in SLOW]
ALL = bool(os.environ.get("FCU_ALL_STUDENTS"))
LONGEST_S = 14.0 if ALL else 5.0
VENDOR = ["lab3_i2c_polled", "lab3_i2c_it", "lab3_i2c_dma", "threads", "flight"]

needs_compiler = pytest.mark.skipif(
    not student_programs.is_buildable(), reason="arm-none-eabi-gcc or make is not installed"
)


def scenarios_for(names: Sequence[str]) -> list[tuple[str, str]]:
    """Return pairs of program and scenario: all pairs, or one scenario for each program."""
    if ALL:
        return [(name, scenario) for name in names for scenario in QUIET_SCENARIOS]
    return [(name, QUIET_SCENARIOS[n % len(QUIET_SCENARIOS)]) for n, name in enumerate(names)]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("programs")


def expected(program: Program, optimisation: str) -> str:
    if program.silent == optimisation:
        return ""
    examples = student_programs.examples()
    return examples.get(f"{program.name}_{optimisation}") or examples[program.name]


def both_ways(names: Iterable[str]) -> list[tuple[str, str]]:
    """Return pairs of program and optimisation: all pairs, or one optimisation for each program."""
    pairs = [(name, one) for name in names for one in OPTIMISATIONS]
    return pairs if ALL else pairs[0::4] + pairs[3::4]


@needs_compiler
@pytest.mark.parametrize(("name", "optimisation"), both_ways(MISTAKES))
def test_mistake_is_explained_as_in_messages(name: str, optimisation: str, folder: Path) -> None:
    program = MISTAKES[name]
    words = "\n".join(explanations(program, build(program, optimisation, folder)))

    assert without_numbers(words) == without_numbers(expected(program, optimisation))


@needs_compiler
@pytest.mark.parametrize(("name", "scenario"), scenarios_for(list(VARIANTS)))
@pytest.mark.parametrize("optimisation", OPTIMISATIONS if ALL else OPTIMISATIONS[1:])
def test_correct_variant_gets_no_explanation(
    name: str, optimisation: str, scenario: str, folder: Path
) -> None:
    program = VARIANTS[name]

    assert explanations(program, build(program, optimisation, folder), LONGEST_S, scenario) == []


@pytest.mark.parametrize(
    ("name", "scenario"), scenarios_for(["solution", "template-arm", "lab3", "template", *VENDOR])
)
def test_shipped_and_vendor_programs_get_no_explanation(name: str, scenario: str) -> None:
    firmware = file(name) if name in VENDOR else name
    board = Board(firmware, wiring="fcu001v1" if name == "flight" else None, scenario=scenario)
    recorder = TruthRecorder(board)
    board.run_for(LONGEST_S)

    assert [str(one) for one in explain(board, recorder)] == []


@needs_compiler
@pytest.mark.parametrize("done", [3, 4, 5] if ALL else [3])
@pytest.mark.parametrize("run", ["heading", "sensors", "stairs", "steep_x", "steep_y", "tilt"])
def test_completed_exercises_have_no_wrong_numbers(run: str, done: int, folder: Path) -> None:
    """The motions are the rubric's motions, so that the lines of a block are printed at different attitudes."""
    scenario = load_rubric("lab3").scenario(run, 0)
    board = Board(str(staged(done, folder)), scenario=scenario, seed=0)
    recorder = TruthRecorder(board)
    board.run_for(scenario.duration_s)

    assert [str(one) for one in explain(board, recorder) if one.kind == "numbers"] == []


def test_message_page_shows_all_mistakes() -> None:
    shown = {name.removesuffix("_O0") for name in student_programs.examples()}

    assert shown == set(MISTAKES)
    assert all(student_programs.examples().values())
    assert len(shown) >= 30
    assert len(VARIANTS) >= 12


def test_guide_lists_message_of_each_mistake() -> None:
    guide = student_programs.GUIDE.read_text(encoding="utf-8")
    first_lines = [
        text.split("\n")[0] for name, text in student_programs.examples().items() if not name.endswith("_O0")
    ]

    assert [line for line in first_lines if f"| `{line}` |" not in guide] == []


def test_whole_messages_in_guide_are_current() -> None:
    guide = student_programs.GUIDE.read_text(encoding="utf-8")
    shown = re.findall(
        r"^The whole message for [^\n]*:\n\n```text\n(.*?)\n```$", guide, re.DOTALL | re.MULTILINE
    )

    assert len(shown) >= 5
    assert set(shown) <= set(student_programs.examples().values())


@needs_compiler
def test_replay_accepts_solution_in_double_precision(folder: Path) -> None:
    """The program computes each angle at each sample and only in double; the lab's firmware stores floats."""
    every_sample = [change for change in VARIANTS["double"].change if "eCompass" not in change.old]
    program = replace(VARIANTS["double"], change=tuple(every_sample))
    options = ("--scenario", "flat", "--replay", "--duration", "6s")
    done = fcu("diff", "lab3", str(build(program, "O2", folder)), *options)

    assert b"terminal: the same" in done.stdout
