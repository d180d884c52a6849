"""Declarations of the LIS2MDL: signals, bus, deviations, functions."""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from typing import ClassVar

from fcu_emulator.sensors.declaration import Bus, Function, Output, Quantity
from fcu_emulator.sensors.errors import (
    PartErrors,
    Vec3,
    drawn,
    drawn_by_axis,
    fixed,
    heating_share,
    noise,
    rate_deviation,
    rate_factor,
)

SIGNALS = (
    Quantity("magnetic_field_mgauss", "mgauss", 3, "magnetic field", Output(0x68)),
    Quantity("temperature_degc", "degC", 1, "temperature of the part", Output(0x6E, zero=25.0)),
)

BUS = Bus(
    i2c_addresses=(0x1E,),
    i2c_highest_hz=3_400_000,
    spi_wires=3,
    source="datasheet 6; 4WSPI: AN5069 Rev 4",
)

_TABLE_3 = "datasheet Table 3"


@dataclass(frozen=True)
class LIS2MDLErrors(PartErrors):
    """Deviations of a LIS2MDL, axes in the sensor's frame (datasheet Table 3).

    Assumptions: offset cancellation removes 120 mgauss, and the coupling between axes is 1 %.
    """

    PART: ClassVar[str] = "LIS2MDL"

    bias_mgauss: Vec3 = drawn_by_axis("offset with offset cancellation", "mgauss", 60.0, _TABLE_3)
    scale_percent: Vec3 = drawn_by_axis("error of the sensitivity", "%", 7.0, _TABLE_3)
    bias_drift_mgauss_per_degc: Vec3 = drawn_by_axis(
        "drift of the offset", "mgauss/degC", 0.3, _TABLE_3, "typical"
    )
    scale_drift_percent_per_degc: float = drawn(
        "drift of the sensitivity", "%/degC", 0.03, _TABLE_3, "typical"
    )
    noise_mgauss: float = noise(
        "RMS in high resolution without LPF and OFF_CANC; other modes follow Table 3", "mgauss", 4.5, _TABLE_3
    )
    temperature_offset_degc: float = fixed("offset of the thermometer", "degC", 0.0, "not in the datasheet")
    set_reset_offset_mgauss: Vec3 = drawn_by_axis(
        "Hoff: added after a set pulse, subtracted after a reset pulse", "mgauss", 120.0, "an assumption"
    )
    cross_axis_percent: Vec3 = drawn_by_axis(
        "coupling of X and Y, X and Z, Y and Z: fraction of the field along the other axis",
        "%",
        1.0,
        "an assumption",
    )
    odr_percent: float = rate_deviation()
    misalignment_deg: Vec3 = drawn_by_axis(
        "rotation of the sensor on its board about X, Y, Z", "deg", 1.0, "an assumption"
    )
    heating_percent: float = heating_share()

    @property
    def rate_factor(self) -> Fraction:
        return rate_factor(self.odr_percent)


FUNCTIONS = (
    Function("I2C and SPI, 3-wire and 4-wire, burst wrap 0x6D to 0x68", "datasheet 6; ST's driver for 4WSPI"),
    Function(
        "power-on, REBOOT, SOFT_RST",
        "AN5069 3 and 7",
        "the registers answer during REBOOT; after power-on (Board(cold_start=True)) they do not answer for 20 ms",
    ),
    Function(
        "modes, rates, turn-on and conversion times",
        "AN5069 3, Table 8",
        "a sample is the mean of the field over its conversion; the error of the rates is assumed to be as large "
        "as the LSM6DSL's; every part has the documented turn-on and conversion times",
    ),
    Function(
        "magnetic measurement",
        "datasheet Table 3",
        "offset, sensitivity, drift and noise are drawn from the datasheet's figures; cross-axis "
        "sensitivity, for which it has no figures, is drawn from 1 %",
        "stray fields across an axis, which reduce the range; offsets that remain after strong fields",
    ),
    Function(
        "low-pass filter (LPF)",
        "datasheet 8.6",
        "the mean of two measurements, with the documented bandwidth and noise",
    ),
    Function(
        "set and reset pulses, offset cancellation",
        "AN5069 8",
        "the count of 63 measurements between set pulses begins when the sensor leaves idle",
    ),
    Function("hard-iron offset registers", "AN5069 9"),
    Function(
        "data-ready, overrun, BDU, BLE",
        "AN5069 6.3 to 6.5",
        "a per-axis flag is cleared by its own high byte",
    ),
    Function("threshold interrupt and INT/DRDY pin", "AN5069 10, datasheet 8.8 to 8.11"),
    Function("thermometer", "datasheet 8.16"),
    Function("self-test", "AN5069 figure 4", "the field is inside the limits, and the same in every part"),
    Function("supply current", "datasheet and AN5069", "averages of the tables, no ramps"),
)
