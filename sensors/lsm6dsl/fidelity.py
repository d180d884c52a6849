"""How true the LSM6DSL's functions are (datasheet DocID028475 Rev 7, AN5040 Rev 3)."""

from __future__ import annotations

from sensors.fidelity import Function

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
        "a changed configuration acts from the next sample on; the rates are exact unless odr_percent says "
        "otherwise (no document gives a tolerance)",
        "what disturbs the samples that drivers discard after turn-on (AN5040 Table 13)",
    ),
    Function(
        "accelerometer: filter chain",
        "AN5040 3.7",
        "second-order Butterworth filters at the output data rate with the documented cut-offs; order and "
        "shape are not documented",
    ),
    Function(
        "gyroscope: rates, modes, full scales, sleep",
        "AN5040 3.8",
        "clips at 16 bits, not at the nominal full scale",
        "bias instability, sensitivity to acceleration: the datasheet has no figures",
    ),
    Function(
        "gyroscope: filter chain",
        "AN5040 3.8, Table 19",
        "one second-order Butterworth low-pass at the overall cut-off; the rest of the documented phase at "
        "20 Hz is a plain delay",
    ),
    Function(
        "gyroscope: start",
        "datasheet Table 4, AN5040 Tables 14 to 16",
        "35 ms, or gyro_turn_on_ms; the filters start from rest and settle within a few samples, also from "
        "1666 Hz on where AN5040 gives 81 ms",
    ),
    Function("thermometer", "datasheet Table 4, AN5040 9", "reading OUT_TEMP_H clears TDA"),
    Function(
        "errors and noise",
        "datasheet Table 3",
        "typical parts are drawn with a third of a limit as standard deviation",
        "cross-axis sensitivity and non-linearity, for which the datasheet has no figures",
    ),
    Function("self-test", "AN5040 figures 36 and 37", "one shift inside the limits, the same in every part"),
    Function(
        "data-ready, DRDY_MASK, BDU, BLE",
        "AN5040 3.9 and 4.3 to 4.5",
        "masked samples are those to be discarded; where a table gives a range, the larger number",
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
        "they see whole counts, saturated as the output is; the high-pass of SLOPE_FDS has one pole",
    ),
    Function(
        "pedometer, significant motion",
        "AN5040 6.1 and 6.2",
        "the algorithm is not published; a step is a peak of the magnitude with a swing of the threshold",
    ),
    Function("tilt, absolute wrist tilt", "AN5040 6.3 and 6.4"),
    Function("timestamp", "AN5040 6.5", "runs with TIMER_EN alone"),
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
        "both sensors together in low power are taken as the sum of the two",
    ),
)
