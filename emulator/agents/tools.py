"""The tools by name: arguments, effect, longest wall time, and implementation. This file does not use the protocol."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Final

from pydantic import ValidationError

from fcu_emulator.emulator.agents import arguments, programs
from fcu_emulator.emulator.agents.commands import TimeLimit
from fcu_emulator.emulator.agents.explain import explain_number, explain_problems
from fcu_emulator.emulator.agents.guides import guide_text, is_guide
from fcu_emulator.emulator.agents.live_board import LiveBoard
from fcu_emulator.emulator.agents.texts import TextStore, lines_of, page_of
from fcu_emulator.emulator.errors import InputError
from fcu_emulator.emulator.live.setup import Setup
from fcu_emulator.emulator.scenario.loader import scenario_error
from fcu_emulator.emulator.text import shown

LARGEST_RESULT: Final = 48_000
"""Maximum size of a result in bytes of JSON. A larger result becomes a text, which is read in pages."""
_COMMAND_S, _BOARD_S = 300.0, 60.0
"""Longest wall time of a command and of a call of the live board."""


@dataclass(frozen=True)
class Tool:
    """A tool. ``on_board``: it uses the live board. ``changes``: it changes files or the live board."""

    name: str
    arguments: type[arguments.Arguments]
    on_board: bool
    wall_s: float
    changes: bool = False

    @property
    def about(self) -> str:
        """The description for agents."""
        return " ".join((self.arguments.__doc__ or "").split())

    def schema(self) -> dict[str, Any]:
        """Return the JSON schema of the arguments."""
        schema = self.arguments.model_json_schema()
        return {key: value for key, value in schema.items() if key not in ("title", "description")}


TOOLS: Final = {
    one.name: one
    for one in (
        Tool("build", arguments.Build, False, _COMMAND_S, changes=True),
        Tool("check", arguments.Check, False, _COMMAND_S, changes=True),
        Tool("run", arguments.Run, False, _BOARD_S),
        Tool("read_text", arguments.ReadText, False, _BOARD_S),
        Tool("start_board", arguments.StartBoard, True, _BOARD_S, changes=True),
        Tool("act", arguments.Act, True, _BOARD_S, changes=True),
        Tool("run_board", arguments.RunBoard, True, _BOARD_S, changes=True),
        Tool("expect", arguments.Expect, True, _BOARD_S, changes=True),
        Tool("terminal", arguments.Terminal, True, _BOARD_S),
        Tool("registers", arguments.Registers, True, _BOARD_S),
        Tool("variables", arguments.Variables, True, _BOARD_S),
        Tool("transfers", arguments.Transfers, True, _BOARD_S, changes=True),
        Tool("explain", arguments.Explain, True, _BOARD_S),
    )
}


def parse(name: str, given: Mapping[str, Any]) -> arguments.Arguments:
    """Return the checked arguments of a tool. Raises InputError with one line."""
    tool = TOOLS.get(name)
    if tool is None:
        raise InputError(f"unknown tool {shown(name)}; known: {', '.join(TOOLS)}", kind="unknown_tool")
    known = {field.alias or own for own, field in tool.arguments.model_fields.items()}
    if unknown := [one for one in given if one not in known]:
        raise InputError(f"{name} has no argument {shown(unknown[0])}; known: {', '.join(sorted(known))}")
    try:
        return tool.arguments.model_validate(given)
    except ValidationError as error:
        raise InputError(str(scenario_error(name, error))) from error


def as_json(result: Mapping[str, Any], indent: int | None = None) -> str:
    """Return a result as JSON, without escapes for characters outside ASCII."""
    return json.dumps(result, ensure_ascii=False, indent=indent)


class Workbench:
    """One live board, and the latest texts. Tools with ``on_board`` must be called by one thread."""

    def __init__(self) -> None:
        self._texts = TextStore()
        self._board: LiveBoard | None = None
        self._calls: dict[str, Callable[[Any, TimeLimit], dict[str, Any]]] = {
            "build": lambda wanted, limit: programs.build(self._texts, wanted, limit),
            "check": lambda wanted, limit: programs.check(self._texts, wanted, limit),
            "run": lambda wanted, limit: programs.run(self._texts, wanted, limit),
            "read_text": lambda wanted, _: self._read_text(wanted),
            "start_board": lambda wanted, _: self._start(wanted),
            "act": lambda wanted, _: self._started.act(wanted.entry),
            "run_board": lambda wanted, limit: self._started.run(wanted.seconds, limit),
            "expect": lambda wanted, limit: self._started.expect(
                wanted.text, wanted.timeout_s, wanted.since, limit
            ),
            "terminal": lambda wanted, _: self._started.terminal(wanted.since),
            "registers": lambda wanted, _: self._started.registers(
                wanted.part, wanted.register_name, wanted.first
            ),
            "variables": lambda wanted, _: self._started.variables(wanted.names, wanted.first),
            "transfers": lambda wanted, limit: self._started.transfers(wanted.run_s, limit),
            "explain": self._explain,
        }

    def call(self, name: str, wanted: arguments.Arguments, limit: TimeLimit) -> dict[str, Any]:
        """Call a tool with checked arguments, and return a result of bounded size. Raises FcuError."""
        result = self._calls[name](wanted, limit)
        if len(as_json(result).encode()) <= LARGEST_RESULT:
            return result
        return {"result": self._texts.shown(name, as_json(result, indent=1))}

    def close(self) -> None:
        """Switch the live board off."""
        if self._board is not None:
            self._board.close()
            self._board = None

    @property
    def _started(self) -> LiveBoard:
        if self._board is None:
            raise InputError("no board is switched on; call start_board first", kind="no_board")
        return self._board

    def _start(self, wanted: arguments.StartBoard) -> dict[str, Any]:
        board = LiveBoard(Setup(wanted.firmware, wanted.scenario, wanted.wiring, wanted.seed, wanted.ideal))
        self.close()
        self._board = board
        return board.state()

    def _read_text(self, wanted: arguments.ReadText) -> dict[str, Any]:
        if is_guide(wanted.name):
            return page_of(wanted.name, lines_of(guide_text(wanted.name)), wanted.first_line)
        return self._texts.read(wanted.name, wanted.first_line)

    def _explain(self, wanted: arguments.Explain, limit: TimeLimit) -> dict[str, Any]:
        if wanted.number is None:
            return explain_problems(self._board)
        return explain_number(wanted.number, wanted.firmware, self._board, limit)
