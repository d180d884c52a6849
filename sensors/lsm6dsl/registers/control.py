"""Control of the two sensors, of the bus and of the embedded functions; user offsets.

Datasheet 9.13 to 9.22 and 9.91 to 9.93.

Decision: CTRL9_XL resets to 0x00 as in Table 19. The road not taken is 0xE0: Table 75 of the same document
gives DEN_X, DEN_Y and DEN_Z a default of 1 and AN5040 4.8.5 agrees; the part can be built that way.
"""

from sensors.lsm6dsl.registers.codes import ODR
from sensors.register import Bits, Register


class CTRL1_XL(Register, addr=0x10):
    """Accelerometer rate, full scale and first filters."""

    ODR_XL = Bits(7, 4, doc=f"rate: {ODR}, 11: 1.6 Hz in low power, else 12.5 Hz")
    FS_XL = Bits(3, 2, doc="full scale: 0 2 g, 1 16 g, 2 4 g, 3 8 g (0.061, 0.488, 0.122, 0.244 mg/LSB)")
    LPF1_BW_SEL = Bits(1, doc="digital low-pass LPF1: 0 ODR/2, 1 ODR/4")
    BW0_XL = Bits(0, doc="analog filter at 1666 Hz and above: 0 1500 Hz, 1 400 Hz")


class CTRL2_G(Register, addr=0x11):
    """Gyroscope rate and full scale."""

    ODR_G = Bits(7, 4, doc=f"rate: {ODR}")
    FS_G = Bits(3, 2, doc="full scale: 0 250, 1 500, 2 1000, 3 2000 dps (8.75, 17.5, 35, 70 mdps/LSB)")
    FS_125 = Bits(1, doc="1: 125 dps (4.375 mdps/LSB) whatever FS_G says")


class CTRL3_C(Register, addr=0x12, reset=0x04):
    """Reset, bus and data format."""

    BOOT = Bits(7, doc="1: reload the trimming values, 15 ms; clears itself")
    BDU = Bits(6, doc="block data update: 1 freezes a pair of bytes until both are read")
    H_LACTIVE = Bits(5, doc="interrupt pins active: 0 high, 1 low")
    PP_OD = Bits(4, doc="interrupt pins: 0 push-pull, 1 open drain")
    SIM = Bits(3, doc="SPI: 0 4-wire, 1 3-wire")
    IF_INC = Bits(2, doc="1: the address advances after each byte of a burst")
    BLE = Bits(1, doc="byte order of output pairs: 0 low byte first, 1 high byte first")
    SW_RESET = Bits(0, doc="1: control registers to reset values, 50 us; clears itself")


class CTRL4_C(Register, addr=0x13):
    """Gyroscope sleep, data-enable input, interrupt and bus options."""

    DEN_XL_EN = Bits(7, doc="1: data enable also acts on the accelerometer")
    SLEEP = Bits(6, doc="1: gyroscope asleep: drive on, no data")
    INT2_on_INT1 = Bits(5, doc="1: INT2's signals are ORed onto INT1")
    DEN_DRDY_INT1 = Bits(4, doc="1: DEN data-ready on INT1")
    DRDY_MASK = Bits(3, doc="1: data-ready masked until the filters have settled")
    I2C_disable = Bits(2, doc="1: SPI only")
    LPF1_SEL_G = Bits(1, doc="1: gyroscope low-pass LPF1 on, bandwidth by FTYPE")


class CTRL5_C(Register, addr=0x14):
    """Self-tests, and the wrap of output bursts."""

    ROUNDING = Bits(
        7,
        5,
        doc="burst wraps over: 0 none, 1 XL, 2 G, 3 G+XL, 4 SH1-6, 5 XL+SH1-6, 6 G+XL+SH1-12, 7 G+XL+SH1-6",
    )
    DEN_LH = Bits(4, doc="data-enable input active: 0 low, 1 high")
    ST_G = Bits(3, 2, doc="gyroscope self-test: 0 off, 1 positive, 3 negative")
    ST_XL = Bits(1, 0, doc="accelerometer self-test: 0 off, 1 positive, 2 negative")


class CTRL6_C(Register, addr=0x15):
    """Data-enable mode, accelerometer power mode, weight of the user offsets."""

    TRIG_EN = Bits(7, doc="1: data enable by edge")
    LVL1_EN = Bits(6, doc="1: data enable by level; with TRIG_EN the level gates the FIFO")
    LVL2_EN = Bits(5, doc="1: with LVL1_EN, data enable by latched level")
    XL_HM_MODE = Bits(4, doc="accelerometer: 0 high performance, 1 low power or normal by rate")
    USR_OFF_W = Bits(3, doc="weight of X, Y, Z_OFS_USR: 0 2^-10 g/LSB, 1 2^-6 g/LSB")
    FTYPE = Bits(1, 0, doc="gyroscope LPF1 cutoff at 833 Hz: 0 245, 1 195, 2 155, 3 293 Hz")


class CTRL7_G(Register, addr=0x16):
    """Gyroscope power mode and high-pass filter."""

    G_HM_MODE = Bits(7, doc="gyroscope: 0 high performance, 1 low power or normal by rate")
    HP_EN_G = Bits(6, doc="1: high-pass filter on, in high performance only")
    HPM_G = Bits(5, 4, doc="high-pass cutoff: 0 16 mHz, 1 65 mHz, 2 260 mHz, 3 1.04 Hz")
    ROUNDING_STATUS = Bits(2, doc="1: burst wraps over the sources, STATUS_REG and FUNC_SRC1")


class CTRL8_XL(Register, addr=0x17):
    """Accelerometer composite filter."""

    LPF2_XL_EN = Bits(7, doc="1: second low-pass LPF2 on")
    HPCF_XL = Bits(6, 5, doc="cutoff: 0 ODR/50 (slope filter: ODR/4), 1 ODR/100, 2 ODR/9, 3 ODR/400")
    HP_REF_MODE = Bits(4, doc="1: high-pass subtracts the sample at which it was enabled")
    INPUT_COMPOSITE = Bits(3, doc="composite filter's input: 0 ODR/2, 1 ODR/4")
    HP_SLOPE_XL_EN = Bits(2, doc="1: output through slope or high-pass filter")
    LOW_PASS_ON_6D = Bits(0, doc="1: 6D orientation uses the LPF2 output")


class CTRL9_XL(Register, addr=0x18):
    """Data-enable stamp on the samples, and soft-iron correction."""

    DEN_X = Bits(7, doc="1: X carries the stamp in its LSB")
    DEN_Y = Bits(6, doc="1: Y carries the stamp in its LSB")
    DEN_Z = Bits(5, doc="1: Z carries the stamp in its LSB")
    DEN_XL_G = Bits(4, doc="stamped sensor: 0 gyroscope, 1 accelerometer")
    SOFT_EN = Bits(2, doc="1: soft-iron correction on, needs IRON_EN")


class CTRL10_C(Register, addr=0x19):
    """Embedded functions on and off."""

    WRIST_TILT_EN = Bits(7, doc="1: absolute wrist tilt on")
    TIMER_EN = Bits(5, doc="1: timestamp counter runs")
    PEDO_EN = Bits(4, doc="1: pedometer on")
    TILT_EN = Bits(3, doc="1: tilt on")
    FUNC_EN = Bits(2, doc="1: embedded functions and sensor hub on")
    PEDO_RST_STEP = Bits(1, doc="1: step counter held at 0; does not clear itself")
    SIGN_MOTION_EN = Bits(0, doc="1: significant motion on")


class X_OFS_USR(Register, addr=0x73):
    """User offset X, int8: added to the output, weight by USR_OFF_W."""

    X_OFS_USR = Bits(7, 0, doc="-127 to 127; 2^-10 or 2^-6 g/LSB")


class Y_OFS_USR(Register, addr=0x74):
    """User offset Y, int8: added to the output, weight by USR_OFF_W."""

    Y_OFS_USR = Bits(7, 0, doc="-127 to 127; 2^-10 or 2^-6 g/LSB")


class Z_OFS_USR(Register, addr=0x75):
    """User offset Z, int8: subtracted from the output, weight by USR_OFF_W."""

    Z_OFS_USR = Bits(7, 0, doc="-127 to 127; 2^-10 or 2^-6 g/LSB")
