"""Answers to other programs that use a running board's control server.

Decision: while a board plays a scenario in ``fcu run``, it cannot be moved by hand, because
otherwise a correct program could fail.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from typing import Any

from fcu_emulator.emulator.assembly.board import Board
from fcu_emulator.emulator.errors import InputError

_MOST_TEXT = 8192  # bytes of one answer


class ControlRequests:
    """Handler of messages to ``board``. Call it only between slices of the run."""

    def __init__(self, board: Board) -> None:
        self._board = board

    def answer(self, message: Mapping[str, Any]) -> dict[str, Any]:
        """Execute a message and return the answer. Raises InputError."""
        return answer_message(self._board, message, self._do)

    def _do(self, table: Mapping[str, Any]) -> None:
        from fcu_emulator.emulator.scenario.toml_writer import parse_entry

        board = self._board
        if board.scenario is not None:
            name = board.scenario.name
            raise InputError(
                f"cannot move the board: it plays the scenario {name}; run it without --scenario",
                kind="moved_by_scenario",
            )
        parse_entry(table, board.description).perform(board, board.clock.now_ps)


def answer_message(
    board: Board, message: Mapping[str, Any], do: Callable[[Mapping[str, Any]], None]
) -> dict[str, Any]:
    """Answer a message. ``do`` performs a timeline entry. Raises InputError."""
    from fcu_emulator.emulator.live import (  # slow to import, so only on the first message
        messages,
        view,
    )

    kind = message.get("type")
    if kind == "text":
        return _text(board, message.get("position"))
    if kind != "truth":
        command = messages.decode(json.dumps(message))
        if not isinstance(command, messages.Do):
            raise InputError(f"the type of a message must be 'do', 'truth' or 'text', not {kind!r}")
        do(command.entry)
    return {"t_s": board.now_s, "truth": view.truth(board)}


def _text(board: Board, position: object) -> dict[str, Any]:
    if not isinstance(position, int) or isinstance(position, bool) or position < 0:
        return {"text": "", "position": board.terminal.position}
    data, end = board.terminal.since(position)
    begin = end - len(data)
    return {"text": data[:_MOST_TEXT].decode("latin-1"), "position": begin + len(data[:_MOST_TEXT])}
