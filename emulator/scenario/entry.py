"""What every entry of a timeline has: when it is, how long it takes, what it moves, what it does.

Schema and behaviour of a kind of entry stand in one class, so that a new kind is one class and its name in
the union in :mod:`emulator.scenario.timeline`.
"""

from __future__ import annotations

from typing import ClassVar

from emulator.scenario.board_view import BoardView
from emulator.scenario.tables import Table
from emulator.scenario.units import Duration
from emulator.world import World


class Entry(Table):
    """One ``[[timeline]]`` table."""

    LIVE: ClassVar[bool] = False
    """Whether it can only be done when its time has come (a jump of the world)."""

    at: Duration | None = None
    """Virtual time since power-on; without it, the end of the entry before it in the file."""

    @property
    def length_ps(self) -> int:
        """How long it takes; 0 for what happens at once."""
        return 0

    @property
    def moves(self) -> frozenset[str]:
        """The quantities it moves, of which each can follow one motion at a time."""
        return frozenset()

    def plan(self, world: World, start_s: float) -> None:
        """Change the world from ``start_s`` on. Raises InputError."""

    def act(self, board: BoardView, from_ps: int) -> None:
        """Do what concerns the rest of the board; the time is ``from_ps``."""
