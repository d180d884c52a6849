"""How a motion gets from 0 to 1 in its duration: progress, and its exact derivatives in time.

Minimum jerk is how a human hand moves from rest to rest (Flash and Hogan, J. Neurosci. 5, 1985, eq. for the
straight reach): speed and acceleration are zero at both ends, so that gyroscope and accelerometer see no
step.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from emulator.world.track import Array


class Profile(Protocol):
    """Progress from 0 to 1; ``t_s`` (N,) -> (N,)."""

    def progress(self, t_s: Array) -> Array:
        """The part done."""
        ...

    def speed(self, t_s: Array) -> Array:
        """Its first derivative in 1/s."""
        ...


@dataclass(frozen=True)
class Linear:
    """Constant speed: it starts and stops with a jump."""

    start_s: float
    duration_s: float

    def progress(self, t_s: Array) -> Array:
        """The part done."""
        return np.clip((t_s - self.start_s) / self.duration_s, 0.0, 1.0)

    def speed(self, t_s: Array) -> Array:
        """Its first derivative in 1/s."""
        return np.full(t_s.shape, 1.0 / self.duration_s)


@dataclass(frozen=True)
class MinimumJerk:
    """10 u^3 - 15 u^4 + 6 u^5 of u = (t - start) / duration."""

    start_s: float
    duration_s: float

    def progress(self, t_s: Array) -> Array:
        """The part done."""
        u = self._u(t_s)
        return u * u * u * (10.0 - 15.0 * u + 6.0 * u * u)

    def speed(self, t_s: Array) -> Array:
        """Its first derivative in 1/s."""
        rest = self._u(t_s)
        rest *= 1.0 - rest
        return 30.0 / self.duration_s * rest * rest

    def acceleration(self, t_s: Array) -> Array:
        """Its second derivative in 1/s2."""
        u = self._u(t_s)
        return 60.0 / self.duration_s**2 * u * (1.0 - u) * (1.0 - 2.0 * u)

    def _u(self, t_s: Array) -> Array:
        return np.clip((t_s - self.start_s) / self.duration_s, 0.0, 1.0)
