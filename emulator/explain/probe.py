"""Run firmware in several poses of an ideal board, and log the values that it computes.

The board, with a magnet on it, stands still in each pose. Formulas with equal values in all poses
are taken as equal. The first poses only set the largest and smallest value of each axis.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final, NamedTuple

import numpy as np
import numpy.typing as npt

from fcu_emulator.emulator.assembly.board import Board
from fcu_emulator.emulator.chip.cpu.value_log import ValueLog, Values
from fcu_emulator.emulator.chip.firmware import Limits
from fcu_emulator.emulator.chip.image import FirmwareImage
from fcu_emulator.emulator.chip.memory_map import FLASH_MEMORY
from fcu_emulator.emulator.errors import FirmwareError
from fcu_emulator.emulator.trace import BusTransfer, TraceEvent


class ProbePose(NamedTuple):
    """An attitude, and an altitude above the floor."""

    roll_deg: float
    pitch_deg: float
    yaw_deg: float
    altitude_m: float


PAST: Final = (ProbePose(35, -20, 50, 0), ProbePose(-50, 25, 160, 0), ProbePose(20, 40, -100, 0))
POSES: Final = (ProbePose(-25, -55, 75, 140), ProbePose(62, 15, -30, 220), ProbePose(-15, 33, 120, 300))
"""The poses whose values are logged. The board is tilted about both axes, so that every exchange of axes
changes a value.
"""
_HARD_IRON_MGAUSS: Final = (310.0, -220.0, 150.0)
_TEMPERATURE_DEGC: Final = 23.5
_START_S: Final = 2.3
"""Time until the first read of the firmware after its start."""
_SETTLE_S: Final = 0.3
_READ_S: Final = 0.1
"""Longer than the period of the slowest sensor's reads."""
_LOGGED_S: Final = 1.3
"""Longer than the lab's period of printing."""
_LIBRARY: Final = re.compile(
    r"newlib|libgcc|picolibc|(?:^|[/\\])(?:stm32\w*|startup\w*|system_\w*)\.\w+$", re.IGNORECASE
)
"""Sources whose values are not logged: the C library and the vendor's drivers."""


@dataclass(frozen=True)
class InputRegister:
    """The first register of a sensor's signed number, little-endian."""

    sensor: str
    register: int
    bytes: int = 2


@dataclass(frozen=True)
class Probed:
    """The sensors' numbers in all poses; computed values and printed lines in logged ones."""

    inputs: Mapping[str, npt.NDArray[np.float64]]
    logs: Sequence[Values]
    lines: Sequence[Sequence[str]]
    image: FirmwareImage


def probe(firmware: str | Path, inputs: Mapping[str, InputRegister], limits: Limits) -> Probed | None:
    """Run a firmware file through the poses; None for Python firmware or a failure."""
    board = Board(firmware, ideal=True)
    if board.chip is None:
        return None
    board.chip.limits = limits
    image = board.chip.image
    try:
        read, logs, lines = _run(board, inputs, image)
    except FirmwareError:
        return None
    finally:
        board.close()
    return Probed({name: np.array(values) for name, values in read.items()}, logs, lines, image)


def _run(
    board: Board, inputs: Mapping[str, InputRegister], image: FirmwareImage
) -> tuple[dict[str, list[float]], list[Values], list[list[str]]]:
    assert board.chip is not None
    board.world.set_hard_iron(*_HARD_IRON_MGAUSS)
    board.world.set_temperature(_TEMPERATURE_DEGC)
    read: dict[str, list[float]] = {name: [] for name in inputs}
    logs, lines = list[Values](), list[list[str]]()
    seen: _Bytes = {}
    _put(board, PAST[0])
    _watched_run(board, seen, _START_S)
    with ValueLog(board.chip.chip.core, _ranges(image)) as log:
        for pose in (*PAST, *POSES):
            _put(board, pose)
            board.run_for(_SETTLE_S)
            _watched_run(board, seen, _READ_S)
            for name, register in inputs.items():
                read[name].append(_number(seen, register))
            if pose in POSES:
                log.take()
                printed = board.terminal.position
                board.run_for(_LOGGED_S)
                logs.append(log.take())
                lines.append(_complete_lines(board, printed))
    return read, logs, lines


_Bytes = dict[tuple[str, int], int]
"""The latest byte read from each register of each sensor."""


def _watched_run(board: Board, seen: _Bytes, seconds: float) -> None:
    """Run, and collect the bytes read from the sensors."""

    def collect(event: TraceEvent) -> None:
        if isinstance(event, BusTransfer) and event.written:
            first = event.written[0] & 0x7F
            seen.update({(event.device, first + n): value for n, value in enumerate(event.read)})

    stop = board.trace.subscribe(collect)
    try:
        board.run_for(seconds)
    finally:
        stop()


def _put(board: Board, pose: ProbePose) -> None:
    board.world.set_attitude(pose.roll_deg, pose.pitch_deg, pose.yaw_deg)
    board.world.set_altitude(pose.altitude_m)


def _number(seen: _Bytes, register: InputRegister) -> float:
    found = [seen.get((register.sensor, register.register + n)) for n in range(register.bytes)]
    if None in found:
        return np.nan
    return float(int.from_bytes(bytes(one or 0 for one in found), "little", signed=True))


def _complete_lines(board: Board, since: int) -> list[str]:
    printed, _ = board.terminal.since(since)
    return [line.strip() for line in printed.decode("latin-1").split("\n")[1:-1]]


def _ranges(image: FirmwareImage) -> list[tuple[int, int]]:
    if image.symbols is None:
        return []
    ranges = image.symbols.code_ranges(lambda path: not _LIBRARY.search(path))
    return [one for one in ranges if FLASH_MEMORY.holds(*one)]
