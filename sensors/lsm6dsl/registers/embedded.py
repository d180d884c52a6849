"""Timestamp, steps, and the sources of the embedded functions and of the hub."""

from sensors.register import Bits, Register


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


class FUNC_SRC1(Register, addr=0x53, access="r"):
    """Events of the embedded functions; reading clears latched ones."""

    STEP_COUNT_DELTA_IA = Bits(7, doc="steps were seen within the delta time")
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
    WRIST_TILT_IA = Bits(0, doc="wrist tilt; reading clears a latched one")


class WRIST_TILT_IA(Register, addr=0x55, access="r"):
    """Wrist tilt, by axis and direction."""

    WRIST_TILT_IA_Xpos = Bits(7, doc="on the positive side of X")
    WRIST_TILT_IA_Xneg = Bits(6, doc="on the negative side of X")
    WRIST_TILT_IA_Ypos = Bits(5, doc="on the positive side of Y")
    WRIST_TILT_IA_Yneg = Bits(4, doc="on the negative side of Y")
    WRIST_TILT_IA_Zpos = Bits(3, doc="on the positive side of Z")
    WRIST_TILT_IA_Zneg = Bits(2, doc="on the negative side of Z")
