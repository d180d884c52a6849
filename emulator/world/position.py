"""Motion along each coordinate, and shaking. Within a piece, the acceleration is the exact derivative of the motion."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Protocol

import numpy as np
import numpy.typing as npt

from fcu_emulator.emulator.world.track import Array, MinimumJerk


class Coordinate(Protocol):
    """Interface of a piece of motion north, west or up. Results have length N, or 1 if the piece does not move."""

    @property
    def pace_s(self) -> float:
        """Duration in s of a motion from rest to rest; 0 if the position jumps."""
        ...

    def position_m(self, t_s: Array, /) -> Array: ...

    def speed_m_s(self, t_s: Array, /) -> Array: ...

    def acceleration_m_s2(self, t_s: Array, /) -> Array: ...


class RestSegment:
    """Rest at the coordinate ``position_m``."""

    pace_s = math.inf

    def __init__(self, position_m: float) -> None:
        self._position = np.array([position_m])
        self._none = np.zeros(1)

    def position_m(self, _t_s: Array, /) -> Array:
        return self._position

    def speed_m_s(self, _t_s: Array, /) -> Array:
        return self._none

    def acceleration_m_s2(self, _t_s: Array, /) -> Array:
        return self._none


@dataclass(frozen=True)
class LiftSegment:
    """A motion by a hand from ``from_m`` by ``metres``."""

    from_m: float
    metres: float
    profile: MinimumJerk

    @property
    def pace_s(self) -> float:
        return self.profile.duration_s

    def position_m(self, t_s: Array, /) -> Array:
        return self.from_m + self.metres * self.profile.progress(t_s)

    def speed_m_s(self, t_s: Array, /) -> Array:
        return self.metres * self.profile.speed(t_s)

    def acceleration_m_s2(self, t_s: Array, /) -> Array:
        return self.metres * self.profile.acceleration(t_s)


@dataclass(frozen=True)
class Parabola:
    """Constant upward ``acceleration`` (m/s2) from ``from_m`` with ``speed`` (m/s) at ``start_s``."""

    start_s: float
    from_m: float
    speed: float
    acceleration: float
    pace_s = math.inf  # the acceleration does not change

    def position_m(self, t_s: Array, /) -> Array:
        elapsed = t_s - self.start_s
        return self.from_m + (self.speed + 0.5 * self.acceleration * elapsed) * elapsed

    def speed_m_s(self, t_s: Array, /) -> Array:
        return self.speed + self.acceleration * (t_s - self.start_s)

    def acceleration_m_s2(self, _t_s: Array, /) -> Array:
        return np.array([self.acceleration])


@dataclass(frozen=True, eq=False)
class RecordedCoordinate:
    """The positions (M,) in a recording's rows as one smooth motion. ``row_m_s2``: :func:`accelerations` at the rows."""

    row_s: Array
    row_m: Array
    row_m_s2: Array
    start_s: float
    pace_s = 0.0

    def position_m(self, t_s: Array, /) -> Array:
        if self.row_s.size == 1:
            return self.row_m
        row, step_s, part = self._place(t_s)
        rest = 1.0 - part
        begin, end = self.row_m_s2[row], self.row_m_s2[row + 1]
        curvature = (rest**3 - rest) * begin + (part**3 - part) * end
        line: Array = rest * self.row_m[row] + part * self.row_m[row + 1] + curvature * step_s**2 / 6.0
        return line

    def speed_m_s(self, t_s: Array, /) -> Array:
        if self.row_s.size == 1:
            return np.zeros(1)
        row, step_s, part = self._place(t_s)
        rest = 1.0 - part
        begin, end = self.row_m_s2[row], self.row_m_s2[row + 1]
        curvature = (3.0 * part**2 - 1.0) * end - (3.0 * rest**2 - 1.0) * begin
        speed: Array = (self.row_m[row + 1] - self.row_m[row]) / step_s + curvature * step_s / 6.0
        t_s = t_s - self.start_s
        speed[(t_s < self.row_s[0]) | (t_s >= self.row_s[-1])] = 0.0
        return speed

    def acceleration_m_s2(self, t_s: Array, /) -> Array:
        if self.row_s.size == 1:
            return self.row_m_s2
        row, _, part = self._place(t_s)
        between: Array = (1.0 - part) * self.row_m_s2[row] + part * self.row_m_s2[row + 1]
        t_s = t_s - self.start_s
        between[(t_s < self.row_s[0]) | (t_s >= self.row_s[-1])] = 0.0
        return between

    def _place(self, t_s: Array) -> tuple[npt.NDArray[np.intp], Array, Array]:
        """Return the row before each time, the time step to the next row, and the completed share of this step."""
        t_s = t_s - self.start_s
        row = np.clip(np.searchsorted(self.row_s, t_s, side="right") - 1, 0, self.row_s.size - 2)
        step_s = self.row_s[row + 1] - self.row_s[row]
        return row, step_s, np.clip((t_s - self.row_s[row]) / step_s, 0.0, 1.0)


_SWEEPS = 60


def accelerations(row_s: Array, row_m: Array) -> Array:
    """Return the accelerations (M,) in m/s2 at the rows (M,) of a motion at rest before and after these rows.

    Decision: a recorded position is the cubic spline through the rows, because corners would have infinite
    accelerations. Each sweep of Jacobi's method halves the error.
    """
    if row_s.size == 1:
        return np.zeros(1)
    step_s = np.diff(row_s)
    right_hand_side = 6.0 * np.diff(np.diff(row_m) / step_s, prepend=0.0, append=0.0)
    diagonal = 2.0 * (np.append(step_s, 0.0) + np.append(0.0, step_s))
    found: Array = right_hand_side / diagonal
    for _ in range(_SWEEPS):
        others = np.zeros(row_s.size)
        others[:-1] += step_s * found[1:]
        others[1:] += step_s * found[:-1]
        found = (right_hand_side - others) / diagonal
    return found


@dataclass(frozen=True, eq=False)
class ShakeSegment:
    """Acceleration by amplitude * cos(w t) along ``direction`` (3,) in the world frame, from ``start_s``."""

    start_s: float
    direction: Array
    amplitude_m_s2: float
    angular_rad_s: float

    def displacement_m(self, t_s: Array) -> Array:
        reach = self.amplitude_m_s2 / self.angular_rad_s**2
        return (reach * (1.0 - np.cos(self._phase(t_s))))[:, np.newaxis] * self.direction

    def acceleration_m_s2(self, t_s: Array) -> Array:
        return (self.amplitude_m_s2 * np.cos(self._phase(t_s)))[:, np.newaxis] * self.direction

    def _phase(self, t_s: Array) -> Array:
        return self.angular_rad_s * (t_s - self.start_s)
