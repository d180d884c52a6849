"""The LSM6DSL's deviations, from its datasheet (DocID028475 Rev 7), Table 3."""

from __future__ import annotations

from dataclasses import dataclass

from sensors.errors import ZERO, Grade, GradeDraw, Vec3


@dataclass(frozen=True)
class LSM6DSLErrors:
    """Explicit numbers, axes in the sensor's own frame; the default is an ideal part."""

    acc_bias_mg: Vec3 = ZERO
    acc_scale_percent: Vec3 = ZERO
    acc_bias_drift_mg_per_degc: Vec3 = ZERO
    acc_scale_drift_percent_per_degc: float = 0.0
    acc_noise_ug_rthz: float = 0.0  # at +-2 and +-4 g; 8 and 16 g scale as in Table 3
    gyro_bias_dps: Vec3 = ZERO
    gyro_scale_percent: Vec3 = ZERO
    gyro_bias_drift_dps_per_degc: Vec3 = ZERO
    gyro_scale_drift_percent_per_degc: float = 0.0
    gyro_noise_mdps_rthz: float = 0.0
    temperature_offset_degc: float = 0.0

    @classmethod
    def of_grade(cls, grade: Grade, seed: int) -> LSM6DSLErrors:
        """One part of the given grade; the limits are Table 3's."""
        draw = GradeDraw(grade, "LSM6DSL", seed)
        return cls(
            acc_bias_mg=draw.vector(40.0),  # zero-g offset
            acc_scale_percent=draw.vector(1.0),
            acc_bias_drift_mg_per_degc=draw.vector(0.1),
            acc_scale_drift_percent_per_degc=draw.scalar(0.01),
            acc_noise_ug_rthz=draw.noise(80.0),
            gyro_bias_dps=draw.vector(3.0),  # zero-rate level
            gyro_scale_percent=draw.vector(1.0),
            gyro_bias_drift_dps_per_degc=draw.vector(0.015),
            gyro_scale_drift_percent_per_degc=draw.scalar(0.007),
            gyro_noise_mdps_rthz=draw.noise(4.0),
            temperature_offset_degc=draw.scalar(15.0),
        )
