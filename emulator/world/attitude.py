"""Rotations, Euler angles, and the pieces that form the track of the attitude.

Matrices R (N, 3, 3) map board to world vectors. Euler angles (N, 3) are roll, pitch, yaw in degrees with R =
Rz(yaw) Ry(pitch) Rx(roll). Source: Diebel, "Representing Attitude" (2006), sections 5.4, 6.2 and 8.

Decision: a piece's angular rate is the analytic derivative of its rotation, because errors of a numerical
differentiation would appear as noise.

Decision: the figure-of-eight that calibrates a compass is planned along the magnetic field at the motion's start.
In board axes, three twists move the tip of the field vector along Viviani's curve to both ends of all axes. So
the lab's MagCalibration finds the hard iron.

Decision: a second figure-of-eight imitates a hand, which does not know the field. After two turns, an error of
about 20 mgauss remains.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from fcu_emulator.emulator.world.track import Array, MinimumJerk, MotionProfile

# -- Rotations ----------------------------------------------------------------------------------------------


GIMBAL_LOCK_COSINE = 1e-9  # cosine of the pitch; below this value, roll and yaw turn about the same axis


def euler_to_matrix(euler_deg: Array) -> Array:
    """Convert degrees (N, 3) to matrices (N, 3, 3)."""
    roll, pitch, yaw = np.radians(euler_deg).T
    sr, cr = np.sin(roll), np.cos(roll)
    sp, cp = np.sin(pitch), np.cos(pitch)
    sy, cy = np.sin(yaw), np.cos(yaw)
    matrix = np.empty((len(euler_deg), 3, 3))
    rows = (
        (cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr),
        (sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr),
        (-sp, cp * sr, cp * cr),
    )
    for i, row in enumerate(rows):
        for j, element in enumerate(row):
            matrix[:, i, j] = element
    return matrix


def matrix_to_euler(matrix: Array) -> Array:
    """Convert (N, 3, 3) to degrees (N, 3); in gimbal lock roll is 0."""
    cosine = np.hypot(matrix[:, 2, 1], matrix[:, 2, 2])
    locked = cosine < GIMBAL_LOCK_COSINE
    pitch = np.arctan2(-matrix[:, 2, 0], cosine)
    roll = np.where(locked, 0.0, np.arctan2(matrix[:, 2, 1], matrix[:, 2, 2]))
    yaw = np.where(
        locked,
        np.arctan2(-matrix[:, 0, 1], matrix[:, 1, 1]),
        np.arctan2(matrix[:, 1, 0], matrix[:, 0, 0]),
    )
    euler_deg: Array = np.degrees(np.stack((roll, pitch, yaw), axis=1))
    return euler_deg


def about(axis: Array, angle_rad: Array) -> Array:
    """Return the rotations (N, 3, 3) about unit axes (3,) or (N, 3) (Rodrigues)."""
    x, y, z = axis.T
    sine, cosine = np.sin(angle_rad), np.cos(angle_rad)
    versine = 1.0 - cosine
    matrix = np.empty((len(angle_rad), 3, 3))
    matrix[:, 0, 0] = cosine + versine * x * x
    matrix[:, 1, 1] = cosine + versine * y * y
    matrix[:, 2, 2] = cosine + versine * z * z
    for row, column, third, component in ((0, 1, z, x * y), (1, 2, x, y * z), (2, 0, y, z * x)):
        matrix[:, row, column] = versine * component - sine * third
        matrix[:, column, row] = versine * component + sine * third
    return matrix


def axis_and_angle(matrix: Array) -> tuple[Array, Array]:
    """Return unit axis (N, 3) and angle (N,) in 0..pi by Shepperd's method, which is exact even at half a turn."""
    products = np.empty((len(matrix), 4, 4))
    diagonal = np.einsum("nii->ni", matrix)
    trace = diagonal.sum(axis=1)
    products[:, 0, 0] = 1.0 + trace
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        products[:, 1 + i, 1 + i] = 1.0 + 2.0 * diagonal[:, i] - trace
        products[:, 0, 1 + k] = products[:, 1 + k, 0] = matrix[:, j, i] - matrix[:, i, j]
        products[:, 1 + i, 1 + j] = products[:, 1 + j, 1 + i] = matrix[:, j, i] + matrix[:, i, j]
    largest = np.einsum("nii->ni", products).argmax(axis=1)
    quaternion = products[np.arange(len(matrix)), largest]
    quaternion *= np.where(quaternion[:, :1] < 0.0, -1.0, 1.0)  # the rotation of at most half a turn
    sine = np.sqrt((quaternion[:, 1:] ** 2).sum(axis=1))
    angle = 2.0 * np.arctan2(sine, quaternion[:, 0])
    still = sine == 0.0
    axis = quaternion[:, 1:] / np.where(still, 1.0, sine)[:, np.newaxis]
    axis[still] = (1.0, 0.0, 0.0)
    return axis, angle


def to_board(matrix: Array, vector: Array) -> Array:
    """Return the world ``vector`` (N, 3) or (1, 3) in board axes, R^T v."""
    seen: Array = np.einsum("nji,nj->ni", matrix, vector)
    return seen


def euler_rates(euler: Array, euler_dot: Array, euler_ddot: Array) -> tuple[Array, Array]:
    """Return the angular rate (N, 3) in board axes and its derivative, all in rad (Diebel, section 8.2)."""
    roll, pitch, _ = euler.T
    (roll_dot, pitch_dot, yaw_dot), (roll_ddot, pitch_ddot, yaw_ddot) = euler_dot.T, euler_ddot.T
    sr, cr, sp, cp = np.sin(roll), np.cos(roll), np.sin(pitch), np.cos(pitch)
    across, along = pitch_dot * cr + yaw_dot * cp * sr, yaw_dot * cp * cr - pitch_dot * sr
    rate = np.stack((roll_dot - yaw_dot * sp, across, along), axis=1)
    faster = np.stack(
        (
            roll_ddot - yaw_ddot * sp - yaw_dot * pitch_dot * cp,
            pitch_ddot * cr + yaw_ddot * cp * sr - yaw_dot * pitch_dot * sp * sr + roll_dot * along,
            yaw_ddot * cp * cr - yaw_dot * pitch_dot * sp * cr - pitch_ddot * sr - roll_dot * across,
        ),
        axis=1,
    )
    return rate, faster


# -- Pieces of the track ------------------------------------------------------------------------------------


class Attitude(Protocol):
    """Interface of a piece of the attitude. Results have N rows, or 1 if the board does not move."""

    @property
    def pace_s(self) -> float:
        """Duration in s of a motion from rest to rest, or of a quarter turn; 0 if the attitude jumps."""
        ...

    def rotation(self, t_s: Array, /) -> Array: ...

    def rate_dps(self, t_s: Array, /) -> Array: ...

    def acceleration_dps2(self, t_s: Array, /) -> Array: ...

    def euler_deg(self, t_s: Array, /) -> Array:
        """Return roll, pitch, yaw (N, 3). They exceed +-180 only if commanded angles exceed +-180."""
        ...


class Held:
    """Rest at ``euler_deg`` (3,). The next sweep starts at these values."""

    pace_s = math.inf

    def __init__(self, euler_deg: Array) -> None:
        self._euler_deg = np.array(euler_deg, dtype=np.float64)[np.newaxis]
        self._rotation = euler_to_matrix(self._euler_deg)
        self._rate_dps = np.zeros((1, 3))

    def rotation(self, _t_s: Array, /) -> Array:
        return self._rotation

    def rate_dps(self, _t_s: Array, /) -> Array:
        return self._rate_dps

    def acceleration_dps2(self, _t_s: Array, /) -> Array:
        return self._rate_dps

    def euler_deg(self, _t_s: Array, /) -> Array:
        return self._euler_deg


@dataclass(frozen=True, eq=False)
class Turn:
    """Rotation from ``start`` (3, 3) about the board axis ``axis`` (3,)."""

    start: Array
    axis: Array
    angle_rad: float
    profile: MotionProfile

    @property
    def pace_s(self) -> float:
        return self.profile.duration_s

    @classmethod
    def between(cls, start: Array, end: Array, profile: MotionProfile) -> Turn:
        axis, angle = axis_and_angle((start.T @ end)[np.newaxis])
        return cls(start, axis[0], float(angle[0]), profile)

    def rotation(self, t_s: Array) -> Array:
        return self.start @ about(self.axis, self.angle_rad * self.profile.progress(t_s))

    def rate_dps(self, t_s: Array) -> Array:
        return math.degrees(self.angle_rad) * self.profile.speed(t_s)[:, np.newaxis] * self.axis

    def acceleration_dps2(self, t_s: Array) -> Array:
        return math.degrees(self.angle_rad) * self.profile.acceleration(t_s)[:, np.newaxis] * self.axis

    def euler_deg(self, t_s: Array) -> Array:
        return matrix_to_euler(self.rotation(t_s))


@dataclass(frozen=True, eq=False)
class Twist:
    """A full turn about two board axes at the same time: R = start Rot(first, a) Rot(second, a)."""

    start: Array
    first: Array
    second: Array
    profile: MotionProfile

    @property
    def pace_s(self) -> float:
        return self.profile.duration_s / 4.0

    def rotation(self, t_s: Array) -> Array:
        angle = self._angle(t_s)
        return self.start @ about(self.first, angle) @ about(self.second, angle)

    def rate_dps(self, t_s: Array) -> Array:
        axes = self.second + self._first(t_s)
        return 360.0 * self.profile.speed(t_s)[:, np.newaxis] * axes

    def acceleration_dps2(self, t_s: Array) -> Array:
        first = self._first(t_s)
        turning = 2.0 * np.pi * self.profile.speed(t_s)[:, np.newaxis] ** 2 * np.cross(first, self.second)
        faster = self.profile.acceleration(t_s)[:, np.newaxis] * (self.second + first)
        both: Array = 360.0 * (faster + turning)
        return both

    def euler_deg(self, t_s: Array) -> Array:
        return matrix_to_euler(self.rotation(t_s))

    def _first(self, t_s: Array) -> Array:
        return to_board(about(self.second, self._angle(t_s)), self.first[np.newaxis])

    def _angle(self, t_s: Array) -> Array:
        return 2.0 * np.pi * self.profile.progress(t_s)


@dataclass(frozen=True, eq=False)
class SweepSegment:
    """Change of the Euler angles ``start_deg`` (3,) by ``change_deg`` (3,)."""

    start_deg: Array
    change_deg: Array
    profile: MotionProfile

    @property
    def pace_s(self) -> float:
        return self.profile.duration_s / max(float(np.abs(self.change_deg).max()) / 90.0, 1.0)

    def rotation(self, t_s: Array) -> Array:
        return euler_to_matrix(self.euler_deg(t_s))

    def rate_dps(self, t_s: Array) -> Array:
        euler = np.radians(self.euler_deg(t_s))
        rate: Array = np.degrees(euler_rates(euler, self._euler_dot(t_s), np.zeros((1, 3)))[0])
        return rate

    def acceleration_dps2(self, t_s: Array) -> Array:
        euler = np.radians(self.euler_deg(t_s))
        euler_ddot = self.profile.acceleration(t_s)[:, np.newaxis] * np.radians(self.change_deg)
        faster: Array = np.degrees(euler_rates(euler, self._euler_dot(t_s), euler_ddot)[1])
        return faster

    def euler_deg(self, t_s: Array) -> Array:
        return self.start_deg + self.profile.progress(t_s)[:, np.newaxis] * self.change_deg

    def _euler_dot(self, t_s: Array) -> Array:
        euler_dot: Array = self.profile.speed(t_s)[:, np.newaxis] * np.radians(self.change_deg)
        return euler_dot


@dataclass(frozen=True, eq=False)
class RecordedAttitude:
    """Rows of a recording, which are joined by the shortest arcs at constant rates."""

    row_s: Array  # (M,), strictly increasing
    row_deg: Array  # (M, 3)
    start_s: float  # virtual time of the recording's time 0
    pace_s = 0.0

    def rotation(self, t_s: Array) -> Array:
        t_s = t_s - self.start_s
        row, start, axis, angle = self._arcs(t_s)
        begin, end = self.row_s[row], self.row_s[row + 1]
        part = np.clip((t_s - begin) / (end - begin), 0.0, 1.0)
        return start @ about(axis, part * angle)

    def rate_dps(self, t_s: Array) -> Array:
        t_s = t_s - self.start_s
        row, _, axis, angle = self._arcs(t_s)
        speed = np.degrees(angle) / (self.row_s[row + 1] - self.row_s[row])
        moving = (t_s >= self.row_s[0]) & (t_s < self.row_s[-1])
        return np.where(moving, speed, 0.0)[:, np.newaxis] * axis

    def acceleration_dps2(self, _t_s: Array) -> Array:
        return np.zeros((1, 3))

    def euler_deg(self, t_s: Array) -> Array:
        return matrix_to_euler(self.rotation(t_s))

    def _arcs(self, t_s: Array) -> tuple[np.ndarray[tuple[int], np.dtype[np.intp]], Array, Array, Array]:
        row = np.clip(np.searchsorted(self.row_s, t_s, side="right") - 1, 0, self.row_s.size - 2)
        used, of_time = np.unique(row, return_inverse=True)  # one arc usually has many samples
        start = euler_to_matrix(self.row_deg[used])
        axis, angle = axis_and_angle(start.transpose(0, 2, 1) @ euler_to_matrix(self.row_deg[used + 1]))
        return row, start[of_time], axis[of_time], angle[of_time]


# -- The figure-of-eight ------------------------------------------------------------------------------------


X, Y, Z = np.eye(3)
# Pairs of board axes for Twist. With the field along X, their lobes go to +-Y, to +-Z, and from +X to -X.
EIGHTS = ((Z, Y), (Y, Z), (Z, X))
APPROACH = 0.1  # share of the duration for the turn to the field's direction, and for the turn back


@dataclass(frozen=True, eq=False)
class WavedEight:
    """Figures-of-eight that a hand draws; they begin and end at rotation ``start`` (3, 3)."""

    start: Array
    turns: int
    profile: MinimumJerk

    @property
    def pace_s(self) -> float:
        return self.profile.duration_s / (4.0 * self.turns) / 1.875

    def rotation(self, t_s: Array) -> Array:
        return self.start @ euler_to_matrix(np.degrees(self._euler(t_s)[0]))

    def rate_dps(self, t_s: Array) -> Array:
        rate: Array = np.degrees(euler_rates(*self._euler(t_s))[0])
        return rate

    def acceleration_dps2(self, t_s: Array) -> Array:
        faster: Array = np.degrees(euler_rates(*self._euler(t_s))[1])
        return faster

    def euler_deg(self, t_s: Array) -> Array:
        return matrix_to_euler(self.rotation(t_s))

    def _euler(self, t_s: Array) -> tuple[Array, Array, Array]:
        """Return the Euler angles and their first and second time derivatives, each (N, 3), in rad, rad/s and
        rad/s2.
        """
        laws = self.profile.progress, self.profile.speed, self.profile.acceleration
        phase, phase_dot, phase_ddot = (
            2.0 * np.pi * self.turns * law(t_s)[:, np.newaxis] * WAVED_PACES for law in laws
        )
        sine, cosine = WAVED_RAD * np.sin(phase), WAVED_RAD * np.cos(phase)
        return sine, cosine * phase_dot, cosine * phase_ddot - sine * phase_dot**2


WAVED_RAD = np.radians((150.0, 75.0, 90.0))  # about roll, pitch and yaw
WAVED_PACES = np.array((1.0, 2.0, 0.5))


def figure_eights(
    start_s: float, duration_s: float, turns: int, start: Array, field: Array
) -> list[tuple[float, Attitude]]:
    """Return the pieces (start in s, piece) from rotation ``start`` (3, 3) and back, in the NWU ``field`` (3,)."""
    aligned = _align(start, field)
    approach_s = APPROACH * duration_s
    eight_s = (duration_s - 2.0 * approach_s) / (turns * len(EIGHTS))
    pieces: list[tuple[float, Attitude]] = [
        (start_s, Turn.between(start, aligned, MinimumJerk(start_s, approach_s)))
    ]
    for number in range(turns * len(EIGHTS)):
        begin_s = start_s + approach_s + number * eight_s
        first, second = EIGHTS[number % len(EIGHTS)]
        pieces.append((begin_s, Twist(aligned, first, second, MinimumJerk(begin_s, eight_s))))
    back_s = start_s + duration_s - approach_s
    pieces.append((back_s, Turn.between(aligned, start, MinimumJerk(back_s, approach_s))))
    return pieces


def _align(start: Array, field: Array) -> Array:
    """Turn ``start`` by the shortest arc so that the board's X axis points along ``field``."""
    strength = np.linalg.norm(field)
    if strength == 0.0:
        return start
    seen = start.T @ field / strength  # in board axes
    normal = np.array([0.0, -seen[2], seen[1]])  # cross product of X and ``seen``
    sine = np.linalg.norm(normal)
    axis = normal / sine if sine > 0.0 else Z
    angle = np.arctan2(sine, seen[0])
    aligned: Array = start @ about(axis, np.array([angle]))[0]
    return aligned
