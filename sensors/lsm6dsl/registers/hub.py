"""Sensor hub: its master, what it has read, and the external magnetometer (datasheet 9.23, 9.41 on)."""

from sensors.register import Bits, Register


class MASTER_CONFIG(Register, addr=0x1A):
    """Sensor hub: I2C master, its trigger and its pins."""

    DRDY_ON_INT1 = Bits(7, doc="1: hub data-ready on INT1")
    DATA_VALID_SEL_FIFO = Bits(6, doc="FIFO written at: 0 data-ready or step, 1 end of the hub's reads")
    START_CONFIG = Bits(4, doc="hub trigger: 0 accelerometer data-ready, 1 INT2 pin")
    PULL_UP_EN = Bits(3, doc="1: pull-ups of the auxiliary bus on")
    PASS_THROUGH_MODE = Bits(2, doc="1: main and auxiliary I2C connected")
    IRON_EN = Bits(1, doc="1: hard-iron correction on")
    MASTER_ON = Bits(0, doc="1: hub master on")


class SENSORHUB(
    Register,
    addr=0x2E,
    size=12,
    access="r",
    names=tuple(f"SENSORHUB{byte}_REG" for byte in range(1, 13)),
):
    """Bytes 1 to 12 read by the sensor hub."""


class SENSORHUB_EXT(
    Register,
    addr=0x4D,
    size=6,
    access="r",
    names=tuple(f"SENSORHUB{byte}_REG" for byte in range(13, 19)),
):
    """Bytes 13 to 18 read by the sensor hub."""


class OUT_MAG_RAW(
    Register,
    addr=0x66,
    size=6,
    access="r",
    names=tuple(f"OUT_MAG_RAW_{axis}_{half}" for axis in "XYZ" for half in "LH"),
):
    """External magnetometer X, Y, Z before correction, int16 each."""
