"""An interrupt or data-ready pin: its level over virtual time, for whoever is wired to it.

A part works lazily, so it may find out late what happened early; it reports each edge with the time at which
it happened. Whoever needs edges when they happen calls the part's ``catch_up`` at ``next_event_ps``, and only
then does a pin cost anything.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeAlias

from fcu_emulator.sensors.sampling import PS_PER_S

EdgeCallback: TypeAlias = Callable[[int, int], None]
"""``edge(at_ps, level)``."""

EdgeAtSeconds: TypeAlias = Callable[[float, int], None]
"""``edge(at_s, level)``."""

InputCallback: TypeAlias = Callable[[int, int], None]
"""``changes(at_ps, level)``: ``applied`` is still the level before."""


class Pin:
    """A pin's logic level: 0, 1, or None while it is not driven (open drain, high impedance).

    ``applied``: what the board puts on a pin that is an input, 0 at first.
    """

    def __init__(self, name: str, level: int | None = 0) -> None:
        self.name = name
        self.level = level
        self.applied = 0
        self.on_wire: Callable[[], None] | None = None  # called once, before the first listener is added
        self.on_input: InputCallback | None = None
        self._listeners: list[EdgeCallback] = []

    @property
    def wired(self) -> bool:
        """Whether anybody listens; a part need not work ahead for a pin that hangs in the air."""
        return bool(self._listeners)

    def listen(self, edge: EdgeAtSeconds) -> None:
        """Call ``edge(at_s, level)`` at every change to 0 or 1 from now on, in seconds of virtual time.

        It must not access the part itself.
        """
        self.observe(lambda at_ps, level: edge(at_ps / PS_PER_S, level))

    def observe(self, edge: EdgeCallback) -> None:
        """Likewise ``edge(at_ps, level)``, to the picosecond; for what wires a part."""
        if self.on_wire is not None:
            on_wire, self.on_wire = self.on_wire, None
            on_wire()
        self._listeners.append(edge)

    def drive(self, level: int | None, at_ps: int) -> None:
        """Set the level as of ``at_ps``; nothing happens when it is that already."""
        if level == self.level:
            return
        self.level = level
        if level is not None:
            for edge in self._listeners:
                edge(at_ps, level)

    def apply(self, level: int, at_ps: int) -> None:
        """The board drives the pin to ``level`` (0 or 1) from ``at_ps`` on; ValueError for another level.

        A sample taken at exactly ``at_ps`` still sees the level before.
        """
        if level not in {0, 1}:
            raise ValueError(f"pin {self.name}: level {level} is not 0 or 1")
        if level != self.applied:
            if self.on_input is not None:
                self.on_input(at_ps, level)
            self.applied = level
