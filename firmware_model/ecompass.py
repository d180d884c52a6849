"""The slides' formulas: hard-iron calibration, eCompass, and hypsometric altitude.

Values are computed in double and stored as float32.

Decision: the slides' roll, atan2(Gy, sqrt(mu*Gx^2 + Gz^2)), is kept although it is an
approximation. The exact atan2(Gy, Gz) would not match the lab.
"""

from __future__ import annotations

import struct
from functools import lru_cache
from math import atan2, cos, pi, sin, sqrt

from fcu_emulator.firmware_model.c_semantics import c_pow, f32, float_divide
from fcu_emulator.firmware_model.sensor_data import AxesRaw_TypeDef

# -- Calibration --------------------------------------------------------------------------------------------


MAG_MIN_START = 10000
MAG_MAX_START = -10000


def MagCalibration(mag: AxesRaw_TypeDef, mag_min: AxesRaw_TypeDef, mag_max: AxesRaw_TypeDef) -> None:
    """Extend the extremes to include ``mag`` (mgauss), then subtract the extremes' centre from ``mag``."""
    x, min_x, max_x = mag.AXIS_X, mag_min.AXIS_X, mag_max.AXIS_X
    y, min_y, max_y = mag.AXIS_Y, mag_min.AXIS_Y, mag_max.AXIS_Y
    z, min_z, max_z = mag.AXIS_Z, mag_min.AXIS_Z, mag_max.AXIS_Z

    if x < min_x:
        mag_min.AXIS_X = min_x = x
    if y < min_y:
        mag_min.AXIS_Y = min_y = y
    if z < min_z:
        mag_min.AXIS_Z = min_z = z
    if x > max_x:
        mag_max.AXIS_X = max_x = x
    if y > max_y:
        mag_max.AXIS_Y = max_y = y
    if z > max_z:
        mag_max.AXIS_Z = max_z = z

    # int(sum / 2) truncates toward zero as C's division does; // rounds down
    mag.AXIS_X = x - int((max_x + min_x) / 2)
    mag.AXIS_Y = y - int((max_y + min_y) / 2)
    mag.AXIS_Z = z - int((max_z + min_z) / 2)


# -- Attitude and altitude ----------------------------------------------------------------------------------


_pack1, _unpack1 = struct.Struct("<f").pack, struct.Struct("<f").unpack
_pack2, _unpack2 = struct.Struct("<ff").pack, struct.Struct("<ff").unpack
_pack3, _unpack3 = struct.Struct("<fff").pack, struct.Struct("<fff").unpack

_DEGREES = 180 / pi
_KELVIN = 273.15
_LAPSE_RATE = 0.0065  # K/m, of the standard atmosphere
_EXPONENT = 1 / 5.257


def eCompass(acc: AxesRaw_TypeDef, mag: AxesRaw_TypeDef, mu: float) -> tuple[float, float, float]:
    """Return pitch, roll and yaw in degrees (float32) from acceleration in mg and field in mgauss.

    The axes are X right, Y forward, Z up, with +1000 mg on an upward axis. Yaw is 0 if X points to
    magnetic north, and increases counter-clockwise, seen from above.
    """
    return _angles(acc.AXIS_X, acc.AXIS_Y, acc.AXIS_Z, mag.AXIS_X, mag.AXIS_Y, mag.AXIS_Z, mu)


@lru_cache(maxsize=4096)
def _angles(
    acc_x: int, acc_y: int, acc_z: int, mag_x: int, mag_y: int, mag_z: int, mu: float
) -> tuple[float, float, float]:
    # The integer is negated, not the float: a flat board must give +0.0, but -(0.0) is -0.0.
    minus_gx, gy, gz = float(-acc_x), float(acc_y), float(acc_z)
    gx2, gz2 = minus_gx * minus_gx, gz * gz
    bx, by, bz = float(mag_x), float(mag_y), float(mag_z)

    pitch, roll = _unpack2(_pack2(atan2(minus_gx, sqrt(gy * gy + gz2)), atan2(gy, sqrt(mu * gx2 + gz2))))

    sin_roll, cos_roll = sin(roll), cos(roll)
    by2, bz2 = _unpack2(_pack2(bz * sin_roll - by * cos_roll, by * sin_roll + bz * cos_roll))
    (bx3,) = _unpack1(_pack1(bx * cos(pitch) + bz2 * sin(pitch)))
    (yaw,) = _unpack1(_pack1(atan2(by2, bx3)))

    return _unpack3(_pack3(pitch * _DEGREES, roll * _DEGREES, yaw * _DEGREES))


def getAltitude(press: float, temperature: float, press_zero_level: float) -> float:
    """Return the height in m (float32) above level ``press_zero_level``, from hPa and degC.

    As in C, a pressure of 0 gives an infinity, and a negative pressure a NaN.
    """
    ratio = float_divide(press_zero_level, press)
    return f32((c_pow(ratio, _EXPONENT) - 1) * (temperature + _KELVIN) / _LAPSE_RATE)
