"""New data: status and output registers of the two sensors and their thermometer (datasheet 9.27 to 9.40)."""

from sensors.register import Bits, Register


class STATUS_REG(Register, addr=0x1E, access="r"):
    """New data, one bit per sensor."""

    TDA = Bits(2, doc="1: new temperature; reading OUT_TEMP_H clears it")
    GDA = Bits(1, doc="1: new angular rate; reading any gyroscope high byte clears it")
    XLDA = Bits(0, doc="1: new acceleration; reading any accelerometer high byte clears it")


class OUT_TEMP(Register, addr=0x20, size=2, access="r", names=("OUT_TEMP_L", "OUT_TEMP_H")):
    """Temperature, int16: 256 LSB/degC, 0 is 25 degC."""


class OUT_G(
    Register,
    addr=0x22,
    size=6,
    access="r",
    names=("OUTX_L_G", "OUTX_H_G", "OUTY_L_G", "OUTY_H_G", "OUTZ_L_G", "OUTZ_H_G"),
):
    """Angular rate X, Y, Z, int16 each, LSB by FS_G: 4.375 to 70 mdps."""


class OUT_XL(
    Register,
    addr=0x28,
    size=6,
    access="r",
    names=("OUTX_L_XL", "OUTX_H_XL", "OUTY_L_XL", "OUTY_H_XL", "OUTZ_L_XL", "OUTZ_H_XL"),
):
    """Acceleration X, Y, Z, int16 each, LSB by FS_XL: 0.061 to 0.488 mg."""
