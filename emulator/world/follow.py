"""Pieces of attitude and altitude that follow a frequently changing target, for example one set with a mouse.

If a hand moves steadily, the board follows with a delay of 3 / w. With w = 4 / time constant, this delay is three
quarters of the time constant. The remaining quarter is for the time between commands. For an attitude, the deviation x
is the rotation vector from target to board. The derivatives of x use the "right Jacobian" of SO(3) (Chirikjian,
"Stochastic Models, Information Theory, and Lie Groups" 2, 2012, section 10.3).

Decision: a followed target is approached with three equal poles, so that the board's acceleration is
continuous at every command.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fcu_emulator.emulator.world.attitude import about, axis_and_angle, euler_to_matrix, matrix_to_euler
from fcu_emulator.emulator.world.track import Array

POLES = 4.0  # w times the time constant
SETTLED = 10.0  # time constants after which exp(-w t) is negligible, 4e-18


@dataclass(frozen=True, eq=False)
class Approach:
    """The deviation from a target, (a + b t + c t^2) exp(-w t), from ``start_s``; a, b, c are (3,) or (1,)."""

    start_s: float
    w: float
    a: Array
    b: Array
    c: Array

    @property
    def pace_s(self) -> float:
        return 8.4 / self.w

    @classmethod
    def of(cls, start_s: float, time_constant_s: float, x: Array, x_dot: Array, x_ddot: Array) -> Approach:
        w = POLES / time_constant_s
        b = x_dot + w * x
        return cls(start_s, w, x, b, 0.5 * (x_ddot - w * w * x + 2.0 * w * b))

    def derivatives(self, t_s: Array) -> tuple[Array, Array, Array]:
        """Return the deviation and its two derivatives, each (N, 3) or (N, 1)."""
        t = (t_s - self.start_s)[:, np.newaxis]
        decay = np.exp(-self.w * t)
        x = (self.a + (self.b + self.c * t) * t) * decay
        polynomial_dot = (self.b + 2.0 * self.c * t) * decay
        polynomial_ddot = 2.0 * self.c * decay
        x_dot = polynomial_dot - self.w * x
        return x, x_dot, polynomial_ddot - 2.0 * self.w * polynomial_dot + self.w * self.w * x


# -- Altitude -----------------------------------------------------------------------------------------------


@dataclass(frozen=True, eq=False)
class FollowedHeight:
    """An altitude that approaches the height ``target_m``."""

    target_m: float
    approach: Approach

    @property
    def pace_s(self) -> float:
        return self.approach.pace_s

    @classmethod
    def begin(
        cls, start_s: float, time_constant_s: float, target_m: float, state: tuple[float, float, float]
    ) -> FollowedHeight:
        position, speed, acceleration = (np.array([value]) for value in state)
        approach = Approach.of(start_s, time_constant_s, position - target_m, speed, acceleration)
        return cls(target_m, approach)

    def position_m(self, t_s: Array, /) -> Array:
        height: Array = self.target_m + self.approach.derivatives(t_s)[0][:, 0]
        return height

    def speed_m_s(self, t_s: Array, /) -> Array:
        speed: Array = self.approach.derivatives(t_s)[1][:, 0]
        return speed

    def acceleration_m_s2(self, t_s: Array, /) -> Array:
        acceleration: Array = self.approach.derivatives(t_s)[2][:, 0]
        return acceleration


# -- Attitude -----------------------------------------------------------------------------------------------


@dataclass(frozen=True, eq=False)
class FollowedAttitude:
    """An attitude that approaches the rotation ``target`` (3, 3)."""

    target: Array
    approach: Approach

    @property
    def pace_s(self) -> float:
        return self.approach.pace_s

    @classmethod
    def begin(
        cls,
        start_s: float,
        time_constant_s: float,
        target_deg: Array,
        rotation: Array,
        rate: Array,
        acceleration: Array,
    ) -> FollowedAttitude:
        target = euler_to_matrix(target_deg[np.newaxis])[0]
        axis, angle = axis_and_angle((target.T @ rotation)[np.newaxis])
        x = axis * angle[:, np.newaxis]
        inverse = np.linalg.inv(jacobian(x)[0])
        x_dot = inverse @ rate
        x_ddot = inverse @ (acceleration - turned_on(x, x_dot[np.newaxis])[0])
        return cls(target, Approach.of(start_s, time_constant_s, x[0], x_dot, x_ddot))

    def rotation(self, t_s: Array, /) -> Array:
        x = self.approach.derivatives(t_s)[0]
        angle = np.sqrt((x * x).sum(axis=1))
        axis = x / np.where(angle == 0.0, 1.0, angle)[:, np.newaxis]
        turned: Array = self.target @ about(axis, angle)
        return turned

    def rate_dps(self, t_s: Array, /) -> Array:
        x, x_dot, _ = self.approach.derivatives(t_s)
        rate: Array = np.degrees(np.einsum("nij,nj->ni", jacobian(x), x_dot))
        return rate

    def acceleration_dps2(self, t_s: Array, /) -> Array:
        x, x_dot, x_ddot = self.approach.derivatives(t_s)
        turned: Array = np.einsum("nij,nj->ni", jacobian(x), x_ddot) + turned_on(x, x_dot)
        degrees: Array = np.degrees(turned)
        return degrees

    def euler_deg(self, t_s: Array, /) -> Array:
        return matrix_to_euler(self.rotation(t_s))


SMALL = 0.05  # rad; at smaller angles the series are exact to 1e-13


def jacobian(x: Array) -> Array:
    """Return J (N, 3, 3) with rate = J(x) dx/dt for x (N, 3): 1 - A [x] + B [x]^2."""
    cross = _cross(x)
    a, b, _, _ = _coefficients(x)
    jacobian: Array = np.eye(3) - a * cross + b * (cross @ cross)
    return jacobian


def turned_on(x: Array, v: Array) -> Array:
    """Return the angular acceleration (dJ/dt) v of a constant dx/dt = v, (N, 3)."""
    _, b, a_slope, b_slope = (one[:, 0] for one in _coefficients(x))
    along = (x * v).sum(axis=1, keepdims=True)
    sideways = np.cross(x, v)
    turned: Array = along * (b_slope * np.cross(x, sideways) - a_slope * sideways) + b * np.cross(v, sideways)
    return turned


def _coefficients(x: Array) -> tuple[Array, Array, Array, Array]:
    """Return A = (1 - cos r) / r^2, B = (r - sin r) / r^3, dA/dr / r, dB/dr / r with r = |x|."""
    square = (x * x).sum(axis=1)[:, np.newaxis, np.newaxis]
    angle = np.sqrt(square)
    small = angle < SMALL
    r = np.where(small, 1.0, angle)
    sine, versine = np.sin(r), 1.0 - np.cos(r)
    a = np.where(small, 1 / 2 - square / 24 + square**2 / 720, versine / r**2)
    b = np.where(small, 1 / 6 - square / 120 + square**2 / 5040, (r - sine) / r**3)
    a_slope = np.where(small, -1 / 12 + square / 180 - square**2 / 6720, (r * sine - 2 * versine) / r**4)
    b_slope = np.where(
        small,
        -1 / 60 + square / 1260 - square**2 / 60480,
        (r * versine - 3 * (r - sine)) / r**5,
    )
    return a, b, a_slope, b_slope


def _cross(x: Array) -> Array:
    """Return the matrices [x] with [x] v = x cross v, (N, 3, 3)."""
    cross = np.zeros((len(x), 3, 3))
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        cross[:, j, i], cross[:, i, j] = x[:, k], -x[:, k]
    return cross
