"""Absolute wrist tilt: an axis points up or down far enough for long enough (AN5040 6.4; datasheet 12).

A direction counts when its mask bit is set and the acceleration along it is above the threshold, which is the
sine of the angle between axis and horizontal plane. Held for the latency it makes one event; the next one
needs the direction to be left and taken again.
"""

from __future__ import annotations

from dataclasses import dataclass

from sensors.errors import Vec3
from sensors.lsm6dsl.bank_b import A_WRIST_TILT_LAT, A_WRIST_TILT_THS, A_WRIST_TILT_Mask
from sensors.sampling import PS_PER_S

_LATENCY_LSB_PS = 40 * PS_PER_S // 1000
_THRESHOLD_LSB_MG = 15.625
_X_POSITIVE, _X_NEGATIVE = 0x80, 0x40  # Y and Z follow two and four bits further down
_DIRECTIONS = (0x80, 0x40, 0x20, 0x10, 0x08, 0x04)


@dataclass(frozen=True)
class WristTiltSettings:
    """What bank B says."""

    latency_ps: int
    threshold_mg: float
    mask: int

    @classmethod
    def decode(cls, mem: bytearray) -> WristTiltSettings:
        """Read the settings out of bank B."""
        return cls(
            latency_ps=mem[A_WRIST_TILT_LAT.addr] * _LATENCY_LSB_PS,
            threshold_mg=mem[A_WRIST_TILT_THS.addr] * _THRESHOLD_LSB_MG,
            mask=mem[A_WRIST_TILT_Mask.addr],
        )


class WristTilt:
    """Measures how long each direction has been held."""

    def __init__(self) -> None:
        self._since_ps: dict[int, int] = {}
        self._reported = 0

    def restart(self) -> None:
        """No direction has been held so far."""
        self._since_ps.clear()
        self._reported = 0

    def feed(self, acceleration_mg: Vec3, at_ps: int, settings: WristTiltSettings) -> int:
        """A sample; the directions that make an event now, as bits of WRIST_TILT_IA."""
        over = _over(acceleration_mg, settings.threshold_mg) & settings.mask
        self._reported &= over
        events = 0
        for direction in _DIRECTIONS:
            if not over & direction:
                self._since_ps.pop(direction, None)
            elif at_ps - self._since_ps.setdefault(direction, at_ps) >= settings.latency_ps:
                events |= direction
        events &= ~self._reported
        self._reported |= events
        return events


def _over(acceleration_mg: Vec3, threshold_mg: float) -> int:
    """The directions above the threshold, as bits of WRIST_TILT_IA."""
    over = 0
    for axis, value in enumerate(acceleration_mg):
        if value > threshold_mg:
            over |= _X_POSITIVE >> 2 * axis
        elif value < -threshold_mg:
            over |= _X_NEGATIVE >> 2 * axis
    return over
