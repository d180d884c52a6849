"""A board that runs is spoken to from elsewhere: what is asked of its door, and what it answers.

The messages are those of a session (:mod:`fcu_emulator.emulator.live.messages`): ``do`` with a timeline entry, which
happens at once, between two slices of the run. ``truth`` asks how the board lies; each of both is answered
with how it lies then. ``text`` asks for what has been printed since a position, and is answered with the text
(Latin-1) and the position after it. What is wrong is answered with ``error``.

Decision: a board that ``fcu run`` lets play a scenario is not moved by hand. What the scenario expects is
judged, and a hand in between would make a right program wrong; for both at a time there is ``fcu web``, which
judges nothing that was disturbed.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from typing import Any

from fcu_emulator.emulator.assembly.board import Board
from fcu_emulator.emulator.errors import InputError

_MOST_TEXT = 8192  # bytes of one answer


class Moved:
    """Answers messages for ``board``; to be asked between slices only."""

    def __init__(self, board: Board) -> None:
        self._board = board

    def answer(self, message: Mapping[str, Any]) -> dict[str, Any]:
        """Do what a message says. Raises InputError for what cannot be done."""
        return answered(self._board, message, self._do)

    def _do(self, table: Mapping[str, Any]) -> None:
        from fcu_emulator.emulator.scenario.toml_writer import parse_entry

        board = self._board
        if board.scenario is not None:
            name = board.scenario.name
            raise InputError(
                f"the board plays the scenario {name}, which moves it; run it without --scenario",
                kind="moved_by_scenario",
            )
        entry = parse_entry(table, board.description)
        entry.plan(board.world, board.now_s)
        entry.act(board, board.clock.now_ps)


def answered(
    board: Board, message: Mapping[str, Any], do: Callable[[Mapping[str, Any]], None]
) -> dict[str, Any]:
    """The answer to a message, of which ``do`` carries out an entry. Raises InputError."""
    from fcu_emulator.emulator.live import (  # with all that a session needs: not before somebody asks
        messages,
        view,
    )

    kind = message.get("type")
    if kind == "text":
        return _text(board, message.get("position"))
    if kind != "truth":
        command = messages.decode(json.dumps(message))
        if not isinstance(command, messages.Do):
            raise InputError(f"a running board takes the messages do, truth and text, no {kind!r}")
        do(command.entry)
    return {"t_s": board.now_s, "truth": view.truth(board)}


def _text(board: Board, position: object) -> dict[str, Any]:
    """What was printed from ``position`` on, for long enough to remain a message; without one, nothing."""
    if not isinstance(position, int) or isinstance(position, bool) or position < 0:
        return {"text": "", "position": board.terminal.position}
    data, end = board.terminal.since(position)
    begin = end - len(data)
    return {"text": data[:_MOST_TEXT].decode("latin-1"), "position": begin + len(data[:_MOST_TEXT])}
