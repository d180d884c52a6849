"""A live session as a scenario: all actions since power-on, timed in picoseconds."""

from __future__ import annotations

from pathlib import Path

from fcu_emulator.emulator.assembly.board import Board
from fcu_emulator.emulator.clock import PS_PER_MS, format_duration
from fcu_emulator.emulator.errors import InputError, OutputError
from fcu_emulator.emulator.host.files import write_atomically
from fcu_emulator.emulator.scenario.schema import MOST_ENTRIES
from fcu_emulator.emulator.scenario.timeline import TimelineAction
from fcu_emulator.emulator.scenario.toml_writer import key_text, names_files, table_text, timeline

_TABLES = ("firmware_settings", "bus", "world", "sensors")


class SessionRecording:
    """Recording of a board's actions.

    ``source``: origin, for a comment. ``cold``: the sensors' supply was switched on at 0 s.
    """

    def __init__(
        self, board: Board, ideal: bool = False, *, source: str = "A live session", cold: bool = False
    ) -> None:
        self._board = board
        self._ideal = ideal
        self._source = source
        self._cold = cold
        self._entries: list[tuple[int, TimelineAction]] = []
        self.world: dict[str, object] = {}
        """Keys of the scenario's [world] that were set at power-on."""

    @property
    def room(self) -> int:
        plan = self._board.scenario
        return MOST_ENTRIES - len(self._entries) - (len(plan.contents.timeline) if plan else 0)

    def add(self, at_ps: int, entry: TimelineAction) -> bool:
        if self.room <= 0:
            return False
        self._entries.append((at_ps, entry))
        return True

    def text(self) -> str:
        """Return the scenario. Raises InputError if the session's scenario plays recordings."""
        board, plan = self._board, self._board.scenario
        entries = [(step.at_ps, step.entry) for step in plan.steps] if plan else []
        if names_files(entry for _, entry in entries):
            raise InputError(f"{plan and plan.file}: cannot record a scenario that plays recordings")
        duration_ps = -(-max(board.clock.now_ps, PS_PER_MS) // PS_PER_MS) * PS_PER_MS
        happened = [(at_ps, entry) for at_ps, entry in (*entries, *self._entries) if at_ps <= duration_ps]
        name, wiring = board.booted.name or "FIRMWARE", board.booted.wiring.name
        shipped = name in board.description.firmware
        powered_ps = 0 if self._cold else plan.contents.uptime if plan else None
        lines = [
            f"# {self._source} of {board.description.name}. It gives the same bytes again with\n",
            f"# fcu run {name} --wiring {wiring} --scenario THIS_FILE\n\n",
            key_text("schema", 1),
            key_text("question", f"What does the board measure? ({self._source})"),
            key_text("duration", format_duration(duration_ps)),
            key_text("seed", board.seed),
            key_text("firmware", name) if shipped else "",
            key_text("uptime", format_duration(powered_ps)) if powered_ps is not None else "",
            timeline(happened),
        ]
        tables = plan.contents.model_dump(mode="python", by_alias=True, exclude_unset=True) if plan else {}
        if self.world:
            tables["world"] = {**tables.get("world", {}), **self.world}
        if self._ideal:
            tables["sensors"] = {**tables.get("sensors", {}), "quality": "ideal"}
        if plan is not None:
            serial = plan.contents.model_dump(mode="json", by_alias=True, exclude_unset=True)
            tables = {**tables, "bus": serial.get("bus")}
        lines += [table_text(key, _given(tables[key])) for key in _TABLES if tables.get(key)]
        lines.append(table_text("limits", {"duration": "24h", "wall": "24h"}))
        return "".join(lines)

    def save(self, path: Path) -> None:
        try:
            write_atomically(path, self.text())
        except OutputError as error:
            raise OutputError(f"--record {error}") from error


def _given(table: dict[str, object]) -> dict[str, object]:
    return {
        key: _given(value) if isinstance(value, dict) else value
        for key, value in table.items()
        if value is not None
    }
