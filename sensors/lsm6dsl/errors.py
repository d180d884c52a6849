"""The LSM6DSL's deviations, from its datasheet (DocID028475 Rev 7), Table 3.

Two figures are the same in every grade and there to be set by hand: the datasheet has no tolerance for the
output data rates (parts that run a few percent fast or slow are well known), and for the gyroscope's start it
has a typical time only.
"""

from __future__ import annotations

from dataclasses import dataclass, field, fields
from fractions import Fraction

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
    gyro_turn_on_ms: float = field(default=35.0, metadata={"limits": (0.0, 1000.0)})  # Table 4; see gyroscope
    odr_percent: float = field(default=0.0, metadata={"limits": (-20.0, 20.0)})  # faster, of every rate

    def __post_init__(self) -> None:
        """Raises ValueError for a figure that no part can have."""
        for figure in fields(self):
            if "limits" not in figure.metadata:
                continue
            (low, high), value = figure.metadata["limits"], getattr(self, figure.name)
            if not low <= value <= high:
                raise ValueError(f"LSM6DSLErrors.{figure.name} is {value:g}; give {low:g} to {high:g}")

    @property
    def rate_factor(self) -> Fraction:
        """The part's true output data rates over the nominal ones."""
        return 1 + Fraction(self.odr_percent / 100).limit_denominator(10**6)

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
