"""How a real board deviates from an ideal one beside its sensors: its own iron, and its oscillators.

The steel of USB plug, battery and screws, and what it has been magnetised to, turn with the board: a field
that is always the same (hard iron), and the Earth's field bent (soft iron). Both are drawn from the seed,
as a part's figures are (:mod:`sensors.errors`), so that each board of a class has its own.

Nobody has published such figures of this board. They are chosen from calibrations of eight others that
people put into their programs: among them Adafruit_AHRS, examples/ahrs_fusion_usb (9, -75, -352 mgauss;
0.943, 0.918, 1.156 along and 0.011, 0.020, -0.008 between the axes) and an ArduPilot autopilot on its USB
lead alone (-203, 69, 21 mgauss; diydrones.com, "compass calibration always above 150"). Half of their
offsets are beyond 115 mgauss, the root of the mean square of their soft iron is 6 % along an axis and 2.4 %
between two. A sensor's own offset and sensitivity are in these numbers, and are drawn for themselves here
(LIS2MDL: 60 mgauss, 7 %), so less is taken. ArduPilot calls an offset below 150 mgauss healthy.

The chip's internal oscillator is trimmed to within 1 %, and firmware that runs from it has other bit rates
and another tick than it believes. The quartz is exact unless ``hse_ppm`` says otherwise: no document gives
its tolerance, usual ones are off by 30 ppm at most, a second in nine hours, which nobody sees in a lab.

It is warmer than the air by what it draws, and follows the air in its time (:mod:`emulator.world.warmth`).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from sensors.errors import PartErrors, Vec3, drawn, drawn_by_axis, fixed, strength

_CALIBRATIONS = "published calibrations of other boards"


@dataclass(frozen=True)
class BoardErrors(PartErrors):
    """Explicit numbers, axes those of the board; the default is an ideal board."""

    PART: ClassVar[str] = "board"

    hard_iron_mgauss: Vec3 = drawn_by_axis(
        "field of the board's own magnetised steel", "mgauss", 300.0, _CALIBRATIONS
    )
    soft_iron_percent: Vec3 = drawn_by_axis(
        "by how much steel strengthens the field along X, Y, Z", "%", 9.0, _CALIBRATIONS
    )
    soft_iron_across_percent: Vec3 = drawn_by_axis(
        "between X and Y, X and Z, Y and Z: part of the field along the other axis", "%", 6.0, _CALIBRATIONS
    )

    hsi_percent: float = drawn(
        "by how much the internal oscillator is faster", "%", 1.0, "STM32F401xB/C datasheet, HSI, 25 degC"
    )
    hse_ppm: float = fixed(
        "by how much the quartz is faster", "ppm", 0.0, "not documented", (-1000.0, 1000.0)
    )

    heating_degc: float = strength(
        "by how much the board is warmer than the air", "degC", 5.0, "its size and supply current"
    )
    thermal_s: float = strength(
        "time constant with which it becomes so", "s", 200.0, "its size and thickness"
    )

    def soft_iron(self) -> NDArray[np.float64]:
        """The matrix (3, 3) by which the outer field is seen: symmetric, as of steel without hysteresis."""
        matrix = np.eye(3) + np.diag(self.soft_iron_percent) / 100.0
        for (row, column), percent in zip(
            ((0, 1), (0, 2), (1, 2)), self.soft_iron_across_percent, strict=True
        ):
            matrix[row, column] = matrix[column, row] = percent / 100.0
        return matrix
