"""The LPS22HB's deviations, from its datasheet (DocID027083 Rev 6), Table 3.

Table 3 gives the absolute accuracy as +-1 hPa before and +-0.1 hPa after a one-point calibration, and the
relative accuracy between 800 and 1100 hPa at 25 degC as +-0.1 hPa. Decisions:

* what calibration takes away is one number, ``pressure_bias_hpa``; what soldering adds to it has no figure of
  its own. RPDS or AUTOZERO are how firmware calibrates.
* relative accuracy is a straight line through the middle of its range.
* what temperature adds is a straight line too. The 0.1 hPa that hold from 0 to 65 degC are reached at the end
  that lies farther from 25 degC.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sensors.errors import Grade, GradeDraw
from sensors.part import Signal
from sensors.sampling import Times

_MIDDLE_HPA, _HALF_RANGE_HPA = 950.0, 150.0  # of 800 to 1100 hPa
_REFERENCE_DEGC, _FARTHEST_DEGC = 25.0, 65.0


@dataclass(frozen=True)
class LPS22HBErrors:
    """Explicit numbers; the default is an ideal part."""

    pressure_bias_hpa: float = 0.0
    pressure_noise_hpa: float = 0.0  # RMS in the quietest setting: 75 Hz, low noise, filter at ODR/20
    temperature_bias_degc: float = 0.0
    pressure_relative_hpa: float = 0.0  # at 1100 hPa, minus as much at 800 hPa
    pressure_drift_hpa_per_degc: float = 0.0  # from 25 degC on

    @classmethod
    def of_grade(cls, grade: Grade, seed: int) -> LPS22HBErrors:
        """One part of the given grade; the limits are Table 3's, the accuracy that before calibration."""
        draw = GradeDraw(grade, "LPS22HB", seed)
        return cls(
            pressure_bias_hpa=draw.scalar(1.0),
            pressure_noise_hpa=draw.noise(0.0075),
            temperature_bias_degc=draw.scalar(1.5),
            pressure_relative_hpa=draw.scalar(0.1),
            pressure_drift_hpa_per_degc=draw.scalar(0.1 / (_FARTHEST_DEGC - _REFERENCE_DEGC)),
        )

    def deviating_hpa(
        self, pressure_hpa: NDArray[np.float64], t_s: Times, temperature_degc: Signal
    ) -> NDArray[np.float64]:
        """``pressure_hpa`` (n,) at the times ``t_s`` as the part measures it, without noise.

        The temperature is asked for only where something drifts.
        """
        hpa = pressure_hpa + self.pressure_bias_hpa
        if self.pressure_relative_hpa:
            hpa += self.pressure_relative_hpa / _HALF_RANGE_HPA * (pressure_hpa - _MIDDLE_HPA)
        if self.pressure_drift_hpa_per_degc:
            hpa += self.pressure_drift_hpa_per_degc * (temperature_degc(t_s) - _REFERENCE_DEGC)
        return hpa
