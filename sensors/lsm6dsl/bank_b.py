"""Embedded-function bank B of the LSM6DSL (DocID028475 Rev 7, Table 224, section 12): absolute wrist tilt.

FUNC_CFG_ACCESS is declared here too, with the value that selects this bank: it is the only way out.

Decision: A_WRIST_TILT_Mask resets to 0xC0 as in Table 224. The road not taken is 0x80: AN5040 6.4 says that
only the positive side of X is enabled.
"""

from sensors.register import Bits, Register


class FUNC_CFG_ACCESS(Register, addr=0x01, reset=0xA0):
    """Bank at addresses 0x02 up: 0x00 main, 0x80 bank A, 0xA0 bank B (0x20 alone is forbidden)."""

    FUNC_CFG_EN = Bits(7, doc="1: embedded-function registers, bank A unless FUNC_CFG_EN_B")
    FUNC_CFG_EN_B = Bits(5, doc="1: bank B; only together with FUNC_CFG_EN")


class A_WRIST_TILT_LAT(Register, addr=0x50, reset=0x0F):
    """Wrist tilt: how long the position must be held."""

    WRIST_TILT_TIMER = Bits(7, 0, doc="40 ms per LSB")


class A_WRIST_TILT_THS(Register, addr=0x54, reset=0x20):
    """Wrist tilt: threshold."""

    WRIST_TILT_THS = Bits(7, 0, doc="15.625 mg per LSB; the angle is asin(value / 64)")


class A_WRIST_TILT_Mask(Register, addr=0x59, reset=0xC0):
    """Wrist tilt: axes and directions that count."""

    WRIST_TILT_MASK_Xpos = Bits(7, doc="1: positive side of X")
    WRIST_TILT_MASK_Xneg = Bits(6, doc="1: negative side of X")
    WRIST_TILT_MASK_Ypos = Bits(5, doc="1: positive side of Y")
    WRIST_TILT_MASK_Yneg = Bits(4, doc="1: negative side of Y")
    WRIST_TILT_MASK_Zpos = Bits(3, doc="1: positive side of Z")
    WRIST_TILT_MASK_Zneg = Bits(2, doc="1: negative side of Z")
