"""A board that ``fcu run`` runs is moved from elsewhere: what is asked of its door, and what it answers.

The messages are those of a session (:mod:`emulator.live.messages`): ``do`` with a timeline entry, which
happens at once, between two slices of the run. ``truth`` asks how the board lies. Each is answered with how
it lies then, or with ``error``.

Decision: a board that plays a scenario is not moved by hand. What the scenario expects is judged, and a hand
in between would make a right program wrong; for both at a time there is ``fcu web``, which judges nothing
that was disturbed.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

from emulator.board.board import Board
from emulator.errors import InputError


class Moved:
    """Answers messages for ``board``; to be asked between slices only."""

    def __init__(self, board: Board) -> None:
        self._board = board

    def answer(self, message: Mapping[str, Any]) -> dict[str, Any]:
        """Do what a message says. Raises InputError for what cannot be done."""
        from emulator.live import messages, view  # with all that a session needs: not before somebody asks

        if message.get("type") != "truth":
            command = messages.decode(json.dumps(message))
            if not isinstance(command, messages.Do):
                raise InputError(f"fcu run takes the messages do and truth, no {message.get('type')!r}")
            self._do(command.entry)
        return {"t_s": self._board.now_s, "truth": view.truth(self._board)}

    def _do(self, table: Mapping[str, Any]) -> None:
        from emulator.scenario.written import parse_entry

        board = self._board
        if board.scenario is not None:
            name = board.scenario.name
            raise InputError(
                f"the board plays the scenario {name}, which moves it; run it without --scenario"
            )
        entry = parse_entry(table, board.description)
        entry.plan(board.world, board.now_s)
        entry.act(board, board.clock.now_ps)
