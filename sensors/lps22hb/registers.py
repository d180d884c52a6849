"""Registers of the LPS22HB (datasheet Table 16, section 9); undocumented reset values are 0.

Decision: CLOCK_TREE_CONFIGURATION is declared as known and not modelled, so that a note names it. This name
occurs only in ST's board driver.
"""

from fcu_emulator.sensors.register import Bits, Register


class INTERRUPT_CFG(Register, addr=0x0B):
    """Differential pressure interrupt, reference capture."""

    AUTORIFP = Bits(7, doc="1: the next pressure becomes REF_P for the interrupt only; clears itself")
    RESET_ARP = Bits(6, doc="1: end AUTORIFP; clears itself")
    AUTOZERO = Bits(5, doc="1: the next pressure becomes REF_P, subtracted from the output; clears itself")
    RESET_AZ = Bits(4, doc="1: end AUTOZERO and clear REF_P; clears itself")
    DIFF_EN = Bits(3, doc="1: comparison on")
    LIR = Bits(2, doc="interrupt: 0 follows the comparison, 1 latched until INT_SOURCE is read")
    PLE = Bits(1, doc="1: interrupt below the negative threshold")
    PHE = Bits(0, doc="1: interrupt above the positive threshold")


class THS_P(Register, addr=0x0C, size=2, names=("THS_P_L", "THS_P_H")):
    """Pressure threshold, unsigned: 1/16 hPa per LSB."""


class WHO_AM_I(Register, addr=0x0F, access="r", reset=0xB1):
    """Identity of the sensor: always 0xB1."""

    WHO_AM_I = Bits(7, 0, doc="0xB1, the same in LPS33HW and LPS35HW")


class CTRL_REG1(Register, addr=0x10):
    """Rate, low-pass filter and data update."""

    ODR = Bits(6, 4, doc="rate: 0 off or one shot, 1 1, 2 10, 3 25, 4 50, 5 75 Hz")
    EN_LPFP = Bits(3, doc="pressure low-pass: 0 off (ODR/2), 1 on")
    LPFP_CFG = Bits(2, doc="bandwidth with EN_LPFP: 0 ODR/9, 1 ODR/20")
    BDU = Bits(1, doc="block data update: 1 freezes the output from the first byte read until PRESS_OUT_H is")
    SIM = Bits(0, doc="SPI: 0 4-wire, 1 3-wire")


class CTRL_REG2(Register, addr=0x11, reset=0x10):
    """Reset, one shot, FIFO and bus."""

    BOOT = Bits(7, doc="1: reload the trimming values; clears itself")
    FIFO_EN = Bits(6, doc="1: FIFO on")
    STOP_ON_FTH = Bits(5, doc="1: FIFO depth limited to WTM + 1 levels")
    IF_ADD_INC = Bits(4, doc="1: the address advances after each byte of a burst")
    I2C_DIS = Bits(3, doc="1: SPI only")
    SWRESET = Bits(2, doc="1: reset the control registers; clears itself")
    ONE_SHOT = Bits(0, doc="1: one pressure and temperature sample, only with ODR = 0; clears itself")


class CTRL_REG3(Register, addr=0x12):
    """INT_DRDY pin: shape and signal."""

    INT_H_L = Bits(7, doc="pin active: 0 high, 1 low")
    PP_OD = Bits(6, doc="pin: 0 push-pull, 1 open drain")
    F_FSS5 = Bits(5, doc="1: FIFO full, 32 levels")
    F_FTH = Bits(4, doc="1: FIFO watermark reached")
    F_OVR = Bits(3, doc="1: FIFO overrun")
    DRDY = Bits(2, doc="1: data-ready")
    INT_S = Bits(1, 0, doc="pin shows: 0 the signals above, 1 pressure high, 2 pressure low, 3 either")


class FIFO_CTRL(Register, addr=0x14):
    """FIFO mode and watermark."""

    F_MODE = Bits(
        7,
        5,
        doc="0 bypass, 1 FIFO, 2 stream, 6 dynamic stream; "
        "on an interrupt: 3 stream to FIFO, 4 bypass to stream, 7 bypass to FIFO",
    )
    WTM = Bits(4, 0, doc="watermark, levels")


class REF_P(Register, addr=0x15, size=3, names=("REF_P_XL", "REF_P_L", "REF_P_H")):
    """Reference pressure, 24-bit two's complement: 4096 LSB/hPa."""


class RPDS(Register, addr=0x18, size=2, names=("RPDS_L", "RPDS_H")):
    """Pressure offset, int16: 1/16 hPa per LSB (inferred from AN4450), subtracted from the output."""


class RES_CONF(Register, addr=0x1A):
    """Power mode; firmware must change it in power-down only."""

    LC_EN = Bits(0, doc="0 low noise, 1 low current")


class INT_SOURCE(Register, addr=0x25, access="r"):
    """Boot in progress, and pressure interrupts; a read clears latched interrupts."""

    BOOT_STATUS = Bits(7, doc="1: boot in progress")
    IA = Bits(2, doc="any pressure interrupt")
    PL = Bits(1, doc="pressure below the negative threshold")
    PH = Bits(0, doc="pressure above the positive threshold")


class FIFO_STATUS(Register, addr=0x26, access="r"):
    """FIFO flags and fill level."""

    FTH_FIFO = Bits(7, doc="1: watermark reached")
    OVR = Bits(6, doc="1: full, and a sample was overwritten")
    FSS = Bits(5, 0, doc="unread levels, 0 to 32")


class STATUS(Register, addr=0x27, access="r"):
    """New data and overrun."""

    T_OR = Bits(5, doc="1: temperature overwritten unread")
    P_OR = Bits(4, doc="1: pressure overwritten unread")
    T_DA = Bits(1, doc="1: new temperature; reading TEMP_OUT_H clears it")
    P_DA = Bits(0, doc="1: new pressure; reading PRESS_OUT_H clears it")


class PRESS_OUT(
    Register, addr=0x28, size=3, access="r", names=("PRESS_OUT_XL", "PRESS_OUT_L", "PRESS_OUT_H")
):
    """Pressure, 24-bit two's complement: 4096 LSB/hPa."""


class TEMP_OUT(Register, addr=0x2B, size=2, access="r", names=("TEMP_OUT_L", "TEMP_OUT_H")):
    """Temperature, int16: 100 LSB/degC, 0 is 0 degC."""


class LPFP_RES(Register, addr=0x33, access="r"):
    """A read restarts the pressure low-pass filter; the value is undefined."""


class CLOCK_TREE_CONFIGURATION(Register, addr=0x43, reset=0x20, modelled=False):
    """Undocumented register; only ST's board driver names it."""

    CTE = Bits(5, doc="clock tree; meaning not published")
