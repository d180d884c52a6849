"""Earth's field, magnets and steel near the board.

Users give fields in NED microtesla. Inside the program, fields are in NWU mgauss (1 uT = 10 mgauss).

Decision: a desk or a radiator is a sphere of soft steel. The sphere bends a uniform field in the same way as
a dipole with the moment R^3 B (Jackson, "Classical Electrodynamics", 5.11, for a large permeability). The
sphere may also have a permanent moment.
"""

from __future__ import annotations

import calendar
import datetime as dt
import math
from dataclasses import dataclass
from typing import Literal

import numpy as np

from fcu_emulator.emulator.errors import InputError
from fcu_emulator.emulator.world import limits
from fcu_emulator.emulator.world.follow import Approach
from fcu_emulator.emulator.world.track import Array

MGAUSS_PER_UT = 10.0
MU0_4PI = 1.0  # mgauss m3 / (A m2)
MOMENT_AM2 = 0.3  # moment of a neodymium bar of the size of a fingernail
FELT_MGAUSS = 0.1  # weaker fields are omitted: 1/15 of the LIS2MDL's step


def ned_to_nwu_mgauss(north_ut: float, east_ut: float, down_ut: float) -> Array:
    """Convert NED microtesla to NWU milligauss (3,), and check the range."""
    north = limits.FIELD.check("north_ut", north_ut)
    east = limits.FIELD.check("east_ut", east_ut)
    down = limits.FIELD.check("down_ut", down_ut)
    return MGAUSS_PER_UT * np.array([north, -east, -down])


def earth_field(
    latitude_deg: float,
    longitude_deg: float,
    altitude_m: float,
    date: dt.date,
    north: Literal["magnetic", "true"] = "magnetic",
) -> tuple[float, float, float]:
    """Return the Earth's field (north, east, down) in uT by the World Magnetic Model 2025.

    Latitude and longitude are geodetic, and the altitude is the height above the sea. ``north``: ``"magnetic"`` turns the
    field to north, ``"true"`` keeps the declination. Raises `InputError` for a value or date out of range.
    """
    latitude = limits.LATITUDE.check("latitude_deg", latitude_deg)
    longitude = limits.LONGITUDE.check("longitude_deg", longitude_deg)
    altitude = limits.MODEL_ALTITUDE.check("altitude_m", altitude_m)
    year = _decimal_year(date)
    if north not in ("magnetic", "true"):
        raise InputError(f'north must be "magnetic" or "true", not {north!r}', kind="choice")
    from pygeomag import GeoMag  # needed only by scenarios that name a place

    model = GeoMag(coefficients_file="wmm/WMM_2025.COF")
    first, last = model.life_span
    if not first <= year <= last:
        valid = f"{first:.0f}-01-01 to {last:.0f}-01-01"
        raise InputError(
            f"date must be from {valid} for the World Magnetic Model 2025, not {date}", kind="outside_model"
        )
    result = model.calculate(glat=latitude, glon=longitude, alt=altitude / 1000.0, time=year)
    x, y, z = result.x / 1000.0, result.y / 1000.0, result.z / 1000.0
    return (math.hypot(x, y), 0.0, z) if north == "magnetic" else (x, y, z)


def _decimal_year(date: dt.date) -> float:
    if not isinstance(date, dt.date):
        raise InputError(f"date must be a date such as 2026-03-01, not {date!r}", kind="not_a_date")
    days = 366 if calendar.isleap(date.year) else 365
    return date.year + (date.timetuple().tm_yday - 1) / days


@dataclass(frozen=True, eq=False)
class Magnet:
    """A dipole that moves to the north on a line east of the board.

    The dipole points west, so that it deflects the compass.
    """

    closest_s: float
    moment_am2: float
    distance_m: float
    speed_m_s: float

    @property
    def pace_s(self) -> float:
        return self.distance_m / self.speed_m_s

    @classmethod
    def starting_at(cls, start_s: float, moment_am2: float, distance_m: float, speed_m_s: float) -> Magnet:
        reach_m = (2.0 * MU0_4PI * abs(moment_am2) / FELT_MGAUSS) ** (1.0 / 3.0)
        half_line_m = math.sqrt(max(reach_m, 2.0 * distance_m) ** 2 - distance_m**2)
        return cls(start_s + half_line_m / speed_m_s, moment_am2, distance_m, speed_m_s)

    def value(self, t_s: Array, /) -> Array:
        from_magnet = np.zeros((t_s.size, 3))
        from_magnet[:, 0] = self.speed_m_s * (self.closest_s - t_s)
        from_magnet[:, 1] = self.distance_m
        return dipole_mgauss(np.array([[0.0, self.moment_am2, 0.0]]), from_magnet)


@dataclass(frozen=True, eq=False)
class HeldMagnet:
    """A dipole that points west and moves to ``place_m`` (3,), NWU relative to the magnetometer."""

    moment_am2: float
    place_m: Array
    approach: Approach | None = None

    def moving(self, t_s: Array) -> tuple[Array, Array, Array]:
        """Return position, speed and acceleration, each (N, 3), or (1, 3) at rest."""
        if self.approach is None:
            return self.place_m[np.newaxis], np.zeros((1, 3)), np.zeros((1, 3))
        deviation, speed, acceleration = self.approach.derivatives(t_s)
        return self.place_m + deviation, speed, acceleration

    def value(self, t_s: Array, /) -> Array:
        return dipole_mgauss(np.array([[0.0, self.moment_am2, 0.0]]), -self.moving(t_s)[0])


@dataclass(frozen=True, eq=False)
class Steel:
    """A sphere of steel at ``place_m`` (3,), NWU from the board's start.

    ``moment_am2`` (3,): its permanent moment, NWU.
    """

    place_m: Array
    radius_m: float
    moment_am2: Array

    def value(self, position_m: Array, outer_mgauss: Array) -> Array:
        """Return the field of the steel at positions (N, 3), NWU from the start, in an outer field (N or 1, 3)."""
        moment = self.moment_am2 + self.radius_m**3 / MU0_4PI * outer_mgauss
        return dipole_mgauss(moment, position_m - self.place_m, self.radius_m)


def dipole_mgauss(moment_am2: Array, from_magnet_m: Array, radius_m: float = limits.DISTANCE.low) -> Array:
    """Return the field of dipoles (N, 3) or (1, 3) at points (N, 3), in m from the dipole, NWU.

    The field is (3 (m.r) r / r^2 - m) / r^3. Inside ``radius_m``, it is the field at the distance ``radius_m``.
    """
    distance = np.sqrt((from_magnet_m**2).sum(axis=1))[:, np.newaxis]
    direction = from_magnet_m / np.where(distance == 0.0, 1.0, distance)
    along = (direction * moment_am2).sum(axis=1)[:, np.newaxis]
    field: Array = MU0_4PI * (3.0 * along * direction - moment_am2) / np.maximum(distance, radius_m) ** 3
    return field
