"""Commands in the shell blocks of the documentation are executed among a student's files.

Commands that install a program, build the package or run the tests are not executed, but the files that they name
must exist.
"""

from __future__ import annotations

import importlib.util
import os
import re
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from fcu_emulator.firmware_model.arm import prebuilt
from tests.integration.test_docs import LAB, ROOT, blocks, fcu

KNOWN = {".", "pip", "pytest", "git", "pre-commit", "sphinx", "ruff", "mypy", "towncrier"}
"""Programs that are not run, because they change the environment, take long, or are run by other tests."""
CUT_SHORT = (0, 1, 4)
"""Exit codes of a scenario that was ended early, so that later expectations were not checked."""
CAN_COMPILE = shutil.which("arm-none-eabi-gcc") is not None and shutil.which("make") is not None
RUBRIC = next(block.values[0] for block in blocks("toml") if "[[exercise]]" in block.values[0])
WORKFLOW = re.compile(r"^ +- run: ((?:fcu|make).*)$", re.MULTILINE)


def commands(block: str) -> list[tuple[str, bool]]:
    """Return each command of a block, and whether its comment says that it must fail."""
    found = []
    for line in block.strip().splitlines():
        command, _, comment = line.partition("  #")
        found += [(part.strip(), "must fail" in comment) for part in command.split("&&")]
    return [(command, fails) for command, fails in found if command and not command.startswith("#")]


def desk(folder: Path) -> Path:
    """Return a folder with the files that a student or a teacher has before typing."""
    shutil.copyfile(prebuilt("solution", "I2C2"), folder / "lab3.elf")
    shutil.copyfile(ROOT / "scenarios" / "led_x.toml", folder / "my_scenario.toml")
    (folder / "mine.toml").write_text(RUBRIC, encoding="utf-8")
    (folder / "tilt.toml").write_text(LAB, encoding="utf-8")
    return folder


def with_an_end(command: str) -> str:
    """Return the command with an end for runs that would continue until Ctrl-C or wait for a debugger."""
    if command.startswith(("fcu run", "fcu diff")):
        command += " --duration 1500ms"
    if command.startswith("fcu web"):
        command += " --no-browser --duration 100ms"
    command = command.replace("--gdb 3333", "--gdb 0").replace("--halt", "").partition(" > ")[0]
    return command + " --speed max" if command.startswith("fcu run") else command


def execute(command: str, fails: bool, folder: Path) -> Path:
    """Run a command, and return the folder for the next one."""
    program, *arguments = shlex.split(command)
    program = program.removeprefix(".venv/bin/")
    if command.startswith(("fcu terminal", "fcu move")):
        return folder  # need a board that runs: test_cli_terminal.py, test_cli_move.py
    if program == "cd":
        return folder / arguments[0]
    if program == "fcu":
        command = command.removeprefix(".venv/bin/")
        done = fcu(command if fails else with_an_end(command), folder, check=False)
        cut_short = " diff " in command or "--scenario" in command or command == "fcu check"
        assert done.returncode in ((1,) if fails else CUT_SHORT if cut_short else (0,)), done.stderr
        assert "Traceback" not in done.stderr
    elif program == "make" and CAN_COMPILE and (folder / "Makefile").exists():
        subprocess.run(["make", "-s"], cwd=folder, check=True, capture_output=True)
    elif program == "make":
        shutil.copyfile(prebuilt("template", "I2C2"), folder / "lab3.elf")
    elif program in ("python", "python3"):
        is_there(arguments)
    else:
        assert program in KNOWN, command
    return folder


def is_there(arguments: list[str]) -> None:
    """Return whether a script of this repository, or a module, exists."""
    if arguments[0] == "-m":
        assert arguments[1] in KNOWN or importlib.util.find_spec(arguments[1]), arguments
    else:
        assert (ROOT / arguments[0]).exists(), arguments


@pytest.mark.parametrize("block", blocks("sh"))
def test_documented_commands_run_as_typed(
    block: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    if "--serial pty" in block and sys.platform == "win32":
        pytest.skip("Windows has no pseudo-terminals")
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join(filter(None, [str(ROOT), os.environ.get("PYTHONPATH")])))
    folder = desk(tmp_path)
    for command, fails in commands(block):
        folder = execute(command, fails, folder)


@pytest.mark.parametrize("block", blocks("yaml"))
def test_documented_workflow_steps_run(block: str, tmp_path: Path) -> None:
    steps = WORKFLOW.findall(block)
    assert steps
    for command in steps:
        execute(command, fails=False, folder=desk(tmp_path))
