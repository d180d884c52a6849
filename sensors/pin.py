"""An interrupt or data-ready pin: its level over virtual time, for the wired listeners.

A sensor is evaluated lazily, so it may detect an early event late; it reports each edge with the time of the
event. A listener that needs edges in time calls the sensor's ``catch_up`` at ``next_event_ps``; only then
does a pin cost anything.
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
"""``changes(at_ps, level)``: ``applied`` still has the old level."""


class Pin:
    """A pin's logic level: 0, 1, or None while it is not driven (open drain, high impedance).

    ``applied``: the level that the board applies to an input pin, 0 at first.
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
        """Return whether the pin has a listener; a sensor need not work ahead for an unconnected pin."""
        return bool(self._listeners)

    def listen(self, edge: EdgeAtSeconds) -> None:
        """Call ``edge(at_s, level)`` at every change to 0 or 1 from now on, in seconds of virtual time.

        The callback must not access the sensor itself.
        """
        self.observe(lambda at_ps, level: edge(at_ps / PS_PER_S, level))

    def observe(self, edge: EdgeCallback) -> None:
        """Call ``edge(at_ps, level)`` at every change, exact to the picosecond; for code that wires a sensor."""
        if self.on_wire is not None:
            on_wire, self.on_wire = self.on_wire, None
            on_wire()
        self._listeners.append(edge)

    def drive(self, level: int | None, at_ps: int) -> None:
        """Set the level as of ``at_ps``; without effect if the level is the same."""
        if level == self.level:
            return
        self.level = level
        if level is not None:
            for edge in self._listeners:
                edge(at_ps, level)

    def apply(self, level: int, at_ps: int) -> None:
        """Apply ``level`` (0 or 1) to the pin from outside, from ``at_ps`` on. Raises ValueError for another
        level.

        A sample taken at exactly ``at_ps`` still has the old level.
        """
        if level not in {0, 1}:
            raise ValueError(f"pin {self.name}: level {level} is not 0 or 1")
        if level != self.applied:
            if self.on_input is not None:
                self.on_input(at_ps, level)
            self.applied = level
