"""A board whose chip runs a program, with skipped or executed waiting."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from fcu_emulator import Board
from fcu_emulator.emulator.chip.cpu.core import CoreSettings
from fcu_emulator.emulator.chip.firmware import ArmFirmware
from fcu_emulator.emulator.chip.image import load_firmware
from fcu_emulator.emulator.trace import BusTransfer


@dataclass(frozen=True)
class Result:
    """All results of a run; ``transfers``: (start, end, address, bytes written, bytes read)."""

    terminal: bytes
    transfers: list[tuple[int, int, int, bytes, bytes]]
    edges: list[str]
    retired: int
    now_ps: int
    registers: bytes
    ram: bytes


class Chip:
    """The chip of a board before the first instruction of the firmware in ``file``."""

    def __init__(self, file: Path, wiring: str = "lab3", *, skip: bool = True) -> None:
        self.board = board = Board(wiring=wiring)
        board.trace.record_all()
        self.firmware = ArmFirmware(board.signals, load_firmware(file), CoreSettings(skip=skip))
        self.core = self.firmware.chip.core

    def run_until_ps(self, at_ps: int) -> None:
        """Run up to and including ``at_ps``."""
        self.firmware.run_until_ps(at_ps)

    def result(self) -> Result:
        """Return the results of the run so far."""
        events = list(self.board.trace)
        transfers = [event for event in events if isinstance(event, BusTransfer)]
        return Result(
            self.board.terminal.since(0)[0],
            [(event.t_ps, event.end_ps, event.address, event.written, event.read) for event in transfers],
            [str(event) for event in events if not isinstance(event, BusTransfer)],
            self.core.retired,
            self.board.clock.now_ps,
            self.core.core_state(),
            bytes(self.core.ram),
        )
