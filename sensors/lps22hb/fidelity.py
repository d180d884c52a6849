"""How true the LPS22HB's functions are (datasheet DocID027083 Rev 6)."""

from __future__ import annotations

from sensors.fidelity import Function

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
        "accuracy over pressure and temperature is a straight line each; noise of settings other than the "
        "quietest is scaled by bandwidth; low current is taken as twice as noisy",
        "tolerance of the rates",
    ),
    Function(
        "one shot",
        "datasheet 9.6",
        "13 ms in low noise and 5 ms in low current, figures of the sister part LPS22HH",
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
