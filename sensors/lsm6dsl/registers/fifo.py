"""FIFO: set-up, status and data (datasheet 9.4 to 9.8 and 9.53 to 9.58)."""

from sensors.lsm6dsl.registers.codes import DECIMATION, ODR
from sensors.register import Bits, Register


class FIFO_CTRL1(Register, addr=0x06):
    """FIFO watermark, low bits: one LSB is one 16-bit word."""

    FTH_7_0 = Bits(7, 0, doc="watermark bits 7 to 0")


class FIFO_CTRL2(Register, addr=0x07):
    """FIFO watermark, high bits, and the content of the fourth data set."""

    TIMER_PEDO_FIFO_EN = Bits(7, doc="1: timestamp and step count are the fourth data set")
    TIMER_PEDO_FIFO_DRDY = Bits(6, doc="a set is written at: 0 data-ready, 1 every step")
    FIFO_TEMP_EN = Bits(3, doc="1: temperature is the fourth data set")
    FTH_10_8 = Bits(2, 0, doc="watermark bits 10 to 8")


class FIFO_CTRL3(Register, addr=0x08):
    """FIFO decimation of gyroscope and accelerometer."""

    DEC_FIFO_GYRO = Bits(5, 3, doc=f"gyroscope: {DECIMATION}")
    DEC_FIFO_XL = Bits(2, 0, doc=f"accelerometer: {DECIMATION}")


class FIFO_CTRL4(Register, addr=0x09):
    """FIFO depth limit and decimation of the third and fourth data set."""

    STOP_ON_FTH = Bits(7, doc="1: depth limited to the watermark")
    ONLY_HIGH_DATA = Bits(6, doc="1: only the high bytes of accelerometer and gyroscope are stored")
    DEC_DS4_FIFO = Bits(5, 3, doc=f"fourth set: {DECIMATION}")
    DEC_DS3_FIFO = Bits(2, 0, doc=f"third set: {DECIMATION}")


class FIFO_CTRL5(Register, addr=0x0A):
    """FIFO rate and mode."""

    ODR_FIFO = Bits(6, 3, doc=ODR)
    FIFO_MODE = Bits(2, 0, doc="0 bypass, 1 FIFO, 3 continuous to FIFO, 4 bypass to continuous, 6 continuous")


class FIFO_STATUS1(Register, addr=0x3A, access="r"):
    """Unread FIFO words, low bits."""

    DIFF_FIFO_7_0 = Bits(7, 0, doc="unread 16-bit words, bits 7 to 0")


class FIFO_STATUS2(Register, addr=0x3B, access="r", reset=0x10):
    """FIFO flags, and unread words, high bits."""

    WaterM = Bits(7, doc="1: watermark reached")
    OVER_RUN = Bits(6, doc="1: full, and words were overwritten")
    FIFO_FULL_SMART = Bits(5, doc="1: the next data set fills the FIFO")
    FIFO_EMPTY = Bits(4, doc="1: empty")
    DIFF_FIFO_10_8 = Bits(2, 0, doc="unread 16-bit words, bits 10 to 8")


class FIFO_STATUS3(Register, addr=0x3C, access="r"):
    """Place of the next FIFO word in the repeating pattern, low bits."""

    FIFO_PATTERN_7_0 = Bits(7, 0, doc="word index in the pattern, bits 7 to 0")


class FIFO_STATUS4(Register, addr=0x3D, access="r"):
    """Place of the next FIFO word in the repeating pattern, high bits."""

    FIFO_PATTERN_9_8 = Bits(1, 0, doc="word index in the pattern, bits 9 to 8")


class FIFO_DATA_OUT(
    Register,
    addr=0x3E,
    size=2,
    access="r",
    names=("FIFO_DATA_OUT_L", "FIFO_DATA_OUT_H"),
):
    """Next FIFO word; a burst alternates between its two bytes."""
