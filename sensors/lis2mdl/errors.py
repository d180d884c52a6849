"""The LIS2MDL's deviations, from its datasheet (DocID030621 Rev 3), Table 3."""

from __future__ import annotations

from dataclasses import dataclass

from sensors.errors import ZERO, Grade, GradeDraw, Vec3


@dataclass(frozen=True)
class LIS2MDLErrors:
    """Explicit numbers, axes in the sensor's own frame; the default is an ideal part."""

    bias_mgauss: Vec3 = ZERO
    scale_percent: Vec3 = ZERO
    bias_drift_mgauss_per_degc: Vec3 = ZERO
    scale_drift_percent_per_degc: float = 0.0
    noise_mgauss: float = 0.0  # RMS in high resolution without LPF and OFF_CANC; other modes follow Table 3
    temperature_offset_degc: float = 0.0  # not in the datasheet; zero in every grade
    set_reset_offset_mgauss: Vec3 = ZERO  # Hoff: added after a set pulse, subtracted after a reset pulse
    cross_axis_percent: Vec3 = ZERO  # between X and Y, X and Z, Y and Z: of the field along the other axis

    @classmethod
    def of_grade(cls, grade: Grade, seed: int) -> LIS2MDLErrors:
        """One part of the given grade; the limits are Table 3's, the offset's with offset cancellation.

        No document gives a figure for the offset that cancellation removes. It is taken as twice the one that
        remains (60 mgauss), so that leaving cancellation out is seen. Nor does Table 3 give one for what an
        axis sees of the field along another: 1 % is taken, an axis tilted by 0.6 degrees.
        """
        draw = GradeDraw(grade, "LIS2MDL", seed)
        return cls(
            bias_mgauss=draw.vector(60.0),
            scale_percent=draw.vector(7.0),
            bias_drift_mgauss_per_degc=draw.vector(0.3),
            scale_drift_percent_per_degc=draw.scalar(0.03),
            noise_mgauss=draw.noise(4.5),
            set_reset_offset_mgauss=draw.vector(120.0),
            cross_axis_percent=draw.vector(1.0),
        )
