"""Registers of the LIS2MDL (datasheet Table 22, section 8); undocumented reset values are 0.

Decision: bit 2 of CFG_REG_C is 4WSPI, as ST's driver and AN5069 Rev 4 define it. With the datasheet's "must be 0",
working 4-wire firmware would read nothing.
"""

from fcu_emulator.sensors.register import Bits, Register


class OFFSET_X_REG(Register, addr=0x45, size=2, names=("OFFSET_X_REG_L", "OFFSET_X_REG_H")):
    """Hard-iron offset X, int16: 1.5 mgauss/LSB, subtracted from the output."""


class OFFSET_Y_REG(Register, addr=0x47, size=2, names=("OFFSET_Y_REG_L", "OFFSET_Y_REG_H")):
    """Hard-iron offset Y, int16: 1.5 mgauss/LSB, subtracted from the output."""


class OFFSET_Z_REG(Register, addr=0x49, size=2, names=("OFFSET_Z_REG_L", "OFFSET_Z_REG_H")):
    """Hard-iron offset Z, int16: 1.5 mgauss/LSB, subtracted from the output."""


class WHO_AM_I(Register, addr=0x4F, access="r", reset=0x40):
    """Identity of the sensor: always 0x40."""

    WHO_AM_I = Bits(7, 0, doc="0x40")


class CFG_REG_A(Register, addr=0x60, reset=0x03):
    """Mode, rate, power and reset."""

    COMP_TEMP_EN = Bits(7, doc="1: temperature compensation on; must be 1 for correct operation")
    REBOOT = Bits(6, doc="1: reload the trimming values, 20 ms; clears itself")
    SOFT_RST = Bits(5, doc="1: reset the configuration registers, 5 us; clears itself")
    LP = Bits(4, doc="0 high resolution, 1 low power")
    ODR = Bits(3, 2, doc="rate: 0 10, 1 20, 2 50, 3 100 Hz")
    MD = Bits(1, 0, doc="mode: 0 continuous, 1 single, 2 and 3 idle")


class CFG_REG_B(Register, addr=0x61):
    """Low-pass filter and offset cancellation."""

    OFF_CANC_ONE_SHOT = Bits(4, doc="1: offset cancellation in single mode, with OFF_CANC")
    INT_on_DataOFF = Bits(3, doc="threshold compared: 0 before, 1 after the hard-iron offset is subtracted")
    Set_FREQ = Bits(2, doc="set pulse, OFF_CANC = 0: 0 every 63 samples, 1 when leaving idle")
    OFF_CANC = Bits(1, doc="1: offset cancellation on")
    LPF = Bits(0, doc="bandwidth: 0 ODR/2, 1 ODR/4")


class CFG_REG_C(Register, addr=0x62):
    """Bus, data format, self-test and pin."""

    INT_on_PIN = Bits(6, doc="1: interrupt on the INT/DRDY pin")
    I2C_DIS = Bits(5, doc="1: SPI only")
    BDU = Bits(4, doc="block data update: 1 freezes a pair of bytes until both are read")
    BLE = Bits(3, doc="byte order of output pairs: 0 low byte first, 1 high byte first")
    FOURWSPI = Bits(2, name="4WSPI", doc="SPI: 0 3-wire, 1 4-wire with SDO on INT/DRDY")
    Self_test = Bits(1, doc="1: self-test field on, 15 to 500 mgauss on each axis")
    DRDY_on_PIN = Bits(0, doc="1: data-ready on the INT/DRDY pin")


class INT_CRTL_REG(Register, addr=0x63, reset=0xE0):
    """Threshold interrupt: axes, polarity, latch, enable (spelt as in the datasheet)."""

    XIEN = Bits(7, doc="1: X compared")
    YIEN = Bits(6, doc="1: Y compared")
    ZIEN = Bits(5, doc="1: Z compared")
    IEA = Bits(2, doc="active level of INT: 0 low, 1 high")
    IEL = Bits(1, doc="0 follows the comparison, 1 latched until INT_SOURCE_REG is read")
    IEN = Bits(0, doc="1: interrupt on")


class INT_SOURCE_REG(Register, addr=0x64, access="r"):
    """Sources of the threshold interrupt; a read clears a latched interrupt."""

    P_TH_S_X = Bits(7, doc="X over the positive threshold")
    P_TH_S_Y = Bits(6, doc="Y over the positive threshold")
    P_TH_S_Z = Bits(5, doc="Z over the positive threshold")
    N_TH_S_X = Bits(4, doc="X under the negative threshold")
    N_TH_S_Y = Bits(3, doc="Y under the negative threshold")
    N_TH_S_Z = Bits(2, doc="Z under the negative threshold")
    MROI = Bits(1, doc="measurement range overflow")
    INT = Bits(0, doc="interrupt, level by IEA")


class INT_THS(Register, addr=0x65, size=2, names=("INT_THS_L_REG", "INT_THS_H_REG")):
    """Interrupt threshold, unsigned: 1.5 mgauss/LSB."""


class STATUS_REG(Register, addr=0x67, access="r"):
    """New data and overrun, by axis and together."""

    Zyxor = Bits(7, doc="1: a sample of any axis was overwritten unread")
    zor = Bits(6, doc="1: Z overwritten unread")
    yor = Bits(5, doc="1: Y overwritten unread")
    xor = Bits(4, doc="1: X overwritten unread")
    Zyxda = Bits(3, doc="1: new X, Y, Z; reading any high byte clears it")
    zda = Bits(2, doc="1: new Z")
    yda = Bits(1, doc="1: new Y")
    xda = Bits(0, doc="1: new X")


class OUT(
    Register,
    addr=0x68,
    size=6,
    access="r",
    names=("OUTX_L_REG", "OUTX_H_REG", "OUTY_L_REG", "OUTY_H_REG", "OUTZ_L_REG", "OUTZ_H_REG"),
):
    """Magnetic field X, Y, Z, int16 each: 1.5 mgauss/LSB."""


class TEMP_OUT(Register, addr=0x6E, size=2, access="r", names=("TEMP_OUT_L_REG", "TEMP_OUT_H_REG")):
    """Temperature, int16: 8 LSB/degC, 0 is 25 degC."""
