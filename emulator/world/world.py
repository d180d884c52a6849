"""The world as scenarios, the web page and tests use it: truth, motions, and live setters."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import numpy.typing as npt

from emulator.errors import InputError
from emulator.world import limits
from emulator.world.atmosphere import pressure_ratio
from emulator.world.attitude import Held
from emulator.world.line import Rest
from emulator.world.magnetism import ned_to_nwu_mgauss
from emulator.world.motions import Motions
from emulator.world.track import Constant, Track

ZURICH_ALTITUDE_M = 408.0


class World(Motions):
    """One truth for all sensors; ``now_s`` tells the present in seconds of virtual time.

    It begins flat and still on the room's floor, board X to the north, in the air and the field of Zurich. A
    setter takes effect now, at a jump, and cuts off what was planned for the same quantity. Values that are
    not numbers, or absurd, raise `InputError`.
    """

    def __init__(
        self, now_s: Callable[[], float] = lambda: 0.0, floor_altitude_m: float = ZURICH_ALTITUDE_M
    ) -> None:
        super().__init__(now_s, floor_altitude_m)

    def set_attitude(self, roll_deg: float, pitch_deg: float, yaw_deg: float) -> None:
        """Put the board in another attitude, without an angular rate in between."""
        self._plan_attitude((self._now_s(), Held(limits.attitude(roll_deg, pitch_deg, yaw_deg))))

    def set_altitude(self, metres: float) -> None:
        """Put the board ``metres`` above the floor, without acceleration; a shake goes on around it."""
        self._plan_height((self._now_s(), Rest(limits.ALTITUDE.check("metres", metres))))

    def set_pressure(self, hpa: float) -> None:
        """Let the weather make it ``hpa`` at the board's present altitude: another pressure at the floor."""
        here = limits.PRESSURE.check("hpa", hpa)
        now = np.array([self._now_s()])
        ratio = pressure_ratio(self._altitude_m(now), self._temperature_degc(now))[0]
        self._set(self._floor_pressure, here / ratio, "pressure")

    def set_temperature(self, degc: float) -> None:
        """Another temperature of the air; the pressure at the floor stays."""
        self._set(self._temperature, limits.TEMPERATURE.check("degc", degc), "temperature")

    def set_magnetic_field(self, north_ut: float, east_ut: float, down_ut: float) -> None:
        """Another field of the Earth, NED; disturbances stay on top of it."""
        self._set(self._earth, ned_to_nwu_mgauss(north_ut, east_ut, down_ut), "mag")

    def set_hard_iron(self, x_mgauss: float, y_mgauss: float, z_mgauss: float) -> None:
        """The board's own field at the magnetometer, board axes."""
        named = (("x_mgauss", x_mgauss), ("y_mgauss", y_mgauss), ("z_mgauss", z_mgauss))
        self._set(self._hard_iron, [limits.IRON.check(name, value) for name, value in named], "mag")

    def set_soft_iron(self, matrix: npt.ArrayLike) -> None:
        """The 3 x 3 matrix by which iron on the board distorts the outer field, board axes."""
        rows = np.asarray(
            matrix, dtype=object
        )  # as it came, so that the check below can name what is no number
        if rows.shape != (3, 3):
            raise InputError(f"soft iron has the shape {rows.shape}: give 3 rows of 3 numbers")
        checked = [[limits.SOFT_IRON.check("soft iron", value) for value in row] for row in rows]
        self._set(self._soft_iron, checked, "mag")

    def set_gravity(self, m_s2: float) -> None:
        """Another gravity than the standard 9.80665 m/s2; a free fall keeps the one it began with."""
        self._set(self._gravity, limits.GRAVITY.check("m_s2", m_s2), "acc")

    def _set(self, track: Track[Constant], value: npt.ArrayLike, signal: str) -> None:
        now = self._now_s()
        track.plan(now, Constant(value))
        self._changed(now, (signal,))
