"""Main register bank of the LSM6DSL (datasheet Table 19, section 9).

Undocumented reset values are 0, or 0x10 for an empty FIFO.

Decision: CTRL9_XL resets to 0x00 as in Table 19. Table 75 and AN5040 4.8.5 give 0xE0, an option of the constructor.

Decision: D4D_EN = 1 enables 4D as in AN5040 5.4.2; the datasheet's sentence inverts the polarity.
"""

from __future__ import annotations

from fcu_emulator.sensors.register import Bits, Register

_ODR = "0 off, 1 to 10: 12.5, 26, 52, 104, 208, 416, 833, 1666, 3332, 6664 Hz"
_DECIMATION = "0 not in FIFO, 1 every sample, 2 1/2, 3 1/3, 4 1/4, 5 1/8, 6 1/16, 7 1/32"


class FUNC_CFG_ACCESS(Register, addr=0x01):
    """Bank at 0x02 up: 0x00 main, 0x80 bank A, 0xA0 bank B (0x20 alone is forbidden)."""

    FUNC_CFG_EN = Bits(7, doc="1: embedded-function registers, bank A unless FUNC_CFG_EN_B")
    FUNC_CFG_EN_B = Bits(5, doc="1: bank B; only together with FUNC_CFG_EN")


class SENSOR_SYNC_TIME_FRAME(Register, addr=0x04, modelled=False):
    """Sensor synchronisation: time frame."""

    TPH = Bits(3, 0, doc="500 ms per LSB, 0 to 10; 0 synchronisation off")


class SENSOR_SYNC_RES_RATIO(Register, addr=0x05, modelled=False):
    """Sensor synchronisation: resolution ratio."""

    RR = Bits(1, 0, doc="0 2^-11, 1 2^-12, 2 2^-13, 3 2^-14")


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

    DEC_FIFO_GYRO = Bits(5, 3, doc=f"gyroscope: {_DECIMATION}")
    DEC_FIFO_XL = Bits(2, 0, doc=f"accelerometer: {_DECIMATION}")


class FIFO_CTRL4(Register, addr=0x09):
    """FIFO depth limit and decimation of the third and fourth data set."""

    STOP_ON_FTH = Bits(7, doc="1: depth limited to the watermark")
    ONLY_HIGH_DATA = Bits(6, doc="1: only the high bytes of accelerometer and gyroscope are stored")
    DEC_DS4_FIFO = Bits(5, 3, doc=f"fourth set: {_DECIMATION}")
    DEC_DS3_FIFO = Bits(2, 0, doc=f"third set: {_DECIMATION}")


class FIFO_CTRL5(Register, addr=0x0A):
    """FIFO rate and mode."""

    ODR_FIFO = Bits(6, 3, doc=_ODR)
    FIFO_MODE = Bits(2, 0, doc="0 bypass, 1 FIFO, 3 continuous to FIFO, 4 bypass to continuous, 6 continuous")


class DRDY_PULSE_CFG_G(Register, addr=0x0B):
    """Shape of the data-ready pins, and wrist tilt on INT2."""

    DRDY_PULSED = Bits(7, doc="data-ready pins: 0 latched, 1 pulses of 75 us")
    INT2_WRIST_TILT = Bits(0, doc="1: wrist tilt on INT2")


class INT1_CTRL(Register, addr=0x0D):
    """Data and FIFO signals on the INT1 pin."""

    INT1_STEP_DETECTOR = Bits(7, doc="1: step detected")
    INT1_SIGN_MOT = Bits(6, doc="1: significant motion")
    INT1_FULL_FLAG = Bits(5, doc="1: FIFO full")
    INT1_FIFO_OVR = Bits(4, doc="1: FIFO overrun")
    INT1_FTH = Bits(3, doc="1: FIFO watermark reached")
    INT1_BOOT = Bits(2, doc="1: boot in progress")
    INT1_DRDY_G = Bits(1, doc="1: gyroscope data-ready")
    INT1_DRDY_XL = Bits(0, doc="1: accelerometer data-ready")


class INT2_CTRL(Register, addr=0x0E):
    """Data and FIFO signals on the INT2 pin."""

    INT2_STEP_DELTA = Bits(7, doc="1: steps detected within the delta time")
    INT2_STEP_COUNT_OV = Bits(6, doc="1: step counter overflow")
    INT2_FULL_FLAG = Bits(5, doc="1: FIFO full")
    INT2_FIFO_OVR = Bits(4, doc="1: FIFO overrun")
    INT2_FTH = Bits(3, doc="1: FIFO watermark reached")
    INT2_DRDY_TEMP = Bits(2, doc="1: temperature data-ready")
    INT2_DRDY_G = Bits(1, doc="1: gyroscope data-ready")
    INT2_DRDY_XL = Bits(0, doc="1: accelerometer data-ready")


class WHO_AM_I(Register, addr=0x0F, access="r", reset=0x6A):
    """Identity of the sensor: always 0x6A."""

    WHO_AM_I = Bits(7, 0, doc="0x6A, the same in LSM6DSM and LSM6DS3TR-C")


class CTRL1_XL(Register, addr=0x10):
    """Accelerometer rate, full scale and first filters."""

    ODR_XL = Bits(7, 4, doc=f"rate: {_ODR}, 11: 1.6 Hz in low power, else 12.5 Hz")
    FS_XL = Bits(3, 2, doc="full scale: 0 2 g, 1 16 g, 2 4 g, 3 8 g (0.061, 0.488, 0.122, 0.244 mg/LSB)")
    LPF1_BW_SEL = Bits(1, doc="digital low-pass LPF1: 0 ODR/2, 1 ODR/4")
    BW0_XL = Bits(0, doc="analog filter at 1666 Hz and above: 0 1500 Hz, 1 400 Hz")


class CTRL2_G(Register, addr=0x11):
    """Gyroscope rate and full scale."""

    ODR_G = Bits(7, 4, doc=f"rate: {_ODR}")
    FS_G = Bits(3, 2, doc="full scale: 0 250, 1 500, 2 1000, 3 2000 dps (8.75, 17.5, 35, 70 mdps/LSB)")
    FS_125 = Bits(1, doc="1: 125 dps (4.375 mdps/LSB), for any FS_G")


class CTRL3_C(Register, addr=0x12, reset=0x04):
    """Reset, bus and data format."""

    BOOT = Bits(7, doc="1: reload the trimming values, 15 ms; clears itself")
    BDU = Bits(6, doc="block data update: 1 freezes a pair of bytes until both are read")
    H_LACTIVE = Bits(5, doc="interrupt pins active: 0 high, 1 low")
    PP_OD = Bits(4, doc="interrupt pins: 0 push-pull, 1 open drain")
    SIM = Bits(3, doc="SPI: 0 4-wire, 1 3-wire")
    IF_INC = Bits(2, doc="1: the address advances after each byte of a burst")
    BLE = Bits(1, doc="byte order of output pairs: 0 low byte first, 1 high byte first")
    SW_RESET = Bits(0, doc="1: reset the control registers, 50 us; clears itself")


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
    XL_HM_MODE = Bits(4, doc="accelerometer: 0 high performance, 1 low power or normal, depending on rate")
    USR_OFF_W = Bits(3, doc="weight of X, Y, Z_OFS_USR: 0 2^-10 g/LSB, 1 2^-6 g/LSB")
    FTYPE = Bits(1, 0, doc="gyroscope LPF1 cutoff at 833 Hz: 0 245, 1 195, 2 155, 3 293 Hz")


class CTRL7_G(Register, addr=0x16):
    """Gyroscope power mode and high-pass filter."""

    G_HM_MODE = Bits(7, doc="gyroscope: 0 high performance, 1 low power or normal, depending on rate")
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


class MASTER_CONFIG(Register, addr=0x1A):
    """Sensor hub: I2C master, its trigger and its pins."""

    DRDY_ON_INT1 = Bits(7, doc="1: hub data-ready on INT1")
    DATA_VALID_SEL_FIFO = Bits(6, doc="FIFO written at: 0 data-ready or step, 1 end of the hub's reads")
    START_CONFIG = Bits(4, doc="hub trigger: 0 accelerometer data-ready, 1 INT2 pin")
    PULL_UP_EN = Bits(3, doc="1: pull-ups of the auxiliary bus on")
    PASS_THROUGH_MODE = Bits(2, doc="1: main and auxiliary I2C connected")
    IRON_EN = Bits(1, doc="1: hard-iron correction on")
    MASTER_ON = Bits(0, doc="1: hub master on")


class WAKE_UP_SRC(Register, addr=0x1B, access="r"):
    """Free-fall, inactivity and wake-up events; a read clears latched events."""

    FF_IA = Bits(5, doc="free fall")
    SLEEP_STATE_IA = Bits(4, doc="inactive")
    WU_IA = Bits(3, doc="wake-up on any axis")
    X_WU = Bits(2, doc="wake-up on X")
    Y_WU = Bits(1, doc="wake-up on Y")
    Z_WU = Bits(0, doc="wake-up on Z")


class TAP_SRC(Register, addr=0x1C, access="r"):
    """Tap events; a read clears latched events."""

    TAP_IA = Bits(6, doc="single or double tap")
    SINGLE_TAP = Bits(5, doc="single tap")
    DOUBLE_TAP = Bits(4, doc="double tap")
    TAP_SIGN = Bits(3, doc="acceleration of the tap: 0 positive, 1 negative")
    X_TAP = Bits(2, doc="tap on X")
    Y_TAP = Bits(1, doc="tap on Y")
    Z_TAP = Bits(0, doc="tap on Z")


class D6D_SRC(Register, addr=0x1D, access="r"):
    """Orientation (6D, 4D) events; a read clears a latched event."""

    DEN_DRDY = Bits(7, doc="data-enable sample ready")
    D6D_IA = Bits(6, doc="orientation has changed")
    ZH = Bits(5, doc="Z over the positive threshold")
    ZL = Bits(4, doc="Z under the negative threshold")
    YH = Bits(3, doc="Y over the positive threshold")
    YL = Bits(2, doc="Y under the negative threshold")
    XH = Bits(1, doc="X over the positive threshold")
    XL = Bits(0, doc="X under the negative threshold")


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
    """Angular rate X, Y, Z, int16 each; one LSB depends on FS_G: 4.375 to 70 mdps."""


class OUT_XL(
    Register,
    addr=0x28,
    size=6,
    access="r",
    names=("OUTX_L_XL", "OUTX_H_XL", "OUTY_L_XL", "OUTY_H_XL", "OUTZ_L_XL", "OUTZ_H_XL"),
):
    """Acceleration X, Y, Z, int16 each; one LSB depends on FS_XL: 0.061 to 0.488 mg."""


class SENSORHUB(
    Register,
    addr=0x2E,
    size=12,
    access="r",
    names=tuple(f"SENSORHUB{byte}_REG" for byte in range(1, 13)),
):
    """Bytes 1 to 12 read by the sensor hub."""


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
    """Position of the next FIFO word in the pattern, low bits."""

    FIFO_PATTERN_7_0 = Bits(7, 0, doc="word index in the pattern, bits 7 to 0")


class FIFO_STATUS4(Register, addr=0x3D, access="r"):
    """Position of the next FIFO word in the pattern, high bits."""

    FIFO_PATTERN_9_8 = Bits(1, 0, doc="word index in the pattern, bits 9 to 8")


class FIFO_DATA_OUT(
    Register,
    addr=0x3E,
    size=2,
    access="r",
    names=("FIFO_DATA_OUT_L", "FIFO_DATA_OUT_H"),
):
    """Next FIFO word; a burst alternates between its two bytes."""


class TIMESTAMP0_REG(Register, addr=0x40, access="r"):
    """Timestamp, bits 7 to 0: 6.4 ms or 25 us per LSB by TIMER_HR."""

    TIMESTAMP0 = Bits(7, 0, doc="counter bits 7 to 0")


class TIMESTAMP1_REG(Register, addr=0x41, access="r"):
    """Timestamp, bits 15 to 8."""

    TIMESTAMP1 = Bits(7, 0, doc="counter bits 15 to 8")


class TIMESTAMP2_REG(Register, addr=0x42):
    """Timestamp, bits 23 to 16; writing 0xAA restarts the counter."""

    TIMESTAMP2 = Bits(7, 0, doc="counter bits 23 to 16")


class STEP_TIMESTAMP(
    Register,
    addr=0x49,
    size=2,
    access="r",
    names=("STEP_TIMESTAMP_L", "STEP_TIMESTAMP_H"),
):
    """Timestamp bits 23 to 8 at the last step: 1638.4 ms or 6.4 ms per LSB."""


class STEP_COUNTER(
    Register,
    addr=0x4B,
    size=2,
    access="r",
    names=("STEP_COUNTER_L", "STEP_COUNTER_H"),
):
    """Steps counted, uint16."""


class SENSORHUB_EXT(
    Register,
    addr=0x4D,
    size=6,
    access="r",
    names=tuple(f"SENSORHUB{byte}_REG" for byte in range(13, 19)),
):
    """Bytes 13 to 18 read by the sensor hub."""


class FUNC_SRC1(Register, addr=0x53, access="r"):
    """Events of the embedded functions; a read clears latched events."""

    STEP_COUNT_DELTA_IA = Bits(7, doc="steps were detected within the delta time")
    SIGN_MOTION_IA = Bits(6, doc="significant motion")
    TILT_IA = Bits(5, doc="tilt")
    STEP_DETECTED = Bits(4, doc="step")
    STEP_OVERFLOW = Bits(3, doc="step counter passed 2^16")
    HI_FAIL = Bits(2, doc="hard- and soft-iron correction failed")
    SI_END_OP = Bits(1, doc="hard- and soft-iron correction finished")
    SENSORHUB_END_OP = Bits(0, doc="sensor hub: 0 transferring, 1 idle")


class FUNC_SRC2(Register, addr=0x54, access="r"):
    """Sensor hub slaves that did not answer, and wrist tilt."""

    SLAVE3_NACK = Bits(6, doc="slave 3 did not acknowledge")
    SLAVE2_NACK = Bits(5, doc="slave 2 did not acknowledge")
    SLAVE1_NACK = Bits(4, doc="slave 1 did not acknowledge")
    SLAVE0_NACK = Bits(3, doc="slave 0 did not acknowledge")
    WRIST_TILT_IA = Bits(0, doc="wrist tilt; a read clears the latched bit")


class WRIST_TILT_IA(Register, addr=0x55, access="r"):
    """Wrist tilt, by axis and direction."""

    WRIST_TILT_IA_Xpos = Bits(7, doc="on the positive side of X")
    WRIST_TILT_IA_Xneg = Bits(6, doc="on the negative side of X")
    WRIST_TILT_IA_Ypos = Bits(5, doc="on the positive side of Y")
    WRIST_TILT_IA_Yneg = Bits(4, doc="on the negative side of Y")
    WRIST_TILT_IA_Zpos = Bits(3, doc="on the positive side of Z")
    WRIST_TILT_IA_Zneg = Bits(2, doc="on the negative side of Z")


class TAP_CFG(Register, addr=0x58):
    """Basic interrupts: enable, inactivity, filter, tap axes, latch."""

    INTERRUPTS_ENABLE = Bits(7, doc="1: 6D, free fall, wake-up, tap and inactivity on")
    INACT_EN = Bits(6, 5, doc="when still: 0 nothing, else XL at 12.5 Hz and gyroscope 1 on, 2 asleep, 3 off")
    SLOPE_FDS = Bits(4, doc="wake-up and inactivity filter: 0 slope, 1 high-pass")
    TAP_X_EN = Bits(3, doc="1: taps on X")
    TAP_Y_EN = Bits(2, doc="1: taps on Y")
    TAP_Z_EN = Bits(1, doc="1: taps on Z")
    LIR = Bits(0, doc="interrupts: 0 pulsed, 1 latched until the source is read")


class TAP_THS_6D(Register, addr=0x59):
    """Thresholds of orientation and tap."""

    D4D_EN = Bits(7, doc="1: 4D, the Z axis is ignored")
    SIXD_THS = Bits(6, 5, doc="6D angle: 0 80, 1 70, 2 60, 3 50 degrees")
    TAP_THS = Bits(4, 0, doc="tap threshold: full scale / 32 per LSB")


class INT_DUR2(Register, addr=0x5A):
    """Time windows of the tap, in accelerometer periods."""

    DUR = Bits(7, 4, doc="double-tap window: 32/ODR per LSB, 0 is 16/ODR")
    QUIET = Bits(3, 2, doc="quiet time after a tap: 4/ODR per LSB, 0 is 2/ODR")
    SHOCK = Bits(1, 0, doc="longest overshoot of a tap: 8/ODR per LSB, 0 is 4/ODR")


class WAKE_UP_THS(Register, addr=0x5B):
    """Wake-up threshold, and double tap."""

    SINGLE_DOUBLE_TAP = Bits(7, doc="taps: 0 single only, 1 single and double")
    WK_THS = Bits(5, 0, doc="wake-up threshold: full scale / 64 per LSB")


class WAKE_UP_DUR(Register, addr=0x5C):
    """Durations of free fall, wake-up and sleep, and timestamp resolution."""

    FF_DUR5 = Bits(7, doc="free-fall duration, bit 5")
    WAKE_DUR = Bits(6, 5, doc="wake-up duration: 1/ODR per LSB")
    TIMER_HR = Bits(4, doc="timestamp LSB: 0 6.4 ms, 1 25 us")
    SLEEP_DUR = Bits(3, 0, doc="time to inactivity: 512/ODR per LSB, 0 is 16/ODR")


class FREE_FALL(Register, addr=0x5D):
    """Free-fall duration and threshold."""

    FF_DUR_4_0 = Bits(7, 3, doc="free-fall duration, bits 4 to 0: 1/ODR per LSB")
    FF_THS = Bits(2, 0, doc="threshold: 0 156, 1 219, 2 250, 3 312, 4 344, 5 406, 6 469, 7 500 mg")


class MD1_CFG(Register, addr=0x5E):
    """Events on the INT1 pin."""

    INT1_INACT_STATE = Bits(7, doc="1: inactivity")
    INT1_SINGLE_TAP = Bits(6, doc="1: single tap")
    INT1_WU = Bits(5, doc="1: wake-up")
    INT1_FF = Bits(4, doc="1: free fall")
    INT1_DOUBLE_TAP = Bits(3, doc="1: double tap")
    INT1_6D = Bits(2, doc="1: orientation")
    INT1_TILT = Bits(1, doc="1: tilt")
    INT1_TIMER = Bits(0, doc="1: timestamp counter about to wrap")


class MD2_CFG(Register, addr=0x5F):
    """Events on the INT2 pin."""

    INT2_INACT_STATE = Bits(7, doc="1: inactivity")
    INT2_SINGLE_TAP = Bits(6, doc="1: single tap")
    INT2_WU = Bits(5, doc="1: wake-up")
    INT2_FF = Bits(4, doc="1: free fall")
    INT2_DOUBLE_TAP = Bits(3, doc="1: double tap")
    INT2_6D = Bits(2, doc="1: orientation")
    INT2_TILT = Bits(1, doc="1: tilt")
    INT2_IRON = Bits(0, doc="1: hard- and soft-iron correction finished")


class MASTER_CMD_CODE(Register, addr=0x60, modelled=False):
    """Sensor synchronisation: the master's command."""

    MASTER_CMD_CODE = Bits(7, 0, doc="command code")


class SENS_SYNC_SPI_ERROR_CODE(Register, addr=0x61, modelled=False):
    """Sensor synchronisation over SPI: error."""

    ERROR_CODE = Bits(7, 0, doc="error code")


class OUT_MAG_RAW(
    Register,
    addr=0x66,
    size=6,
    access="r",
    names=tuple(f"OUT_MAG_RAW_{axis}_{half}" for axis in "XYZ" for half in "LH"),
):
    """External magnetometer X, Y, Z before correction, int16 each."""


class X_OFS_USR(Register, addr=0x73):
    """User offset X, int8: added to the output with the weight of USR_OFF_W."""

    X_OFS_USR = Bits(7, 0, doc="-127 to 127; 2^-10 or 2^-6 g/LSB")


class Y_OFS_USR(Register, addr=0x74):
    """User offset Y, int8: added to the output with the weight of USR_OFF_W."""

    Y_OFS_USR = Bits(7, 0, doc="-127 to 127; 2^-10 or 2^-6 g/LSB")


class Z_OFS_USR(Register, addr=0x75):
    """User offset Z, int8: subtracted from the output with the weight of USR_OFF_W."""

    Z_OFS_USR = Bits(7, 0, doc="-127 to 127; 2^-10 or 2^-6 g/LSB")
