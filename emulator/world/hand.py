"""A hand that holds the board: the wrist about which it turns, and its tremor.

A board that turns about a point beside it is also carried along: with r from the wrist to the board its
sensors feel the angular acceleration times r and the centripetal w x (w x r), of which an accelerometer
cannot tell whether it is gravity. The board's attitude and the hand's height keep their tracks; a grip is
what is added.

A tremor turns the hand to and fro about the wrist. It is the sum of four lines spread over 2.5 Hz, so that
it swells and fades as a measured one does. Its strength is that of one line at the back of the hand, as
tremor is measured: 10 mg peak are the mode of 97 healthy subjects, who had 1.5 to 35 mg, and 2.5 Hz is by
how much their frequency varied (Wade, Gresty and Findley, "A Normative Study of Postural Tremor of the
Hand", Arch. Neurol. 39, 1982). Its frequency lies between 6 and 12 Hz (Lakie et al., J. Physiol. 593,
2015).

Decisions: the tremor bends the wrist, and turns the hand half as far about the two other axes, for which
these sources have no figures. Its phases are always the same: what is drawn from a seed is the board, not
the hand. Road not taken: a tremor of the acceleration alone, which the gyroscope would not see and from
which no attitude follows.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from emulator.world.attitude import about, to_board
from emulator.world.follow import jacobian, turned_on
from emulator.world.track import Array, MinimumJerk

WRIST_M = (0.0, -0.1, 0.0)
"""Where the wrist is, board axes, of a hand that holds the board from behind: some 9 cm from wrist to
knuckles (de Leva, J. Biomech. 29, 1996, table 4), and the board a little beyond them."""
TREMOR_MG = 10.0
TREMOR_HZ = 8.0

_KNUCKLES_M = 0.086  # from the wrist: where a tremor of so many mg is measured
_SPREAD_HZ = 2.5
_LINES = 4
_SIDEWAYS = 0.5  # of the tremor that bends the wrist, how much there is about the other two axes
_SETTLE_S = 0.5  # in which a tremor begins: the board is taken without a blow
_GOLDEN = 0.6180339887498949  # multiples of it leave no two phases close together


@dataclass(frozen=True, eq=False)
class Tremor:
    """A small rotation of the board, by the rotation vector sum of a cos(w t + phase) of its lines.

    ``amplitude_rad`` (3,) of a line about each board axis; ``line_rad_s`` and ``phase_rad`` (lines, 1) and
    (lines, 3).
    """

    begin: MinimumJerk
    amplitude_rad: Array
    line_rad_s: Array
    phase_rad: Array

    @classmethod
    def of(cls, start_s: float, wrist_m: Array, peak_m_s2: float, frequency_hz: float) -> Tremor:
        """Of a hand with its wrist at ``wrist_m`` (3,), board axes; ``peak_m_s2`` at its back."""
        spread = (np.arange(_LINES) + 0.5) / _LINES - 0.5
        line_rad_s = 2.0 * np.pi * (frequency_hz + _SPREAD_HZ * spread)[:, np.newaxis]
        of_one = peak_m_s2 / _KNUCKLES_M / np.sqrt(_LINES)
        sideways = np.cross((0.0, 0.0, 1.0), wrist_m)
        length = np.linalg.norm(sideways)
        bending = sideways / length if length > 0.0 else np.array([1.0, 0.0, 0.0])
        about_axes = _SIDEWAYS + (1.0 - _SIDEWAYS) * np.abs(bending)
        amplitude = of_one * about_axes / (2.0 * np.pi * frequency_hz) ** 2
        phase = np.array([2.0 * np.pi * (n * _GOLDEN % 1.0) for n in range(1, 3 * _LINES + 1)])
        return cls(MinimumJerk(start_s, _SETTLE_S), amplitude, line_rad_s, phase.reshape(_LINES, 3))

    @property
    def pace_s(self) -> float:
        """Half a period: from rest to rest."""
        return float(np.pi / self.line_rad_s.max())

    def derivatives(self, t_s: Array) -> tuple[Array, Array, Array]:
        """The rotation vector and its first two derivatives in time, each (N, 3)."""
        angle = (t_s - self.begin.start_s)[:, np.newaxis, np.newaxis] * self.line_rad_s + self.phase_rad
        to_and_fro = self.amplitude_rad * np.cos(angle)
        value = to_and_fro.sum(axis=1)
        speed = -(self.amplitude_rad * self.line_rad_s * np.sin(angle)).sum(axis=1)
        bend = -(self.line_rad_s**2 * to_and_fro).sum(axis=1)
        if t_s.size and t_s.min() >= self.begin.start_s + self.begin.duration_s:
            return value, speed, bend
        part, faster, bent = (
            law(t_s)[:, np.newaxis]
            for law in (self.begin.progress, self.begin.speed, self.begin.acceleration)
        )
        return part * value, faster * value + part * speed, bent * value + 2.0 * faster * speed + part * bend


@dataclass(frozen=True, eq=False)
class Grip:
    """A hand around the board, its wrist at ``wrist_m`` (3,), board axes.

    ``taken_m``: how far the board was above the wrist when it was taken; the altitude is the one of then plus
    what the hand's height and its turning have changed.
    """

    wrist_m: Array
    tremor: Tremor | None
    taken_m: float

    def rotation(self, steady: Array, t_s: Array) -> Array:
        """Board to world (N, 3, 3) of a hand that would be ``steady`` (N or 1, 3, 3)."""
        if self.tremor is None:
            return steady
        turned: Array = steady @ _small(self.tremor.derivatives(t_s)[0])
        return turned

    def rate_dps(self, steady_dps: Array, t_s: Array) -> Array:
        """Angular rate in board axes, (N, 3)."""
        if self.tremor is None:
            return steady_dps
        x, speed, _ = self.tremor.derivatives(t_s)
        return to_board(_small(x), steady_dps) + np.degrees(_rate(x, speed))

    def carried_m_s2(self, steady_dps: Array, steady_dps2: Array, t_s: Array) -> Array:
        """How turning about the wrist accelerates the board, in its axes, (N, 3) or (1, 3).

        Of the angular rate and acceleration that the board has in a steady hand.
        """
        rate, faster = np.radians(steady_dps), np.radians(steady_dps2)
        if self.tremor is not None:
            x, speed, bend = self.tremor.derivatives(t_s)
            small, own = _small(x), _rate(x, speed)
            rate, seen = to_board(small, rate), to_board(small, faster)
            faster = seen - np.cross(own, rate) + np.einsum("nij,nj->ni", jacobian(x), bend)
            faster += turned_on(x, speed)
            rate = rate + own
        arm = -self.wrist_m
        carried: Array = np.cross(faster, arm) + np.cross(rate, np.cross(rate, arm))
        return carried

    def above_wrist_m(self, rotation: Array) -> Array:
        """How far the board is above the wrist in these attitudes (N, 3, 3); (N,)."""
        above: Array = -(rotation[:, 2] @ self.wrist_m)
        return above

    def rise_m(self, rotation: Array) -> Array:
        """How much higher than when it was taken; (N,)."""
        return self.above_wrist_m(rotation) - self.taken_m


def _small(x: Array) -> Array:
    """The rotations (N, 3, 3) by these rotation vectors (N, 3)."""
    angle = np.sqrt((x * x).sum(axis=1))
    return about(x / np.where(angle == 0.0, 1.0, angle)[:, np.newaxis], angle)


def _rate(x: Array, speed: Array) -> Array:
    """The angular rate of a rotation vector (N, 3) that changes, in the turned axes, rad/s."""
    rate: Array = np.einsum("nij,nj->ni", jacobian(x), speed)
    return rate
