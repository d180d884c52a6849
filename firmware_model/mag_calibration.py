"""The slides' hard-iron calibration: running extremes of each axis; their centre is subtracted.

As in C, it corrects ``mag`` in place. A sample that was not refreshed (failed read) is corrected again on the
next call; the slides' code does the same.
"""

from __future__ import annotations

from firmware_model.axes import AxesRaw_TypeDef

MAG_MIN_START = 10000
MAG_MAX_START = -10000


def MagCalibration(mag: AxesRaw_TypeDef, mag_min: AxesRaw_TypeDef, mag_max: AxesRaw_TypeDef) -> None:
    """Widen the extremes by this sample, then subtract their centre; mgauss. The first sample gives 0."""
    x, min_x, max_x = mag.AXIS_X, mag_min.AXIS_X, mag_max.AXIS_X
    y, min_y, max_y = mag.AXIS_Y, mag_min.AXIS_Y, mag_max.AXIS_Y
    z, min_z, max_z = mag.AXIS_Z, mag_min.AXIS_Z, mag_max.AXIS_Z

    # find min
    if x < min_x:
        mag_min.AXIS_X = min_x = x
    if y < min_y:
        mag_min.AXIS_Y = min_y = y
    if z < min_z:
        mag_min.AXIS_Z = min_z = z
    # find max
    if x > max_x:
        mag_max.AXIS_X = max_x = x
    if y > max_y:
        mag_max.AXIS_Y = max_y = y
    if z > max_z:
        mag_max.AXIS_Z = max_z = z

    # hard-iron calibration; int(sum / 2) truncates toward zero like C's division, where // would round down
    mag.AXIS_X = x - int((max_x + min_x) / 2)
    mag.AXIS_Y = y - int((max_y + min_y) / 2)
    mag.AXIS_Z = z - int((max_z + min_z) / 2)
