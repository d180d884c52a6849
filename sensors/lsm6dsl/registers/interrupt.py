"""Pins and event functions: routing, sources, thresholds (datasheet 9.9 to 9.11, 9.24 to 9.26, 9.79 on).

Decision: D4D_EN = 1 enables 4D as AN5040 5.4.2 uses it; the datasheet's sentence has the polarity inverted.
"""

from sensors.register import Bits, Register


class DRDY_PULSE_CFG_G(Register, addr=0x0B):
    """Shape of the data-ready pins, and wrist tilt on INT2."""

    DRDY_PULSED = Bits(7, doc="data-ready pins: 0 latched, 1 pulses of 75 us")
    INT2_WRIST_TILT = Bits(0, doc="1: wrist tilt on INT2")


class INT1_CTRL(Register, addr=0x0D):
    """Which data and FIFO signals drive the INT1 pin."""

    INT1_STEP_DETECTOR = Bits(7, doc="1: step detected")
    INT1_SIGN_MOT = Bits(6, doc="1: significant motion")
    INT1_FULL_FLAG = Bits(5, doc="1: FIFO full")
    INT1_FIFO_OVR = Bits(4, doc="1: FIFO overrun")
    INT1_FTH = Bits(3, doc="1: FIFO watermark reached")
    INT1_BOOT = Bits(2, doc="1: boot in progress")
    INT1_DRDY_G = Bits(1, doc="1: gyroscope data-ready")
    INT1_DRDY_XL = Bits(0, doc="1: accelerometer data-ready")


class INT2_CTRL(Register, addr=0x0E):
    """Which data and FIFO signals drive the INT2 pin."""

    INT2_STEP_DELTA = Bits(7, doc="1: steps seen within the delta time")
    INT2_STEP_COUNT_OV = Bits(6, doc="1: step counter overflow")
    INT2_FULL_FLAG = Bits(5, doc="1: FIFO full")
    INT2_FIFO_OVR = Bits(4, doc="1: FIFO overrun")
    INT2_FTH = Bits(3, doc="1: FIFO watermark reached")
    INT2_DRDY_TEMP = Bits(2, doc="1: temperature data-ready")
    INT2_DRDY_G = Bits(1, doc="1: gyroscope data-ready")
    INT2_DRDY_XL = Bits(0, doc="1: accelerometer data-ready")


class WAKE_UP_SRC(Register, addr=0x1B, access="r"):
    """Free-fall, inactivity and wake-up events; reading clears latched ones."""

    FF_IA = Bits(5, doc="free fall")
    SLEEP_STATE_IA = Bits(4, doc="inactive")
    WU_IA = Bits(3, doc="wake-up on any axis")
    X_WU = Bits(2, doc="wake-up on X")
    Y_WU = Bits(1, doc="wake-up on Y")
    Z_WU = Bits(0, doc="wake-up on Z")


class TAP_SRC(Register, addr=0x1C, access="r"):
    """Tap events; reading clears latched ones."""

    TAP_IA = Bits(6, doc="single or double tap")
    SINGLE_TAP = Bits(5, doc="single tap")
    DOUBLE_TAP = Bits(4, doc="double tap")
    TAP_SIGN = Bits(3, doc="acceleration of the tap: 0 positive, 1 negative")
    X_TAP = Bits(2, doc="tap on X")
    Y_TAP = Bits(1, doc="tap on Y")
    Z_TAP = Bits(0, doc="tap on Z")


class D6D_SRC(Register, addr=0x1D, access="r"):
    """Orientation (6D, 4D) events; reading clears a latched one."""

    DEN_DRDY = Bits(7, doc="data-enable sample ready")
    D6D_IA = Bits(6, doc="orientation has changed")
    ZH = Bits(5, doc="Z over the positive threshold")
    ZL = Bits(4, doc="Z under the negative threshold")
    YH = Bits(3, doc="Y over the positive threshold")
    YL = Bits(2, doc="Y under the negative threshold")
    XH = Bits(1, doc="X over the positive threshold")
    XL = Bits(0, doc="X under the negative threshold")


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
    """Which events drive the INT1 pin."""

    INT1_INACT_STATE = Bits(7, doc="1: inactivity")
    INT1_SINGLE_TAP = Bits(6, doc="1: single tap")
    INT1_WU = Bits(5, doc="1: wake-up")
    INT1_FF = Bits(4, doc="1: free fall")
    INT1_DOUBLE_TAP = Bits(3, doc="1: double tap")
    INT1_6D = Bits(2, doc="1: orientation")
    INT1_TILT = Bits(1, doc="1: tilt")
    INT1_TIMER = Bits(0, doc="1: timestamp counter about to wrap")


class MD2_CFG(Register, addr=0x5F):
    """Which events drive the INT2 pin."""

    INT2_INACT_STATE = Bits(7, doc="1: inactivity")
    INT2_SINGLE_TAP = Bits(6, doc="1: single tap")
    INT2_WU = Bits(5, doc="1: wake-up")
    INT2_FF = Bits(4, doc="1: free fall")
    INT2_DOUBLE_TAP = Bits(3, doc="1: double tap")
    INT2_6D = Bits(2, doc="1: orientation")
    INT2_TILT = Bits(1, doc="1: tilt")
    INT2_IRON = Bits(0, doc="1: hard- and soft-iron correction finished")
