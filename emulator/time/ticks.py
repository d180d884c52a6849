"""How a timer's interrupt did: what firmware in Python and the chip both count."""

from __future__ import annotations

from typing import Protocol


class TickCounts(Protocol):
    """How a timer's interrupt did."""

    @property
    def name(self) -> str:
        """As the reference manual calls the timer."""
        ...

    @property
    def ticks(self) -> int:
        """Updates while the interrupt was enabled."""
        ...

    @property
    def late(self) -> int:
        """Ticks whose handler did not come at once."""
        ...

    @property
    def lost(self) -> int:
        """Ticks that came while the one before waited for its handler."""
        ...

    @property
    def longest_wait_s(self) -> float:
        """The most that a handler was late."""
        ...

    @property
    def rate_hz(self) -> float: ...
