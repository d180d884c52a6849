"""Buttons at pins of the chip: pressed by Python and by a scenario, and recorded as a scenario."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from fcu_emulator.emulator.assembly.board import Board
from fcu_emulator.emulator.buses.gpio import Gpio
from fcu_emulator.emulator.clock import PS_PER_S, Clock
from fcu_emulator.emulator.errors import InputError, ScenarioError
from fcu_emulator.emulator.scenario import load_scenario
from fcu_emulator.emulator.testing.board_recording import BoardRecording
from fcu_emulator.emulator.trace import Trace

MS = PS_PER_S // 1000


def board_with_button(**settings: Any) -> tuple[Board, list[tuple[int, int]]]:
    """Return a board with a pull-up at PA0, and the list of (time in ms, level) of the pin."""
    board = Board("lab3", ideal=True, **settings)
    seen: list[tuple[int, int]] = []
    board.gpio.set_pull("A", 0, 1)
    board.gpio.listen("A", 0, lambda level: seen.append((board.clock.now_ps // MS, level)))
    return board, seen


def test_press_connects_pin_for_its_time() -> None:
    board, seen = board_with_button()
    board.run_for(0.01)
    board.press_button("PA0", seconds=0.05)
    board.run_for(0.1)
    assert seen == [(10, 0), (60, 1)]


def test_button_to_supply_overcomes_pull_down() -> None:
    board, seen = board_with_button()
    board.gpio.set_pull("A", 0, 0)
    board.press_button("PA0", level=1)
    board.run_for(0.2)
    assert [level for _, level in seen] == [0, 1, 0]


@given(presses=st.lists(st.tuples(st.integers(0, 50), st.integers(1, 50)), min_size=1, max_size=6))
def test_pin_is_low_while_any_press_lasts(presses: list[tuple[int, int]]) -> None:
    clock = Clock()
    gpio = Gpio(clock, Trace())
    gpio.set_pull("A", 0, 1)
    for begin, length in presses:
        clock.schedule(begin * MS, partial(gpio.press, "A", 0, 0, (begin + length) * MS))
    for ms in range(0, 101, 5):
        clock.advance_to(ms * MS + 1)
        pressed = any(begin <= ms < begin + length for begin, length in presses)
        assert gpio.level("A", 0) == (0 if pressed else 1)


@pytest.mark.parametrize(
    "wrong", [{"pin": "PF1"}, {"pin": "A0"}, {"level": 2}, {"seconds": 0.0}, {"seconds": -1.0}]
)
def test_invalid_press_is_refused(wrong: dict[str, Any]) -> None:
    with pytest.raises(InputError):
        Board("lab3").press_button(**{"pin": "PA0", **wrong})


def scenario(folder: Path, entry: str) -> Path:
    file = folder / "press.toml"
    file.write_text(
        f"schema = 1\nquestion = 'Is the button read?'\nduration = '1s'\n[[timeline]]\ndo = 'press_button'\n{entry}\n",
        encoding="utf-8",
    )
    return file


def test_scenario_presses_button(tmp_path: Path) -> None:
    board, seen = board_with_button(scenario=scenario(tmp_path, "pin = 'PA0'\nat = '20ms'\nfor = '30ms'"))
    board.run_for(0.1)
    assert seen == [(20, 0), (50, 1)]


@pytest.mark.parametrize(
    ("entry", "key"), [("pin = 'PF1'", "pin"), ("pin = 'PA0'\nlevel = 2", "level"), ("", "pin")]
)
def test_scenario_with_invalid_button_is_refused(tmp_path: Path, entry: str, key: str) -> None:
    with pytest.raises(ScenarioError) as refused:
        load_scenario(scenario(tmp_path, entry))
    assert refused.value.key == f"timeline[0].{key}"


def test_press_is_recorded_as_scenario(tmp_path: Path) -> None:
    board, seen = board_with_button()
    recording = BoardRecording(board)
    board.run_for(0.01)
    board.press_button("PA0", seconds=0.05)
    board.run_for(0.1)
    file = tmp_path / "recorded.toml"
    file.write_text(recording.text(), encoding="utf-8")
    again, seen_again = board_with_button(scenario=file)
    again.run_for(0.11)
    assert recording.missing == []
    assert seen_again == seen
