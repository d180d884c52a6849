"""A hand that holds the board: its wrist, about which the board turns, and its tremor.

The tremor is a sum of four sinusoids, whose strength rises and falls as in measured tremors. The strength in mg is
the peak of a single sinusoid with the same mean square, at the back of the hand. Sources: Wade, Gresty and Findley,
Arch. Neurol. 39, 1982 (10 mg, 2.5 Hz); Lakie et al., J. Physiol. 593, 2015 (6 to 12 Hz).

Decisions: the tremor bends the wrist, and turns the hand half as far about the two other axes (an assumption).
The phases of the tremor are the same for all seeds, because the seed selects the board, not the hand.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fcu_emulator.emulator.world.attitude import about, to_board
from fcu_emulator.emulator.world.follow import jacobian, turned_on
from fcu_emulator.emulator.world.track import Array, MinimumJerk

WRIST_M = (0.0, -0.1, 0.0)
"""Position of the wrist in board axes (de Leva, J. Biomech. 29, 1996, table 4)."""
TREMOR_MG = 10.0
"""Peak acceleration at the back of the hand, in thousandths of standard gravity."""
TREMOR_HZ = 8.0

_KNUCKLES_M = 0.086  # distance from the wrist at which a tremor's acceleration is measured
_SINUSOIDS = 4
_SPREAD_HZ = 2.5  # range of the sinusoids' frequencies
_OTHER_AXES = 0.5  # angle of the tremor about each of these axes, relative to the angle of the wrist
_FADE_IN_S = 0.5  # duration of a tremor's start, to avoid a jolt
_GOLDEN = 0.6180339887498949  # multiples of this fraction of a turn are never close together


@dataclass(frozen=True, eq=False)
class Tremor:
    """Rotation vector of a tremor: a sum of amplitude * cos(w (t - start) + phase), in board axes."""

    fade_in: MinimumJerk
    amplitude_rad: Array
    w_rad_s: Array
    phase_rad: Array

    @classmethod
    def of(cls, start_s: float, wrist_m: Array, peak_m_s2: float, frequency_hz: float) -> Tremor:
        spread = (np.arange(_SINUSOIDS) + 0.5) / _SINUSOIDS - 0.5  # evenly between -0.5 and 0.5
        w_rad_s = 2.0 * np.pi * (frequency_hz + _SPREAD_HZ * spread)[:, np.newaxis]
        peak_rad_s2 = (
            peak_m_s2 / _KNUCKLES_M / np.sqrt(_SINUSOIDS)
        )  # amplitude of each sinusoid; their sum has the mean square of one sinusoid
        across = np.cross((0.0, 0.0, 1.0), wrist_m)  # the axis about which the wrist bends
        length = np.linalg.norm(across)
        bending = across / length if length > 0.0 else np.array([1.0, 0.0, 0.0])
        part_about_axes = _OTHER_AXES + (1.0 - _OTHER_AXES) * np.abs(bending)
        amplitude = peak_rad_s2 * part_about_axes / (2.0 * np.pi * frequency_hz) ** 2
        phase = np.array([2.0 * np.pi * (n * _GOLDEN % 1.0) for n in range(1, 3 * _SINUSOIDS + 1)])
        return cls(MinimumJerk(start_s, _FADE_IN_S), amplitude, w_rad_s, phase.reshape(_SINUSOIDS, 3))

    @property
    def pace_s(self) -> float:
        return float(np.pi / self.w_rad_s.max())

    def derivatives(self, t_s: Array) -> tuple[Array, Array, Array]:
        """Return the rotation vector in rad and its two derivatives, each (N, 3)."""
        angle = (t_s - self.fade_in.start_s)[:, np.newaxis, np.newaxis] * self.w_rad_s + self.phase_rad
        terms = self.amplitude_rad * np.cos(angle)
        x = terms.sum(axis=1)
        x_dot = -(self.amplitude_rad * self.w_rad_s * np.sin(angle)).sum(axis=1)
        x_ddot = -(self.w_rad_s**2 * terms).sum(axis=1)
        if t_s.size and t_s.min() >= self.fade_in.start_s + self.fade_in.duration_s:
            return x, x_dot, x_ddot
        fade, fade_dot, fade_ddot = (
            law(t_s)[:, np.newaxis]
            for law in (self.fade_in.progress, self.fade_in.speed, self.fade_in.acceleration)
        )
        return (  # product rule
            fade * x,
            fade_dot * x + fade * x_dot,
            fade_ddot * x + 2.0 * fade_dot * x_dot + fade * x_ddot,
        )


@dataclass(frozen=True, eq=False)
class Grip:
    """A hand that holds the board.

    ``taken_m`` (3,): position of the board relative to the wrist when the hand took the board, NWU.
    """

    wrist_m: Array
    tremor: Tremor | None
    taken_m: Array

    def rotation(self, steady: Array, t_s: Array) -> Array:
        if self.tremor is None:
            return steady
        turned: Array = steady @ _matrix(self.tremor.derivatives(t_s)[0])
        return turned

    def rate_dps(self, steady_dps: Array, t_s: Array) -> Array:
        if self.tremor is None:
            return steady_dps
        x, x_dot, _ = self.tremor.derivatives(t_s)
        return to_board(_matrix(x), steady_dps) + np.degrees(_rate_rad_s(x, x_dot))

    def carried_m_s2(self, steady_dps: Array, steady_dps2: Array, t_s: Array) -> Array:
        """Return the acceleration that turning about the wrist causes, in board axes, (N, 3) or (1, 3)."""
        rate, acceleration = np.radians(steady_dps), np.radians(steady_dps2)
        if self.tremor is not None:
            # ``own``: rate of the trembling axes relative to the steady axes.
            x, x_dot, x_ddot = self.tremor.derivatives(t_s)
            matrix, own = _matrix(x), _rate_rad_s(x, x_dot)
            rate, acceleration = to_board(matrix, rate), to_board(matrix, acceleration)
            acceleration = acceleration - np.cross(own, rate)
            acceleration += np.einsum("nij,nj->ni", jacobian(x), x_ddot)  # derivative of own, first part
            acceleration += turned_on(x, x_dot)  # second part
            rate = rate + own
        arm = -self.wrist_m  # from the wrist to the board
        carried: Array = np.cross(acceleration, arm) + np.cross(rate, np.cross(rate, arm))
        return carried

    def shift_m(self, rotation: Array) -> Array:
        """Return the distance by which turning about the wrist has moved the board, NWU, (N, 3)."""
        return from_wrist_m(rotation, self.wrist_m) - self.taken_m


def from_wrist_m(rotation: Array, wrist_m: Array) -> Array:
    """Return the position of the board relative to the wrist, NWU, (N, 3)."""
    place: Array = -(rotation @ wrist_m)
    return place


def _matrix(x: Array) -> Array:
    angle = np.sqrt((x * x).sum(axis=1))
    return about(x / np.where(angle == 0.0, 1.0, angle)[:, np.newaxis], angle)


def _rate_rad_s(x: Array, x_dot: Array) -> Array:
    rate: Array = np.einsum("nij,nj->ni", jacobian(x), x_dot)
    return rate
