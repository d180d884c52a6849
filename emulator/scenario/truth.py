"""What the firmware's numbers would be if sensors, firmware and formulas were perfect.

Each is the world's own value in the unit that is printed. Two are not what the lab's firmware can reach:
its roll stays within 90 degrees, and MAG (after MagCalibration) is the field without the board's hard iron.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from emulator.scenario.printed import ANGLES
from emulator.world import World
from emulator.world.track import Array

Law = Callable[[World, Array], Array]
G_MODULUS = "|G|"  # printed by nobody; tells whether the accelerometer is a tilt sensor at that moment


def _attitude(column: int) -> Law:
    return lambda world, t_s: world.attitude_deg(t_s)[:, column]


def _acc_mg(column: int) -> Law:
    return lambda world, t_s: 1000.0 * world.specific_force_g(t_s)[:, column]


def _gyro_mdps(column: int) -> Law:
    return lambda world, t_s: 1000.0 * world.angular_rate_dps(t_s)[:, column]


def _mag_mgauss(column: int) -> Law:
    return lambda world, t_s: (world.magnetic_field_mgauss(t_s) - world.hard_iron_mgauss(t_s))[:, column]


TRUTH: dict[str, Law] = {
    **{f"ACC.{axis}": _acc_mg(column) for column, axis in enumerate("xyz")},
    **{f"GYR.{axis}": _gyro_mdps(column) for column, axis in enumerate("xyz")},
    **{f"MAG.{axis}": _mag_mgauss(column) for column, axis in enumerate("xyz")},
    **{angle: _attitude(column) for column, angle in enumerate(("Roll", "Pitch", "Yaw"))},
    "Pre": lambda world, t_s: world.pressure_hpa(t_s),
    "Altitude": lambda world, t_s: world.altitude_m(t_s),
    G_MODULUS: lambda world, t_s: np.linalg.norm(world.specific_force_g(t_s), axis=1),
}


def deviation(field: str, printed: float, wanted: float) -> float:
    """``printed`` minus ``wanted``, signed; of angles the shorter way round, within +-180 degrees."""
    difference = printed - wanted
    return (difference + 180.0) % 360.0 - 180.0 if field in ANGLES else difference
