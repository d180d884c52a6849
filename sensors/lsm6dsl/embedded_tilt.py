"""Tilt: the part has been turned by more than 35 degrees (AN5040 6.3).

The first time the new position must last for 2 s; after that every further turn by more than 35 degrees from
where the last event found the part is an event at once. The start position is the first sample after
switching on. In free fall there is no direction, and no tilt.
"""

from __future__ import annotations

import math

from sensors.errors import ZERO, Vec3
from sensors.sampling import PS_PER_S

_COS_THRESHOLD = math.cos(math.radians(35.0))
_FIRST_TIME_PS = 2 * PS_PER_S


class Tilt:
    """Compares the direction of gravity with the one of the last event."""

    def __init__(self) -> None:
        self.restart()

    def restart(self) -> None:
        """The next sample is the start position."""
        self._reference = ZERO
        self._first_time = True
        self._turned_since_ps: int | None = None

    def feed(self, acceleration: Vec3, at_ps: int) -> bool:
        """A sample, in any unit; whether it makes an event."""
        if self._reference == ZERO:
            self._reference = acceleration
        if not self._turned(acceleration):
            self._turned_since_ps = None
            return False
        if self._first_time:
            if self._turned_since_ps is None:
                self._turned_since_ps = at_ps
            if at_ps - self._turned_since_ps < _FIRST_TIME_PS:
                return False
        self._reference, self._first_time = acceleration, False
        return True

    def _turned(self, acceleration: Vec3) -> bool:
        lengths = math.hypot(*acceleration) * math.hypot(*self._reference)
        dot = sum(one * other for one, other in zip(acceleration, self._reference, strict=True))
        return dot < lengths * _COS_THRESHOLD
