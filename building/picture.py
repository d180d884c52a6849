"""Draw docs/run.svg, a run of ``fcu``: python building/picture.py

Needs rich (extra ``docs``).
"""

from __future__ import annotations

import io
import subprocess
import sys
from pathlib import Path
from typing import Final

from rich.console import Console
from rich.terminal_theme import DEFAULT_TERMINAL_THEME
from rich.text import Text

ROOT: Final = Path(__file__).parents[1]
PICTURE: Final = ROOT / "docs" / "run.svg"
COMMAND: Final = "run solution --scenario led_x --speed max"
WIDTH: Final = 84


def printed(command: str) -> tuple[list[str], list[str]]:
    """Return the terminal's lines, and those of fcu."""
    done = subprocess.run(
        [sys.executable, "-m", "fcu_emulator", *command.split()],
        cwd=ROOT,
        capture_output=True,
        stdin=subprocess.DEVNULL,
        text=True,
        check=True,
    )
    terminal = [line.strip() for line in done.stdout.splitlines()]
    return [line for line in terminal if line.strip("*")], done.stderr.splitlines()


def shown(terminal: list[str], remarks: list[str]) -> list[tuple[str, str]]:
    """Return selected lines with styles."""
    seconds = [number for number, line in enumerate(terminal) if line.startswith("ACC")]
    second, on_edge, after = seconds[1], seconds[4], seconds[5]
    begun = next(number for number, line in enumerate(remarks) if "serial:" in line) + 1
    return [
        (f"$ fcu {COMMAND}", "bold green"),
        *((line, "blue") for line in remarks[:begun]),
        *((line, "") for line in terminal[:second]),
        ("...", "dim"),
        *((line, "") for line in terminal[on_edge:after]),
        ("...", "dim"),
        *((line, "blue") for line in remarks[begun:]),
    ]


def draw(lines: list[tuple[str, str]]) -> str:
    """Return the lines as SVG."""
    console = Console(record=True, width=WIDTH, file=io.StringIO(), force_terminal=True)
    for line, style in lines:
        console.print(Text(line, style=style), soft_wrap=True)
    drawn: str = console.export_svg(title="fcu", theme=DEFAULT_TERMINAL_THEME, unique_id="run")
    return drawn


if __name__ == "__main__":
    PICTURE.write_text(draw(shown(*printed(COMMAND))), encoding="utf-8")
