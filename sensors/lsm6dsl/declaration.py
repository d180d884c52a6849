"""Declarations of the LSM6DSL: signals, bus, deviations, functions."""

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
    strength,
)

SIGNALS = (
    Quantity("acceleration_g", "g", 3, "specific force", Output(0x28), one_row=True),
    Quantity("angular_rate_dps", "dps", 3, "angular rate", Output(0x22), one_row=True),
    Quantity("temperature_degc", "degC", 1, "temperature of the part", Output(0x20, zero=25.0), one_row=True),
)

BUS = Bus(i2c_addresses=(0x6A, 0x6B), spi_wires=4, source="datasheet 6")

_TABLE_3, _TABLE_4 = "datasheet Table 3", "datasheet Table 4"
_OFFSET = "datasheet Table 3; 4.6: a standard deviation"
_RANGE = "datasheet Table 3; 4.6: the range of many parts"
_SISTER = "datasheet of the ISM330DHCX"


@dataclass(frozen=True)
class LSM6DSLErrors(PartErrors):
    """Deviations of an LSM6DSL, axes in the sensor's frame.

    Values in Table 3 are typical. By section 4.6, the tolerance of the zero-g offset is a standard deviation;
    the tolerance of the sensitivity is a range.
    The figures of the gyroscope's bias instability and of the cross-axis sensitivity are those of the
    ISM330DHCX. No source states the accelerometer's bias instability, so it is assumed.
    """

    PART: ClassVar[str] = "LSM6DSL"

    acc_bias_mg: Vec3 = drawn_by_axis("zero-g offset", "mg", 40.0, _OFFSET, "sigma")
    acc_scale_percent: Vec3 = drawn_by_axis("error of the sensitivity", "%", 1.0, _RANGE)
    acc_bias_drift_mg_per_degc: Vec3 = drawn_by_axis(
        "drift of the offset", "mg/degC", 0.1, _TABLE_3, "typical"
    )
    acc_scale_drift_percent_per_degc: float = drawn(
        "drift of the sensitivity", "%/degC", 0.01, _TABLE_3, "typical"
    )
    acc_noise_ug_rthz: float = noise(
        "density at 2 and 4 g; 8 and 16 g scale as in Table 3", "ug/sqrt(Hz)", 80.0, _TABLE_3
    )
    gyro_bias_dps: Vec3 = drawn_by_axis("zero-rate level", "dps", 3.0, _TABLE_3, "typical")
    gyro_scale_percent: Vec3 = drawn_by_axis("error of the sensitivity", "%", 1.0, _RANGE)
    gyro_bias_drift_dps_per_degc: Vec3 = drawn_by_axis(
        "drift of the zero-rate level", "dps/degC", 0.015, _TABLE_3, "typical"
    )
    gyro_scale_drift_percent_per_degc: float = drawn(
        "drift of the sensitivity", "%/degC", 0.007, _TABLE_3, "typical"
    )
    gyro_noise_mdps_rthz: float = noise("density", "mdps/sqrt(Hz)", 4.0, _TABLE_3)
    temperature_offset_degc: float = drawn("offset of the thermometer", "degC", 15.0, _TABLE_4)
    gyro_turn_on_ms: float = fixed("start of the gyroscope's drive", "ms", 35.0, _TABLE_4, (0.0, 1000.0))
    odr_percent: float = rate_deviation()
    misalignment_deg: Vec3 = drawn_by_axis(
        "rotation of the sensor on its board about X, Y, Z", "deg", 1.0, "an assumption"
    )
    acc_bias_instability_ug: float = strength("bias instability", "ug", 40.0, "an assumption")
    gyro_bias_instability_dph: float = strength("bias instability", "deg/h", 3.0, _SISTER)
    acc_cross_axis_percent: Vec3 = drawn_by_axis(
        "coupling of X and Y, X and Z, Y and Z: fraction of the acceleration along the other axis",
        "%",
        0.5,
        _SISTER,
        "typical",
    )
    gyro_cross_axis_percent: Vec3 = drawn_by_axis(
        "coupling of X and Y, X and Z, Y and Z: fraction of the rate about the other axis",
        "%",
        0.5,
        _SISTER,
        "typical",
    )
    heating_percent: float = heating_share()

    @property
    def rate_factor(self) -> Fraction:
        return rate_factor(self.odr_percent)


FUNCTIONS = (
    Function("I2C and SPI, 3-wire and 4-wire, IF_INC, ROUNDING", "datasheet 6, AN5040 4.7"),
    Function(
        "BOOT, SW_RESET, register banks",
        "AN5040 5.7, datasheet Table 22",
        "SW_RESET acts at once, its bit reads 1 for 50 us, and it clears FIFO, counters and banks",
    ),
    Function(
        "accelerometer: rates, modes, full scales, user offset",
        "AN5040 3 and 4.6",
        "a changed configuration acts from the next sample on; the error of the rates was chosen "
        "from measured parts, and does not depend on temperature",
        "disturbances of the samples that drivers discard after turn-on (AN5040 Table 13)",
    ),
    Function(
        "accelerometer: filter chain",
        "AN5040 3.7",
        "the signal is converted at 6664 Hz, and clipped there at full scale; the analog stage and the later filters "
        "are second-order Butterworth filters at the documented cut-offs, but LPF1 at ODR/2 has the fourth order; "
        "orders, shapes and the converter's rate are not documented",
    ),
    Function(
        "gyroscope: rates, modes, full scales, sleep",
        "AN5040 3.8",
        "clips at 16 bits, not at the nominal full scale",
        "sensitivity to acceleration: the datasheet has no figures",
    ),
    Function(
        "gyroscope: filter chain",
        "AN5040 3.8, Table 19",
        "converted at 6664 Hz, a fourth-order low-pass at ODR/2 before decimation; then one second-order "
        "Butterworth low-pass at the overall cut-off; the rest of the documented phase at 20 Hz is a delay",
    ),
    Function(
        "gyroscope: start",
        "datasheet Table 4, AN5040 Tables 14 to 16",
        "35 ms, or gyro_turn_on_ms; the filters start from rest and settle within a few samples, even at "
        "1666 Hz and above, for which AN5040 gives 81 ms",
    ),
    Function("thermometer", "datasheet Table 4, AN5040 9", "reading OUT_TEMP_H clears TDA"),
    Function(
        "errors and noise",
        "datasheet Table 3",
        "typical parts are drawn from the figures below; for bias instability and cross-axis "
        "sensitivity, the datasheet has no figures, so that the figures of the ISM330DHCX are used",
        "non-linearity, for which the datasheet has no figures",
    ),
    Function(
        "self-test", "AN5040 figures 36 and 37", "the shift is inside the limits, and the same in every part"
    ),
    Function(
        "data-ready, DRDY_MASK, BDU, BLE",
        "AN5040 3.9 and 4.3 to 4.5",
        "the samples that drivers must discard are masked; if a table gives a range, the larger number counts",
    ),
    Function("pins INT1 and INT2", "AN5040 4.2", "sources routed to INT2 are lost while it is an input"),
    Function(
        "data enable (DEN): edge, level, latched, FIFO",
        "AN5040 4.8",
        "the stamp is in the output registers, too, not only in the FIFO",
    ),
    Function(
        "free fall, wake-up, 6D and 4D, tap, activity",
        "AN5040 5",
        "these functions receive integer counts, saturated like the output; the high-pass of SLOPE_FDS has one pole",
    ),
    Function(
        "pedometer, significant motion",
        "AN5040 6.1 and 6.2",
        "only threshold and debouncing are published, not the algorithm; a step is a peak of the magnitude with a "
        "swing of the threshold, so that gentle steps are missed: at the reset threshold of 512 mg, 59 of the "
        "177 steps of a published walk (50 Hz, lower back) were counted",
    ),
    Function("tilt, absolute wrist tilt", "AN5040 6.3 and 6.4"),
    Function(
        "timestamp",
        "AN5040 6.5",
        "the timer runs with TIMER_EN alone; its error equals that of the rates: one oscillator, as in the LSM6DSO",
    ),
    Function(
        "sensor hub, hard- and soft-iron correction",
        "AN5040 7",
        "results rounded to the nearest LSB and limited to 16 bits",
    ),
    Function(
        "FIFO: five modes, decimation, pattern, thresholds",
        "AN5040 8",
        "2048 words; FIFO mode stops at FIFO_FULL_SMART",
    ),
    Function(
        "supply current",
        "datasheet Tables 3 and 4",
        "the current of both sensors in low power is assumed to be the sum of their currents",
    ),
)
