"""Explanations of wrong formulas: the step, the formula that the program computes, and the line.

Correct programs get no explanation, in whatever way they are written.
"""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
import tomllib
from pathlib import Path
from typing import Any

import pytest

from fcu_emulator.emulator.chip.firmware import Limits
from fcu_emulator.emulator.chip.image import load_firmware
from fcu_emulator.emulator.explain.explanation import Explanation, ShownNumber, explain_numbers
from fcu_emulator.emulator.explain.expression import text
from fcu_emulator.emulator.explain.probe import probe
from fcu_emulator.emulator.grading.rubric import load_rubric
from fcu_emulator.emulator.scenario.formats import NamedFormat
from tests.support.arm import student_programs
from tests.support.arm.student_programs import FOLDER, Change, Program, build

with (FOLDER / "formulas.toml").open("rb") as table:
    FORMULAS: dict[str, dict[str, Any]] = tomllib.load(table)
VARIANTS = student_programs.programs("variants.toml")
ALL = bool(os.environ.get("FCU_ALL_STUDENTS"))
SHOWN = {
    "acc_x": "ACC.x",
    "acc_y": "ACC.y",
    "acc_z": "ACC.z",
    "Bx": "MAG.x",
    "By": "MAG.y",
    "Bz": "MAG.z",
    "press": "Pre",
    "altitude": "Altitude",
    "pitch_deg": "Pitch",
    "roll_deg": "Roll",
    "yaw_deg": "Yaw",
}
"""The printed numbers of the lab, by step."""
WITHIN = 2

needs_compiler = pytest.mark.skipif(
    not student_programs.is_buildable(), reason="arm-none-eabi-gcc or make is not installed"
)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("formulas")


def explained(elf: str | Path) -> list[Explanation]:
    rubric = load_rubric("lab3")
    assert rubric.explain is not None
    outputs = [ShownNumber("check", step, step, NamedFormat(name)) for step, name in SHOWN.items()]
    with probe(elf, Limits()) as running:
        assert running is not None
        return explain_numbers(running, rubric.explain.arithmetic(), outputs)


@needs_compiler
@pytest.mark.parametrize("optimisation", ["O0", "O2"])
@pytest.mark.parametrize("name", list(FORMULAS) if ALL else list(FORMULAS)[::2])
def test_wrong_formula_is_named_at_its_line(name: str, optimisation: str, folder: Path) -> None:
    one = FORMULAS[name]
    source = (FOLDER / "student" / "main.c").read_text()
    line = one.get("line", source[: source.index(one["old"])].count("\n") + 1)
    change = Change("main.c", one["old"], one["new"], times=source.count(one["old"]))
    found = explained(build(Program(name, "", (change,)), optimisation, folder))
    mistakes = {explanation.mistake.step: explanation for explanation in found}

    assert one["step"] in mistakes, list(mistakes)
    explanation = mistakes[one["step"]]
    assert text(explanation.mistake.computed) == one["computed"]
    place = re.search(r"main\.c:(\d+)", explanation.diagnosis.summary)
    assert place is not None
    assert abs(int(place[1]) - line) <= WITHIN


@needs_compiler
@pytest.mark.parametrize("optimisation", ["O0", "O2"])
def test_wrong_input_of_several_angles_is_one_mistake(optimisation: str, folder: Path) -> None:
    change = Change("main.c", "float gx = acc.AXIS_X", "float gx = 2 * acc.AXIS_X")
    found = explained(build(Program("wrong_value", "", (change,)), optimisation, folder))

    assert [(one.mistake.step, text(one.mistake.computed)) for one in found] == [("acc_x", "acc_x*2")]


@pytest.mark.parametrize("firmware", ["solution"])
def test_shipped_solution_is_not_explained(firmware: str) -> None:
    assert explained(firmware) == []


@needs_compiler
@pytest.mark.parametrize("name", list(VARIANTS) if ALL else list(VARIANTS)[::5])
def test_correct_variant_is_not_explained(name: str, folder: Path) -> None:
    assert explained(build(VARIANTS[name], "O2", folder)) == []


def without_lines(elf: Path, kind: str) -> Path:
    """Return a copy of a program without symbols and source lines."""
    image = elf.with_suffix(f".stripped.{kind}")
    command = {
        "elf": ["arm-none-eabi-strip", "-o", str(image), str(elf)],
        "hex": ["arm-none-eabi-objcopy", "-O", "ihex", str(elf), str(image)],
        "bin": ["arm-none-eabi-objcopy", "-O", "binary", str(elf), str(image)],
    }
    subprocess.run(command[kind], check=True)
    return image


def objdump_of(elf: Path, address: str) -> str:
    """Return the instruction at an address, as GNU objdump prints it."""
    command = ["arm-none-eabi-objdump", "-d", f"--start-address={address}", str(elf)]
    listing = subprocess.run(command, check=True, capture_output=True, text=True).stdout
    line = next(one for one in listing.splitlines() if one.startswith(f" {int(address, 16):x}:"))
    return line.split("\t", 2)[2]


@needs_compiler
@pytest.mark.parametrize("kind", ["elf", "hex", "bin"])
@pytest.mark.parametrize("optimisation", ["Og", "O2"])
def test_program_without_lines_is_explained_at_instruction(
    optimisation: str, kind: str, folder: Path
) -> None:
    change = Change("main.c", "bx * cosf(pitch)", "bx * cosf(roll)")
    elf = build(Program("stripped", "", (change,)), optimisation, folder)
    (with_lines,) = explained(elf)
    (found,) = explained(without_lines(elf, kind))
    address = found.diagnosis.data["address"]
    image = load_firmware(str(elf))
    assert image.symbols is not None
    line = image.symbols.line_at(int(address, 16))

    assert text(found.mistake.computed) == "Bx*cos(roll) + Bz2*sin(pitch)"
    assert line is not None
    assert line.data() == {key: with_lines.diagnosis.data[key] for key in ("file", "line")}
    assert found.diagnosis.summary.startswith(address)
    assert found.diagnosis.details[0].split() == objdump_of(elf, address).split()


# -- fcu run ------------------------------------------------------------------------------------------------


def run(firmware: str | Path, scenario: str, folder: Path) -> dict[str, Any]:
    """Return the record of ``fcu run`` with a scenario."""
    record = folder / "run.json"
    command = ["run", str(firmware), "--scenario", scenario, "--speed", "max", "--json", str(record)]
    subprocess.run([sys.executable, "-m", "fcu_emulator", *command], capture_output=True, check=False)
    contents: dict[str, Any] = json.loads(record.read_text(encoding="utf-8"))
    return contents


@needs_compiler
def test_run_command_shows_line_of_wrong_formula_first(folder: Path) -> None:
    one = FORMULAS["pitch_sign"]
    source = (FOLDER / "student" / "main.c").read_text()
    line = source[: source.index(one["old"])].count("\n") + 1
    program = Program("pitch_sign", "", (Change("main.c", one["old"], one["new"], times=1),))

    record = run(build(program, "O2", folder), "tilt_sweep", folder)

    first = record["diagnoses"][0]
    named = re.search(r"main\.c:(\d+)", first["summary"])
    assert record["verdict"] == "failed"
    assert first["kind"] == "formula"
    assert first["data"]["step"] == one["step"]
    assert first["data"]["computed"] == one["computed"]
    assert abs(int(first["data"]["line"]) - line) <= WITHIN
    assert named is not None
    assert abs(int(named[1]) - line) <= WITHIN


def test_run_command_explains_nothing_for_correct_program(folder: Path) -> None:
    record = run("solution", "tilt_sweep", folder)

    assert record["verdict"] == "passed"
    assert record["diagnoses"] == []
