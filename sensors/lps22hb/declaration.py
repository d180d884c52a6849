"""Declarations of the LPS22HB: signals, bus, deviations, functions."""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from typing import ClassVar

from fcu_emulator.sensors.declaration import Bus, Function, Output, Quantity
from fcu_emulator.sensors.errors import PartErrors, drawn, heating_share, noise, rate_deviation, rate_factor

SIGNALS = (
    Quantity("pressure_hpa", "hPa", 1, "air pressure", Output(0x28, size=3)),
    Quantity("temperature_degc", "degC", 1, "temperature of the part", Output(0x2B)),
)

BUS = Bus(i2c_addresses=(0x5C, 0x5D), spi_wires=4, source="datasheet 7")

_TABLE_3 = "datasheet Table 3"
REFERENCE_DEGC, _FARTHEST_DEGC = 25.0, 65.0


@dataclass(frozen=True)
class LPS22HBErrors(PartErrors):
    """Deviations of an LPS22HB, typical values of Table 3. Decisions:

    * ``pressure_bias_hpa`` is the constant pressure error of the LPS22HB before calibration by the user.
    * the relative error of the LPS22HB grows linearly from the middle of its pressure range.
    * the temperature error of the LPS22HB is linear, with 0.1 hPa at the temperature limit that is farther from 25 degC.
    """

    PART: ClassVar[str] = "LPS22HB"

    pressure_bias_hpa: float = drawn("offset before calibration", "hPa", 1.0, _TABLE_3, "typical")
    pressure_noise_hpa: float = noise(
        "RMS in the quietest setting: 75 Hz, low noise, filter at ODR/20", "hPa", 0.0075, _TABLE_3
    )
    temperature_bias_degc: float = drawn("offset of the thermometer", "degC", 1.5, _TABLE_3, "typical")
    pressure_relative_hpa: float = drawn(
        "error at 1100 hPa; at 800 hPa with the opposite sign", "hPa", 0.1, _TABLE_3, "typical"
    )
    pressure_drift_hpa_per_degc: float = drawn(
        "drift with the temperature, 0 at 25 degC",
        "hPa/degC",
        0.1 / (_FARTHEST_DEGC - REFERENCE_DEGC),
        _TABLE_3,
        "typical",
    )
    odr_percent: float = rate_deviation()
    heating_percent: float = heating_share()

    @property
    def rate_factor(self) -> Fraction:
        return rate_factor(self.odr_percent)


FUNCTIONS = (
    Function("I2C and SPI, 3-wire and 4-wire, burst wrap 0x2C to 0x28", "datasheet 5.8 and 7"),
    Function(
        "power-on, BOOT, SWRESET",
        "datasheet 9.6 and 9.15",
        "the registers answer at once; BOOT_STATUS lasts 5 ms after power-on, BOOT one period of the rate "
        "(1 ms in power-down), SWRESET 10 us; no time is documented",
    ),
    Function(
        "pressure and temperature at a rate",
        "datasheet Table 3",
        "the error is one straight line over pressure and one over temperature; no document has the noise of "
        "settings other than the quietest, so the noise was chosen for plausible heights, 0.012 hPa RMS in "
        "low current without a filter; the error of the rates is assumed to be as large as the LSM6DSL's; no document "
        "describes pressures outside 260 to 1260 hPa: the sensor measures there as inside this range, and "
        "a note reports it",
    ),
    Function(
        "one shot",
        "datasheet 9.6",
        "13 ms in low noise and 5 ms in low current, figures of the sister part LPS22HH; a sample, also "
        "one at a rate, is the mean of the pressure over that time",
    ),
    Function(
        "low-pass filter",
        "datasheet Table 18",
        "second-order Butterworth at the documented cut-off; order and shape are not documented",
    ),
    Function(
        "STATUS, overrun, BDU",
        "datasheet 9.5 and 9.17",
        "P_DA and T_DA are cleared by reading the high byte of their output, as in the LPS25H",
    ),
    Function(
        "reference: AUTOZERO, AUTORIFP, RPDS",
        "datasheet 9.1",
        "one LSB of RPDS is 1/16 hPa as in the LPS25H (a constructor argument)",
    ),
    Function("differential interrupt and INT_DRDY pin", "datasheet 9.1, 9.2, 9.7 and 9.15"),
    Function("FIFO, all seven modes", "datasheet 5 and 9.8"),
    Function("supply current", "datasheet Table 3", "grows with the rate from the figures at 1 Hz"),
)
