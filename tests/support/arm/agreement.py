"""Common parts of the agreement tests: runs, replays, and the variables of the Python firmware over time."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from fcu_emulator import Board
from fcu_emulator.emulator.analysis.observation import TERMINAL, Observation, ObservedItem, observe
from fcu_emulator.emulator.analysis.replay import replay
from fcu_emulator.emulator.assembly.firmware import python_firmware
from fcu_emulator.emulator.clock import PS_PER_MS, PS_PER_S
from fcu_emulator.emulator.scenario.run_view import FORMATS, deviation

TICK_PS = 1_250_000_000  # 800 Hz, the lab's rate

VARIABLES = {
    **{f"ACC.{axis}": ("acc", f"AXIS_{axis.upper()}") for axis in "xyz"},
    **{f"GYR.{axis}": ("gyro", f"AXIS_{axis.upper()}") for axis in "xyz"},
    **{f"MAG.{axis}": ("mag", f"AXIS_{axis.upper()}") for axis in "xyz"},
    "Pre": ("press", ""),
    "Pitch": ("pitch", ""),
    "Roll": ("roll", ""),
    "Yaw": ("azimuth", ""),
}


def ran(
    firmware: str, scenario: str | Path, end_s: float, *, ideal: bool = False, wiring: str | None = None
) -> tuple[Board, Observation]:
    """Run a firmware on a scenario until ``end_s``; return the board and its observation."""
    board = Board(firmware, wiring=wiring, scenario=scenario, ideal=ideal)
    return board, observe(board, round(end_s * PS_PER_S), transfers=True)


def replayed(board: Board, program: str) -> Observation:
    """Replay the Python firmware of that name on the samples that the board's firmware has read."""
    return replay(board, python_firmware(program))


def text_of(observation: Observation) -> str:
    """Return the text of the terminal."""
    return "".join(line.text for line in observation.sequences[TERMINAL])


class Track:
    """The Python firmware's variables after each tick of a scenario, until ``end_s``."""

    def __init__(self, scenario: str | Path, end_s: float) -> None:
        board = Board(firmware="lab3", scenario=scenario)
        self._times_ps = np.arange(PS_PER_S, round(end_s * PS_PER_S), TICK_PS)
        self._values: dict[str, list[float]] = {name: [] for name in VARIABLES}
        for at_ps in self._times_ps:
            board.run_until_ps(int(at_ps))
            for name, (variable, part) in VARIABLES.items():
                value = board.variable(variable)
                self._values[name].append(getattr(value, part) if part else value)

    def deviations(self, field: str, printed: float, at_ps: int, within_ms: int) -> NDArray[np.float64]:
        """Return ``printed`` minus each value of the variable within this many milliseconds of ``at_ps``."""
        around = at_ps + np.array([-within_ms, within_ms]) * PS_PER_MS
        first, last = np.searchsorted(self._times_ps, around)
        return np.array([deviation(field, printed, value) for value in self._values[field][first:last]])


def numbers_of(lines: Sequence[ObservedItem]) -> Iterator[tuple[int, str, float]]:
    """Yield time, field and value of every number in the lab's lines."""
    for line in lines:
        for line_format in FORMATS:
            for field, value in (line_format.parse(line.text.strip()) or {}).items():
                yield line.at_ps, field, value
