"""Statistics of a timer's interrupt, counted by firmware in Python and by the chip."""

from __future__ import annotations

from typing import Protocol


class TickCounts(Protocol):
    """Statistics of a timer's interrupt."""

    @property
    def name(self) -> str:
        """Name of the timer in the reference manual."""
        ...

    @property
    def ticks(self) -> int:
        """Number of updates while the interrupt was enabled."""
        ...

    @property
    def late(self) -> int:
        """Number of ticks whose handler did not start at once."""
        ...

    @property
    def lost(self) -> int:
        """Number of ticks that came while the previous one waited for its handler."""
        ...

    @property
    def longest_wait_s(self) -> float:
        """Longest delay of a handler in seconds."""
        ...

    @property
    def rate_hz(self) -> float: ...
