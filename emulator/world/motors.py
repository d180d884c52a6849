"""Four motors with propellers on the board: how they shake it, and the field of their current.

A motor shakes the board with the force of its imbalance, which turns with it and grows with the square of
its speed, and up and down at the pace of two blades. The four never run equally fast, so their lines beat.
The current to the motors makes a field that is fixed to the board.

Nobody has measured this board. Speed and share of the full voltage are taken as proportional, as of brushed
motors. With all motors at full throttle an axis is shaken by 15 m/s2 RMS, which ArduPilot's page "Measuring
Vibration" shows as the upper end of what is normal; the field is what a calibration at full throttle found
on an autopilot of this kind, (-80, -42, 14) mgauss (COMPASS_MOT_X to Z; diydrones.com, "compass calibration
always above 150"), and grows linearly, as ArduPilot compensates it.

Decisions: full speed is 400 revolutions a second, an assumption for small coreless motors with their
propellers. A motor follows its throttle at once; spinning up takes some 0.1 s on a real one. No gyroscope
sees anything: the board is shaken, not turned.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fcu_emulator.emulator.world.track import Array

MOTORS = 4
FULL_HZ = 400.0
FULL_M_S2 = 15.0  # RMS of an axis, all four together
FULL_MGAUSS = (-80.0, -42.0, 14.0)

_UNEQUAL = np.array([1.0, 0.985, 1.012, 0.994])  # their speeds at the same throttle
_PHASES = 2.0 * np.pi * np.array([0.0, 0.62, 0.24, 0.85])
_BLADES = 2


@dataclass(frozen=True, eq=False)
class Motors:
    """Motors that run at ``throttle`` (4,), 0 to 1 each, from ``start_s`` on."""

    start_s: float
    throttle: Array

    @classmethod
    def at(cls, start_s: float, throttle: Sequence[float]) -> Motors:
        """At these four shares of the full voltage."""
        return cls(start_s, np.array(throttle, dtype=np.float64))

    @property
    def pace_s(self) -> float:
        """Half a period of the fastest line."""
        return float(0.5 / (_BLADES * FULL_HZ * (self.throttle * _UNEQUAL).max()))

    def acceleration_m_s2(self, t_s: Array) -> Array:
        """Board axes, (N, 3)."""
        speed_hz = FULL_HZ * self.throttle * _UNEQUAL
        angle = 2.0 * np.pi * (t_s - self.start_s)[:, np.newaxis] * speed_hz + _PHASES
        one = FULL_M_S2 * np.sqrt(2.0 / MOTORS) * self.throttle**2
        around = (one * np.cos(angle)).sum(axis=1), (one * np.sin(angle)).sum(axis=1)
        return np.stack((*around, (one * np.cos(_BLADES * angle)).sum(axis=1)), axis=1)

    def field_mgauss(self) -> Array:
        """Board axes, (1, 3)."""
        field: Array = np.array([FULL_MGAUSS]) * self.throttle.mean()
        return field
