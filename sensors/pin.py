"""An interrupt or data-ready pin.

A sensor computes lazily. So it may report an edge late, but it reports the true time of the edge. If a listener needs
edges in time, it calls the sensor's ``catch_up`` at ``next_event_ps``.
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
"""``changes(at_ps, level)``, called before ``applied`` gets the new level."""


class Pin:
    """Logic level of a pin: 0, 1, or None while it is not driven. ``applied`` is the level of an input, set by the
    board.
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
        """Return whether the pin has a listener, so that the sensor must compute edges in advance."""
        return bool(self._listeners)

    def listen(self, edge: EdgeAtSeconds) -> None:
        """Call ``edge(at_s, level)`` at every later change; the callback must not access the sensor."""
        self.observe(lambda at_ps, level: edge(at_ps / PS_PER_S, level))

    def observe(self, edge: EdgeCallback) -> None:
        """Call ``edge(at_ps, level)`` at every later change."""
        if self.on_wire is not None:
            on_wire, self.on_wire = self.on_wire, None
            on_wire()
        self._listeners.append(edge)

    def drive(self, level: int | None, at_ps: int) -> None:
        if level == self.level:
            return
        self.level = level
        if level is not None:
            for edge in self._listeners:
                edge(at_ps, level)

    def apply(self, level: int, at_ps: int) -> None:
        """Apply ``level`` to the pin after ``at_ps``. Raises ValueError if ``level`` is not 0 or 1."""
        if level not in {0, 1}:
            raise ValueError(f"pin {self.name}: level {level} is not 0 or 1")
        if level != self.applied:
            if self.on_input is not None:
                self.on_input(at_ps, level)
            self.applied = level
