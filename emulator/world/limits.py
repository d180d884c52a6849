"""Limits for user input: wide ranges in which the physics is defined. They detect values in a wrong unit."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from fcu_emulator.emulator.errors import InputError


@dataclass(frozen=True)
class Range:
    """A closed interval of values in ``unit``."""

    low: float
    high: float
    unit: str

    def check(self, name: str, value: float) -> float:
        """Return ``value`` as a float. Raises `InputError` with ``name`` if outside, nan or infinite."""
        try:
            number = float(value)
        except (TypeError, ValueError, OverflowError):
            number = math.nan
        if not self.low <= number <= self.high:
            raise InputError(f"{name} must be a number from {self}, not {value!r}", kind="out_of_range")
        return number

    def __str__(self) -> str:
        return f"{self.low:g} to {self.high:g} {self.unit}".rstrip()


ANGLE = Range(-36_000, 36_000, "deg")  # a hundred turns
ALTITUDE = Range(-1_000, 10_000, "m")
PRESSURE = Range(10, 2_000, "hPa")
PRESSURE_CHANGE = Range(-500, 500, "hPa")
WANDER = Range(0, 10, "hPa")
WIND = Range(0, 100, "m/s")
PUSH = Range(-100, 100, "hPa")
TEMPERATURE = Range(-90, 200, "degC")
HUMIDITY = Range(0, 100, "%")
FIELD = Range(-100_000, 100_000, "uT")
IRON = Range(-1_000_000, 1_000_000, "mgauss")
SOFT_IRON = Range(-100, 100, "")
GRAVITY = Range(0, 100, "m/s2")
SPECIFIC_FORCE = Range(-1_000, 1_000, "g")
RATE = Range(-100_000, 100_000, "deg/s")
TIME = Range(0, 10_000_000, "s")
DURATION = Range(1e-6, 1_000_000, "s")
TIME_CONSTANT = Range(0.001, 100, "s")
AMPLITUDE = Range(0, 1_000, "g")
FREQUENCY = Range(0.01, 10_000, "Hz")
WAY = Range(-100_000, 100_000, "m")
CLIMB = Range(-500, 500, "m/s2")  # limit for a recorded position; the second derivative of noise exceeds it
EXCURSION = Range(0, 100, "m")
ARM = Range(-2, 2, "m")  # distance from a wrist, an elbow or a shoulder to the board
TREMOR = Range(0, 1_000, "mg")
TREMOR_FREQUENCY = Range(2, 20, "Hz")
THROTTLE = Range(0, 1, "")
MOMENT = Range(-10_000, 10_000, "A m2")
DISTANCE = Range(0.005, 1_000, "m")
RADIUS = Range(0.005, 10, "m")
PLACE = Range(-1_000, 1_000, "m")
SPEED = Range(0.001, 1_000, "m/s")
TURNS = Range(1, 1_000, "turns")
LATITUDE = Range(-90, 90, "deg")
LONGITUDE = Range(-180, 180, "deg")
MODEL_ALTITUDE = Range(-1_000, 850_000, "m")  # range of the World Magnetic Model


def vector(name: str, values: npt.ArrayLike, allowed: Range) -> npt.NDArray[np.float64]:
    """Return three checked numbers as (3,)."""
    given = np.asarray(values, dtype=object)
    if given.shape != (3,):
        raise InputError(f"{name} must be three numbers, not {values!r}", kind="shape")
    return np.array([allowed.check(name, value) for value in given])


def attitude(roll_deg: float, pitch_deg: float, yaw_deg: float) -> npt.NDArray[np.float64]:
    """Return checked roll, pitch and yaw as (3,)."""
    named = (("roll_deg", roll_deg), ("pitch_deg", pitch_deg), ("yaw_deg", yaw_deg))
    return np.array([ANGLE.check(name, angle) for name, angle in named])
