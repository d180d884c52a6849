"""Statistics of a timer's interrupt."""

from __future__ import annotations

from typing import Protocol


class TickCounts(Protocol):
    """Statistics of a timer's interrupt."""

    @property
    def name(self) -> str: ...

    @property
    def ticks(self) -> int:
        """Updates while the interrupt was enabled."""
        ...

    @property
    def late(self) -> int:
        """Ticks whose handler did not start at once."""
        ...

    @property
    def lost(self) -> int:
        """Ticks that came while the previous one waited."""
        ...

    @property
    def longest_wait_s(self) -> float: ...

    @property
    def rate_hz(self) -> float: ...
