"""Motion along a line: the pieces of the altitude's track, and shaking.

Each piece gives position and acceleration from one formula, the second being the exact second derivative of
the first inside the piece. Where a motion is cut short by another one the board simply stops: the blow that
this would take in reality is left out.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from emulator.world.track import Array, MinimumJerk


class Line(Protocol):
    """A piece of altitude; a result's length is N, or 1 for one that does not move."""

    def position_m(self, t_s: Array, /) -> Array:
        """Metres above the room's floor, (N,)."""
        ...

    def acceleration_m_s2(self, t_s: Array, /) -> Array:
        """Upward acceleration, (N,)."""
        ...


class Rest:
    """At rest at ``position_m``."""

    def __init__(self, position_m: float) -> None:
        self._position = np.array([position_m])
        self._acceleration = np.zeros(1)

    def position_m(self, _t_s: Array, /) -> Array:
        """The position, (1,)."""
        return self._position

    def acceleration_m_s2(self, _t_s: Array, /) -> Array:
        """None, (1,)."""
        return self._acceleration


@dataclass(frozen=True)
class Lift:
    """A hand's move from ``from_m`` by ``metres``."""

    from_m: float
    metres: float
    profile: MinimumJerk

    def position_m(self, t_s: Array, /) -> Array:
        """Metres above the room's floor, (N,)."""
        return self.from_m + self.metres * self.profile.progress(t_s)

    def acceleration_m_s2(self, t_s: Array, /) -> Array:
        """Upward acceleration, (N,)."""
        return self.metres * self.profile.acceleration(t_s)


@dataclass(frozen=True)
class Parabola:
    """Constant upward ``acceleration`` (m/s2) from ``from_m`` with ``speed`` (m/s) at ``start_s``."""

    start_s: float
    from_m: float
    speed: float
    acceleration: float

    def position_m(self, t_s: Array, /) -> Array:
        """Metres above the room's floor, (N,)."""
        elapsed = t_s - self.start_s
        return self.from_m + (self.speed + 0.5 * self.acceleration * elapsed) * elapsed

    def acceleration_m_s2(self, _t_s: Array, /) -> Array:
        """Upward acceleration, (1,)."""
        return np.array([self.acceleration])


@dataclass(frozen=True, eq=False)
class Recorded:
    """Rows of a recording, linear between them: steps of speed at the rows, no acceleration in between."""

    row_s: Array  # (M,), strictly increasing
    row_m: Array  # (M,)
    start_s: float  # when its time 0 is

    def position_m(self, t_s: Array, /) -> Array:
        """Metres above the room's floor, (N,)."""
        return np.interp(t_s - self.start_s, self.row_s, self.row_m)

    def acceleration_m_s2(self, _t_s: Array, /) -> Array:
        """None, (1,)."""
        return np.zeros(1)


@dataclass(frozen=True, eq=False)
class Shake:
    """Acceleration amplitude cos(w t) from ``start_s`` along ``direction`` (3,), from rest to rest.

    The displacement amplitude / w^2 (1 - cos w t) begins and, after whole periods, ends at zero with zero
    speed.
    """

    start_s: float
    direction: Array
    amplitude_m_s2: float
    angular_rad_s: float

    def displacement_m(self, t_s: Array) -> Array:
        """World frame, (N, 3)."""
        reach = self.amplitude_m_s2 / self.angular_rad_s**2
        return (reach * (1.0 - np.cos(self._phase(t_s))))[:, np.newaxis] * self.direction

    def acceleration_m_s2(self, t_s: Array) -> Array:
        """World frame, (N, 3)."""
        return (self.amplitude_m_s2 * np.cos(self._phase(t_s)))[:, np.newaxis] * self.direction

    def _phase(self, t_s: Array) -> Array:
        return self.angular_rad_s * (t_s - self.start_s)
