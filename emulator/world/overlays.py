"""What comes on top of a quantity for a while: shaking on a rest position, disturbances on the Earth's field.

Such events add up (accelerations and fields are vectors), so two of them may overlap, unlike the pieces of a
track.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Generic, TypeVar

import numpy as np

from emulator.world.track import Array

P = TypeVar("P")


class Overlays(Generic[P]):
    """Events with a start and an end whose vectors (N, 3) are summed."""

    def __init__(self) -> None:
        self._events: list[tuple[float, float, P]] = []

    def add(self, start_s: float, end_s: float, event: P) -> None:
        """Let ``event`` count for ``start_s`` <= t < ``end_s``."""
        self._events.append((start_s, end_s, event))

    def forget(self, before_s: float) -> None:
        """Drop the events that ended before ``before_s``."""
        if self._events:
            self._events = [event for event in self._events if event[1] >= before_s]

    def total(self, t_s: Array, function: Callable[[P, Array], Array]) -> Array:
        """Sum of ``function(event, t_s)`` at ``t_s`` (N,): (N, 3), or a row of zeros when nothing happens."""
        total = np.zeros((1, 3))
        for start_s, end_s, event in self._events:
            here = (t_s >= start_s) & (t_s < end_s)
            if here.any():
                total = np.array(np.broadcast_to(total, (t_s.size, 3)))
                total[here] += function(event, t_s[here])
        return total
