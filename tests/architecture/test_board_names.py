"""Only a board's file, the lab's own tools and lists of the chip's peripherals name a bus, a LED or a timer."""

from __future__ import annotations

import ast
import dataclasses
import re
from collections.abc import Iterator
from pathlib import Path

import pytest
from click.testing import CliRunner

from fcu_emulator.emulator.boards.fcu001v1 import FCU001V1
from fcu_emulator.emulator.cli.commands import cli
from fcu_emulator.firmware_model import Settings

ROOT = Path(__file__).parents[2]
EMULATOR = ROOT / "emulator"
NAMES = {*FCU001V1.buses(), FCU001V1.serial.peripheral, FCU001V1.timer.peripheral, *FCU001V1.leds}
NAMED = re.compile(rf"(?<![A-Za-z0-9])({'|'.join(map(re.escape, sorted(NAMES)))})(?![0-9])", re.IGNORECASE)
SETTINGS = {field.name for field in dataclasses.fields(Settings)}
"""Settings of the lab's firmware, which scenarios pass on."""
MAY = (
    "boards/",
    "chip/memory_map.py",  # every block of the chip, by name
    "chip/registers/",
    "chip/peripherals/",
    "chip/diagnosis/hang.py",  # the vector table
    "cli/commands.py",  # the help text, which is compared with the board below
    "cli/options.py",  # likewise
    "analysis/",  # of the lab's firmware: its LEDs follow pitch and roll
    "testing/",
)
FILES = sorted(
    path for path in EMULATOR.rglob("*.py") if not path.relative_to(EMULATOR).as_posix().startswith(MAY)
)


def code(path: Path) -> Iterator[str]:
    """Return the names and texts of a file without its docstrings, which may give examples."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    documented = (ast.Module, ast.ClassDef, ast.FunctionDef, ast.AsyncFunctionDef)
    texts = {
        id(first.value)
        for node in ast.walk(tree)
        if isinstance(node, documented) and node.body and isinstance(first := node.body[0], ast.Expr)
    }
    for node in ast.walk(tree):
        if isinstance(node, ast.Constant) and isinstance(node.value, str) and id(node) not in texts:
            yield node.value
        elif isinstance(node, ast.Name):
            yield node.id
        elif isinstance(node, ast.Attribute):
            yield node.attr


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.relative_to(EMULATOR).as_posix())
def test_shared_code_contains_no_board_names(path: Path) -> None:
    assert sorted({name for text in {*code(path)} - SETTINGS for name in NAMED.findall(text)}) == []


@pytest.mark.parametrize("command", ["run", "diff"])
def test_help_lists_wirings_of_board(command: str) -> None:
    text = CliRunner().invoke(cli, [command, "--help"]).output
    assert " or ".join(wiring.name for wiring in FCU001V1.wirings) in " ".join(text.split())


def test_new_command_help_lists_buses_of_wirings() -> None:
    text = CliRunner().invoke(cli, ["new", "--help"]).output
    assert f"[{'|'.join(wiring.bus for wiring in FCU001V1.wirings)}]" in text
