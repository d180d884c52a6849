"""The pieces of the attitude's track: each gives rotation and angular rate from one formula.

Decision: the rate is the analytic derivative of the piece's own rotation, so that integrating the gyroscope
returns the attitude; between pieces it jumps. Road not taken: differentiating numerically, which shows up as
noise.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from emulator.world.profile import Profile
from emulator.world.rotation import about, axis_and_angle, euler_to_matrix, matrix_to_euler, to_board
from emulator.world.track import Array


class Attitude(Protocol):
    """A piece of attitude; every result's first axis is N, or 1 for one that does not move."""

    def rotation(self, t_s: Array, /) -> Array:
        """Board to world, (N, 3, 3)."""
        ...

    def rate_dps(self, t_s: Array, /) -> Array:
        """Angular rate in board axes, (N, 3) deg/s."""
        ...

    def euler_deg(self, t_s: Array, /) -> Array:
        """Roll, pitch, yaw (N, 3), beyond +-180 where they were commanded so."""
        ...


class Held:
    """At rest at ``euler_deg`` (3,); the angles are kept as given, for a later sweep to start from."""

    def __init__(self, euler_deg: Array) -> None:
        self._euler_deg = np.array(euler_deg, dtype=np.float64)[np.newaxis]
        self._rotation = euler_to_matrix(self._euler_deg)
        self._rate_dps = np.zeros((1, 3))

    def rotation(self, _t_s: Array, /) -> Array:
        """Board to world, (1, 3, 3)."""
        return self._rotation

    def rate_dps(self, _t_s: Array, /) -> Array:
        """No rate, (1, 3)."""
        return self._rate_dps

    def euler_deg(self, _t_s: Array, /) -> Array:
        """The angles as given, (1, 3)."""
        return self._euler_deg


@dataclass(frozen=True, eq=False)
class Turn:
    """From rotation ``start`` (3, 3) by ``angle_rad`` about the fixed board axis ``axis`` (3,)."""

    start: Array
    axis: Array
    angle_rad: float
    profile: Profile

    @classmethod
    def between(cls, start: Array, end: Array, profile: Profile) -> Turn:
        """The shortest arc between two rotations (3, 3)."""
        axis, angle = axis_and_angle((start.T @ end)[np.newaxis])
        return cls(start, axis[0], float(angle[0]), profile)

    def rotation(self, t_s: Array) -> Array:
        """Board to world, (N, 3, 3)."""
        return self.start @ about(self.axis, self.angle_rad * self.profile.progress(t_s))

    def rate_dps(self, t_s: Array) -> Array:
        """Angular rate in board axes, (N, 3)."""
        return math.degrees(self.angle_rad) * self.profile.speed(t_s)[:, np.newaxis] * self.axis

    def euler_deg(self, t_s: Array) -> Array:
        """Roll, pitch, yaw (N, 3)."""
        return matrix_to_euler(self.rotation(t_s))


@dataclass(frozen=True, eq=False)
class Twist:
    """A full turn about two board axes at once: R = start Rot(first, a) Rot(second, a), a = 0 to 360 deg."""

    start: Array
    first: Array
    second: Array
    profile: Profile

    def rotation(self, t_s: Array) -> Array:
        """Board to world, (N, 3, 3)."""
        angle = self._angle(t_s)
        return self.start @ about(self.first, angle) @ about(self.second, angle)

    def rate_dps(self, t_s: Array) -> Array:
        """Angular rate in board axes, (N, 3): the first axis is itself turned about the second."""
        axes = self.second + to_board(about(self.second, self._angle(t_s)), self.first[np.newaxis])
        return 360.0 * self.profile.speed(t_s)[:, np.newaxis] * axes

    def euler_deg(self, t_s: Array) -> Array:
        """Roll, pitch, yaw (N, 3)."""
        return matrix_to_euler(self.rotation(t_s))

    def _angle(self, t_s: Array) -> Array:
        return 2.0 * np.pi * self.profile.progress(t_s)


@dataclass(frozen=True, eq=False)
class Sweep:
    """From Euler angles ``start_deg`` (3,) by ``change_deg`` (3,), all angles at the profile's pace."""

    start_deg: Array
    change_deg: Array
    profile: Profile

    def rotation(self, t_s: Array) -> Array:
        """Board to world, (N, 3, 3)."""
        return euler_to_matrix(self.euler_deg(t_s))

    def rate_dps(self, t_s: Array) -> Array:
        """Angular rate in board axes, (N, 3) (Diebel 2006, section 8.2: Euler rates to body rates)."""
        roll, pitch, _ = np.radians(self.euler_deg(t_s)).T
        roll_rate, pitch_rate, yaw_rate = (self.profile.speed(t_s)[:, np.newaxis] * self.change_deg).T
        x = roll_rate - yaw_rate * np.sin(pitch)
        y = pitch_rate * np.cos(roll) + yaw_rate * np.cos(pitch) * np.sin(roll)
        z = yaw_rate * np.cos(pitch) * np.cos(roll) - pitch_rate * np.sin(roll)
        return np.stack((x, y, z), axis=1)

    def euler_deg(self, t_s: Array) -> Array:
        """Roll, pitch, yaw (N, 3), unwrapped."""
        return self.start_deg + self.profile.progress(t_s)[:, np.newaxis] * self.change_deg


@dataclass(frozen=True, eq=False)
class Recorded:
    """Rows of a recording: shortest arcs between them at constant rate, the first row held before."""

    row_s: Array  # (M,), strictly increasing
    row_deg: Array  # (M, 3)

    def rotation(self, t_s: Array) -> Array:
        """Board to world, (N, 3, 3)."""
        row, start, axis, angle = self._arcs(t_s)
        begin, end = self.row_s[row], self.row_s[row + 1]
        part = np.clip((t_s - begin) / (end - begin), 0.0, 1.0)
        return start @ about(axis, part * angle)

    def rate_dps(self, t_s: Array) -> Array:
        """Angular rate in board axes, (N, 3)."""
        row, _, axis, angle = self._arcs(t_s)
        speed = np.degrees(angle) / (self.row_s[row + 1] - self.row_s[row])
        moving = (t_s >= self.row_s[0]) & (t_s < self.row_s[-1])
        return np.where(moving, speed, 0.0)[:, np.newaxis] * axis

    def euler_deg(self, t_s: Array) -> Array:
        """Roll, pitch, yaw (N, 3)."""
        return matrix_to_euler(self.rotation(t_s))

    def _arcs(self, t_s: Array) -> tuple[np.ndarray[tuple[int], np.dtype[np.intp]], Array, Array, Array]:
        """Row before each time (N,), its rotation (N, 3, 3), axis (N, 3) and angle (N,) to the next row."""
        row = np.clip(np.searchsorted(self.row_s, t_s, side="right") - 1, 0, self.row_s.size - 2)
        used, of_time = np.unique(row, return_inverse=True)  # many samples share an arc
        start = euler_to_matrix(self.row_deg[used])
        axis, angle = axis_and_angle(start.transpose(0, 2, 1) @ euler_to_matrix(self.row_deg[used + 1]))
        return row, start[of_time], axis[of_time], angle[of_time]
