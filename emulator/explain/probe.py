"""Run firmware in several poses of an ideal board, and log the values that it computes.

A magnet is fixed to the board, and the board is motionless in each pose. Formulas count as equal if their values
are equal in all poses. The only purpose of the first poses is to set the largest and smallest value of each axis.
"""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Collection, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Final, NamedTuple

import numpy as np
import numpy.typing as npt

from fcu_emulator.emulator.assembly.board import Board
from fcu_emulator.emulator.assembly.snapshot import Snapshot
from fcu_emulator.emulator.chip.cpu.core import Core
from fcu_emulator.emulator.chip.cpu.value_log import ValueLog, Values
from fcu_emulator.emulator.chip.firmware import ArmFirmware, Limits
from fcu_emulator.emulator.chip.image import FirmwareImage
from fcu_emulator.emulator.chip.memory_map import FLASH_MEMORY, RAM_MEMORY
from fcu_emulator.emulator.errors import FirmwareError
from fcu_emulator.emulator.trace import BusTransfer, TraceEvent


class ProbePose(NamedTuple):
    """An attitude, and an altitude above the floor."""

    roll_deg: float
    pitch_deg: float
    yaw_deg: float
    altitude_m: float


PAST: Final = (
    ProbePose(20, -20, 20, 0),
    ProbePose(-10, -40, 60, 0),
    ProbePose(40, 10, -160, 0),
    ProbePose(40, -50, -20, 0),
)
"""Poses before ``POSES``. Their field is less extreme on each axis, so that ``POSES`` give new extremes."""
POSES: Final = (ProbePose(-25, -55, 75, 140), ProbePose(62, 15, -30, 220), ProbePose(-15, 33, 120, 300))
"""Logged poses. The board is tilted about both axes, so that every exchange of axes changes a value.
"""
_HARD_IRON_MGAUSS: Final = (720.0, -680.0, 650.0)
"""Hard iron stronger than the earth's field, so that an extreme with the initial value 0 is wrong."""
_TEMPERATURE_DEGC: Final = 23.5
_START_UP_S: Final = 0.002
"""Time after which the start-up code has initialized the variables."""
_START_S: Final = 2.3
"""Longest time until the firmware reads all inputs again and again."""
_SETTLE_S: Final = 0.2
"""Time to settle, enough for two samples of a sensor at 10 Hz."""
_USED_S: Final = 0.1
"""Time in which the firmware uses its variables: one sample of a sensor at 10 Hz."""
_WORD, _PC = 4, 15
_READ_S: Final = 0.1
"""Time for reads, longer than the time between two reads of the slowest sensor."""
_LOGGED_S: Final = 1.3
"""Longest logged time in a pose, longer than the lab's period of printing."""
_PIECE_S: Final = 0.1
_LIBRARY: Final = re.compile(
    r"newlib|libgcc|picolibc|(?:^|[/\\])(?:stm32\w*|startup\w*|system_\w*)\.\w+$", re.IGNORECASE
)
"""Sources whose values are not logged: the C library and the vendor's drivers."""


@dataclass(frozen=True)
class InputRegister:
    """The first register of a signed little-endian number in a sensor."""

    sensor: str
    register: int
    bytes: int = 2


@dataclass(frozen=True)
class Probed:
    """The sensors' numbers in all poses, and the computed values and printed lines in logged poses."""

    inputs: Mapping[str, npt.NDArray[np.float64]]
    logs: Sequence[Values]
    lines: Sequence[Sequence[str]]
    memory: Sequence[bytes]
    """RAM at the start and after each pose."""


class WordUse(NamedTuple):
    """Instructions that store a word of the RAM, and instructions that load it."""

    stores: Counter[int]
    loads: Counter[int]


class Probe:
    """A board with a firmware file, for runs in all poses."""

    def __init__(self, firmware: ArmFirmware, board: Board) -> None:
        self.image = firmware.image
        self._board = board
        self._core = firmware.chip.core
        self._started: Snapshot | None = None

    def run(self, inputs: Mapping[str, InputRegister]) -> Probed | None:
        """Run the firmware in all poses. Return None after a failure. Call this method one time."""
        try:
            return self._run(inputs)
        except FirmwareError:
            return None

    def _run(self, inputs: Mapping[str, InputRegister]) -> Probed:
        board = self._board
        read: dict[str, list[float]] = {name: [] for name in inputs}
        logs, lines = list[Values](), list[list[str]]()
        memory = [self._start()]
        seen = self._run_until_read(inputs.values())
        self._started = board.snapshot()
        log = ValueLog(self._core, own_code(self.image))
        for pose in (*PAST, *POSES):
            _put(board, pose)
            board.run_for(_SETTLE_S)
            _watched_run(board, seen, _READ_S)
            memory.append(_ram(self._core))
            for name, register in inputs.items():
                read[name].append(_number(seen, register))
            if pose in POSES:
                printed = board.terminal.position
                with log:
                    _run_until_printed(board)
                logs.append(log.take())
                lines.append(_complete_lines(board, printed))
        return Probed({name: np.array(every) for name, every in read.items()}, logs, lines, memory)

    def _run_until_read(self, inputs: Collection[InputRegister]) -> _Bytes:
        """Run the board until the firmware has read all inputs and repeats its reads, or until the longest
        time is over."""
        seen: _Bytes = {}
        before: _Bytes = {}
        for _ in range(round(_START_S / _PIECE_S)):
            piece: _Bytes = {}
            _watched_run(self._board, piece, _PIECE_S)
            seen.update(piece)
            repeats = piece.keys() == before.keys()
            if piece and repeats and not any(math.isnan(_number(seen, one)) for one in inputs):
                break
            before = piece
        return seen

    def _start(self) -> bytes:
        """Prepare the world, run the start-up code, and return the contents of the RAM."""
        self._board.world.set_hard_iron(*_HARD_IRON_MGAUSS)
        self._board.world.set_temperature(_TEMPERATURE_DEGC)
        _put(self._board, PAST[0])
        self._board.run_for(_START_UP_S)
        return _ram(self._core)

    def uses_of(self, words: Collection[int]) -> Mapping[int, WordUse]:
        """Return the instructions that use these words of the RAM in all poses. Call ``run`` first."""
        uses = {address: WordUse(Counter(), Counter()) for address in words}
        if self._started is None or not uses:
            return uses

        def note(address: int, size: int, is_store: bool) -> None:
            for word, use in uses.items():
                if address < word + _WORD and word < address + size:
                    (use.stores if is_store else use.loads)[self._core.register(_PC)] += 1

        self._board.restore(self._started)
        self._core.on_access = note
        self._core.watch_memory(min(words) - _WORD, max(words) + _WORD)
        with suppress(FirmwareError):
            for pose in (*PAST, *POSES):
                _put(self._board, pose)
                self._board.run_for(_USED_S)
        self._core.unwatch_memory()
        return uses


@contextmanager
def probe(firmware: str | Path, limits: Limits) -> Iterator[Probe | None]:
    """Boot a firmware file on an ideal board. The value is None for firmware in Python."""
    board = Board(firmware, ideal=True)
    try:
        if board.chip is None:
            yield None
        else:
            board.chip.limits = limits
            yield Probe(board.chip, board)
    finally:
        board.close()


def _ram(core: Core) -> bytes:
    return bytes(core.memory(RAM_MEMORY.start, RAM_MEMORY.end - RAM_MEMORY.start) or b"")


_Bytes = dict[tuple[str, int], int]
"""The latest byte read from each register of each sensor."""


def _watched_run(board: Board, seen: _Bytes, seconds: float) -> None:
    """Run the board, and collect the bytes that the firmware reads from the sensors."""

    def collect(event: TraceEvent) -> None:
        if isinstance(event, BusTransfer) and event.written:
            first = event.written[0] & 0x7F
            seen.update({(event.device, first + n): value for n, value in enumerate(event.read)})

    stop = board.trace.subscribe(collect)
    try:
        board.run_for(seconds)
    finally:
        stop()


def _run_until_printed(board: Board) -> None:
    """Wait for a pause in the output, then run until the next output has ended, or until the longest time is over."""
    has_been_silent = has_printed = False
    for _ in range(round(_LOGGED_S / _PIECE_S)):
        before = board.terminal.position
        board.run_for(_PIECE_S)
        is_silent = board.terminal.position == before
        if is_silent and has_printed:
            return
        has_been_silent |= is_silent
        has_printed = has_been_silent and not is_silent


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


def own_code(image: FirmwareImage) -> list[tuple[int, int]]:
    """Return the address ranges of the code outside of the C library and the vendor's drivers.

    Return the whole contents of the flash if the file has no symbols.
    """
    if image.symbols is None:
        return [(one.address, one.end) for one in image.segments if FLASH_MEMORY.holds(one.address, one.end)]
    ranges = image.symbols.code_ranges(lambda path: not _LIBRARY.search(path))
    return [one for one in ranges if FLASH_MEMORY.holds(*one)]
