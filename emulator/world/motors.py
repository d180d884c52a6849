"""Four motors with propellers: vibration of the board, and the magnetic field of their current.

Sources at full throttle: ArduPilot's page "Measuring Vibration" (15 m/s2 RMS, the upper end of normal), and
an autopilot's COMPASS_MOT_X to Z (diydrones.com, "compass calibration always above 150").

Decisions: the full speed of the motors is 400 revolutions per second, an assumption for small coreless motors.
The speed follows the throttle immediately, and the motors do not turn the board.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fcu_emulator.emulator.world.track import Array

MOTORS = 4
FULL_HZ = 400.0
FULL_M_S2 = 15.0  # RMS of each axis with all four motors
FULL_MGAUSS = (-80.0, -42.0, 14.0)

_UNEQUAL = np.array([1.0, 0.985, 1.012, 0.994])  # relative speeds of the motors at the same throttle
_PHASES = 2.0 * np.pi * np.array([0.0, 0.62, 0.24, 0.85])
_BLADES = 2


@dataclass(frozen=True, eq=False)
class Motors:
    """The motors at ``throttle`` (4,), 0 to 1 each, from ``start_s``."""

    start_s: float
    throttle: Array

    @classmethod
    def at(cls, start_s: float, throttle: Sequence[float]) -> Motors:
        return cls(start_s, np.array(throttle, dtype=np.float64))

    @property
    def pace_s(self) -> float:
        return float(0.5 / (_BLADES * FULL_HZ * (self.throttle * _UNEQUAL).max()))

    def acceleration_m_s2(self, t_s: Array) -> Array:
        speed_hz = FULL_HZ * self.throttle * _UNEQUAL
        angle = 2.0 * np.pi * (t_s - self.start_s)[:, np.newaxis] * speed_hz + _PHASES
        one = FULL_M_S2 * np.sqrt(2.0 / MOTORS) * self.throttle**2
        around = (one * np.cos(angle)).sum(axis=1), (one * np.sin(angle)).sum(axis=1)
        return np.stack((*around, (one * np.cos(_BLADES * angle)).sum(axis=1)), axis=1)

    def field_mgauss(self) -> Array:
        field: Array = np.array([FULL_MGAUSS]) * self.throttle.mean()
        return field
