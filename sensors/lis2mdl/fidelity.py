"""How true the LIS2MDL's functions are (datasheet DocID030621 Rev 3, AN5069 Rev 2)."""

from __future__ import annotations

from sensors.fidelity import Function

FUNCTIONS = (
    Function("I2C and SPI, 3-wire and 4-wire, burst wrap 0x6D to 0x68", "datasheet 6; ST's driver for 4WSPI"),
    Function(
        "power-on, REBOOT, SOFT_RST",
        "AN5069 3 and 7",
        "the registers answer during REBOOT, and after power-on (Board(cold_start=True)) not for 20 ms",
    ),
    Function("modes, rates, turn-on and conversion times", "AN5069 3, Table 8"),
    Function(
        "magnetic measurement",
        "datasheet Table 3",
        "offset, sensitivity, drift and noise are drawn from the datasheet's limits; cross-axis figures, "
        "which it does not give, from 1 %",
        "stray fields across an axis, which cut the range; offsets left behind by strong fields",
    ),
    Function(
        "low-pass filter (LPF)",
        "datasheet 8.6",
        "the mean of two measurements, whose bandwidth and noise are the documented ones",
    ),
    Function(
        "set and reset pulses, offset cancellation",
        "AN5069 8",
        "the 63 measurements between set pulses are counted from leaving idle",
    ),
    Function("hard-iron offset registers", "AN5069 9"),
    Function(
        "data-ready, overrun, BDU, BLE",
        "AN5069 6.3 to 6.5",
        "a per-axis flag is cleared by its own high byte",
    ),
    Function("threshold interrupt and INT/DRDY pin", "AN5069 10, datasheet 8.8 to 8.11"),
    Function("thermometer", "datasheet 8.16"),
    Function("self-test", "AN5069 figure 4", "one field inside the limits, the same in every part"),
    Function("supply current", "datasheet and AN5069", "averages of the tables, no ramps"),
)
