"""Scenario files for tests, written to a temporary folder."""

from __future__ import annotations

from pathlib import Path

import pytest

from fcu_emulator import Board, ScenarioError
from fcu_emulator.emulator.scenario import Result, load_scenario, run

HEAD = 'schema = 1\nquestion = "Does it work?"\n'
SHORT = HEAD + 'duration = "2.5s"\n'  # boot takes 1 s: two blocks are printed
IDEAL = SHORT + '[sensors]\nquality = "ideal"\n'


def write(folder: Path, text: str | bytes) -> Path:
    path = folder / "case.toml"
    path.write_bytes(text.encode() if isinstance(text, str) else text)
    return path


def play(folder: Path, text: str) -> Result:
    return run(Board(scenario=write(folder, text)))


def refusal(folder: Path, text: str | bytes) -> ScenarioError:
    """Return the error with which a file is refused. Every error is a single line that names the file."""
    path = write(folder, text)
    with pytest.raises(ScenarioError) as caught:
        load_scenario(path)
    message = str(caught.value)
    assert message.startswith(f"{path}: ")
    assert "\n" not in message
    assert len(message) < 700
    return caught.value
