"""Setup of a session: firmware, scenario, power-on, and previous position."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fcu_emulator.emulator.assembly.board import Board
from fcu_emulator.emulator.assembly.firmware import FirmwareFactory
from fcu_emulator.emulator.live import view
from fcu_emulator.emulator.live.files import FileWatch
from fcu_emulator.emulator.scenario import load_scenario

if TYPE_CHECKING:
    from fcu_emulator.emulator.chip.gdb.server import GdbServer


@dataclass(frozen=True)
class Setup:
    """The board's class and its arguments."""

    firmware: str | Path | FirmwareFactory | None = None
    scenario: str | None = None
    wiring: str | None = None
    seed: int | None = None
    ideal: bool = False
    kind: type[Board] = Board
    gdb: int | None = None
    """Port for a debugger; 0: any free port; None: no debugger."""
    halt: bool = False
    """Whether the firmware waits for the debugger at the first power-on."""

    def power_on(self) -> Board:
        """Return a new board without time and output limits. Raises FcuError."""
        plan = None
        if self.scenario is not None:
            plan = load_scenario(self.scenario, self.kind.description)
            plan.ahead = False
        firmware = self._firmware()
        board = self.kind(firmware, scenario=plan, wiring=self.wiring, seed=self.seed, ideal=self.ideal)
        if board.chip is not None:
            board.chip.limits = replace(board.chip.limits, wall_s=1e9, terminal_bytes=1 << 40)
        return board

    def debugger(self, board: Board) -> GdbServer | None:
        """Return a gdb server if debugging is on. Raises FcuError."""
        if self.gdb is None:
            return None
        from fcu_emulator.emulator.chip.gdb.attach import serve

        return serve(board, self.gdb, self.halt)

    def watched(self) -> FileWatch | None:
        firmware = self._firmware()
        return FileWatch(firmware) if isinstance(firmware, str | Path) else None

    def _firmware(self) -> str | Path | FirmwareFactory | None:
        if self.firmware is None and self.scenario is None:
            return self.kind.description.default_firmware or None
        return self.firmware


def pose_entries(board: Board) -> list[dict[str, Any]]:
    """Return entries that move another board to this board's position."""
    now = view.instant(board)
    world = board.world
    roll, pitch, yaw = (round(float(one), 2) + 0.0 for one in world.attitude_deg(now)[0])
    metres = round(float(world.altitude_m(now)[0]), 3) + 0.0
    entries: list[dict[str, Any]] = []
    if (roll, pitch, yaw) != (0, 0, 0):
        entries.append({"do": "set_attitude", "roll_deg": roll, "pitch_deg": pitch, "yaw_deg": yaw})
    if metres:
        entries.append({"do": "follow_altitude", "metres": metres, "time_constant": "1ms"})
    magnet = world.magnet(board.now_s)
    if magnet is not None:
        place = dict(zip(("north_m", "west_m", "up_m"), (round(one, 4) for one in magnet[1:]), strict=True))
        entries.append({"do": "follow_magnet", **place, "moment_am2": magnet[0]})
    return entries
