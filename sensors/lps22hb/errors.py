"""The LPS22HB's deviations, from its datasheet (DocID027083 Rev 6), Table 3."""

from __future__ import annotations

from dataclasses import dataclass

from sensors.errors import Grade, GradeDraw


@dataclass(frozen=True)
class LPS22HBErrors:
    """Explicit numbers; the default is an ideal part."""

    pressure_bias_hpa: float = 0.0
    pressure_noise_hpa: float = 0.0  # RMS in the quietest setting: 75 Hz, low noise, filter at ODR/20
    temperature_bias_degc: float = 0.0

    @classmethod
    def of_grade(cls, grade: Grade, seed: int) -> LPS22HBErrors:
        """One part of the given grade; the limits are Table 3's, the accuracy that before calibration."""
        draw = GradeDraw(grade, "LPS22HB", seed)
        return cls(
            pressure_bias_hpa=draw.scalar(1.0),
            pressure_noise_hpa=draw.noise(0.0075),
            temperature_bias_degc=draw.scalar(1.5),
        )
