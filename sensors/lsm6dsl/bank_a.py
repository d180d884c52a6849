"""Embedded-function bank A of the LSM6DSL (DocID028475 Rev 7, Table 223, section 11).

It sets up the sensor hub, the pedometer and the correction of an external magnetometer.

FUNC_CFG_ACCESS is declared here too, with the value that selects this bank: it is the only way out.

Decision: the diagonal of the soft-iron matrix resets to 0x08 (1.0) as in Table 223. The road not taken is
AN5040 7.5.3, which says zero: a correction switched on with zeros would wipe the field out.
"""

from sensors.register import Bits, Register

_RATE = "read at every 0 1st, 1 2nd, 2 4th, 3 8th trigger"
_IRON = "sign and magnitude, bit 7 the sign; 1/8 per LSB"


class FUNC_CFG_ACCESS(Register, addr=0x01, reset=0x80):
    """Bank at addresses 0x02 up: 0x00 main, 0x80 bank A, 0xA0 bank B (0x20 alone is forbidden)."""

    FUNC_CFG_EN = Bits(7, doc="1: embedded-function registers, bank A unless FUNC_CFG_EN_B")
    FUNC_CFG_EN_B = Bits(5, doc="1: bank B; only together with FUNC_CFG_EN")


class SLV0_ADD(Register, addr=0x02):
    """Hub slave 0: I2C address and direction."""

    Slave0_add = Bits(7, 1, doc="7-bit I2C address")
    rw_0 = Bits(0, doc="0 write, 1 read")


class SLV0_SUBADD(Register, addr=0x03):
    """Hub slave 0: first register."""

    Slave0_reg = Bits(7, 0, doc="sub-address, sent as it is")


class SLAVE0_CONFIG(Register, addr=0x04):
    """Hub slave 0: rate and length; number of slaves."""

    Slave0_rate = Bits(7, 6, doc=_RATE)
    Aux_sens_on = Bits(5, 4, doc="slaves in use, less one")
    Src_mode = Bits(3, doc="1: read only if the register named by Slave_dataw is not zero")
    Slave0_numop = Bits(2, 0, doc="bytes to read")


class SLV1_ADD(Register, addr=0x05):
    """Hub slave 1: I2C address."""

    Slave1_add = Bits(7, 1, doc="7-bit I2C address")
    r_1 = Bits(0, doc="1: read enabled")


class SLV1_SUBADD(Register, addr=0x06):
    """Hub slave 1: first register."""

    Slave1_reg = Bits(7, 0, doc="sub-address, sent as it is")


class SLAVE1_CONFIG(Register, addr=0x07):
    """Hub slave 1: rate and length; single write of slave 0."""

    Slave1_rate = Bits(7, 6, doc=_RATE)
    write_once = Bits(5, doc="slave 0 is written: 0 at every trigger, 1 once")
    Slave1_numop = Bits(2, 0, doc="bytes to read")


class SLV2_ADD(Register, addr=0x08):
    """Hub slave 2: I2C address."""

    Slave2_add = Bits(7, 1, doc="7-bit I2C address")
    r_2 = Bits(0, doc="1: read enabled")


class SLV2_SUBADD(Register, addr=0x09):
    """Hub slave 2: first register."""

    Slave2_reg = Bits(7, 0, doc="sub-address, sent as it is")


class SLAVE2_CONFIG(Register, addr=0x0A):
    """Hub slave 2: rate and length."""

    Slave2_rate = Bits(7, 6, doc=_RATE)
    Slave2_numop = Bits(2, 0, doc="bytes to read")


class SLV3_ADD(Register, addr=0x0B):
    """Hub slave 3: I2C address."""

    Slave3_add = Bits(7, 1, doc="7-bit I2C address")
    r_3 = Bits(0, doc="1: read enabled")


class SLV3_SUBADD(Register, addr=0x0C):
    """Hub slave 3: first register."""

    Slave3_reg = Bits(7, 0, doc="sub-address, sent as it is")


class SLAVE3_CONFIG(Register, addr=0x0D):
    """Hub slave 3: rate and length."""

    Slave3_rate = Bits(7, 6, doc=_RATE)
    Slave3_numop = Bits(2, 0, doc="bytes to read")


class DATAWRITE_SRC_MODE_SUB_SLV0(Register, addr=0x0E):
    """Hub slave 0: byte to write, or register tested by Src_mode."""

    Slave_dataw = Bits(7, 0, doc="data byte, or sub-address of the test")


class CONFIG_PEDO_THS_MIN(Register, addr=0x0F, reset=0x10):
    """Pedometer: internal full scale and smallest step."""

    PEDO_FS = Bits(7, doc="internal full scale: 0 2 g, 1 4 g")
    ths_min = Bits(4, 0, doc="threshold: 32 mg/LSB at 2 g, 62.5 mg/LSB at 4 g")


class SM_THS(Register, addr=0x13, reset=0x06):
    """Significant motion: steps needed."""

    SM_THS = Bits(7, 0, doc="steps")


class PEDO_DEB_REG(Register, addr=0x14, reset=0x6E):
    """Pedometer: debounce time and steps."""

    DEB_TIME = Bits(7, 3, doc="80 ms per LSB")
    DEB_STEP = Bits(2, 0, doc="steps before counting starts")


class STEP_COUNT_DELTA(Register, addr=0x15):
    """Pedometer: delta time."""

    SC_DELTA = Bits(7, 0, doc="1.6384 s per LSB")


class MAG_SI_XX(Register, addr=0x24, reset=0x08):
    """Soft-iron matrix, row X column X."""

    MAG_SI_XX = Bits(7, 0, doc=_IRON)


class MAG_SI_XY(Register, addr=0x25):
    """Soft-iron matrix, row X column Y."""

    MAG_SI_XY = Bits(7, 0, doc=_IRON)


class MAG_SI_XZ(Register, addr=0x26):
    """Soft-iron matrix, row X column Z."""

    MAG_SI_XZ = Bits(7, 0, doc=_IRON)


class MAG_SI_YX(Register, addr=0x27):
    """Soft-iron matrix, row Y column X."""

    MAG_SI_YX = Bits(7, 0, doc=_IRON)


class MAG_SI_YY(Register, addr=0x28, reset=0x08):
    """Soft-iron matrix, row Y column Y."""

    MAG_SI_YY = Bits(7, 0, doc=_IRON)


class MAG_SI_YZ(Register, addr=0x29):
    """Soft-iron matrix, row Y column Z."""

    MAG_SI_YZ = Bits(7, 0, doc=_IRON)


class MAG_SI_ZX(Register, addr=0x2A):
    """Soft-iron matrix, row Z column X."""

    MAG_SI_ZX = Bits(7, 0, doc=_IRON)


class MAG_SI_ZY(Register, addr=0x2B):
    """Soft-iron matrix, row Z column Y."""

    MAG_SI_ZY = Bits(7, 0, doc=_IRON)


class MAG_SI_ZZ(Register, addr=0x2C, reset=0x08):
    """Soft-iron matrix, row Z column Z."""

    MAG_SI_ZZ = Bits(7, 0, doc=_IRON)


class MAG_OFFX_L(Register, addr=0x2D):
    """Hard-iron offset X, low byte of an int16."""

    MAG_OFFX_L = Bits(7, 0, doc="bits 7 to 0, in LSB of the magnetometer")


class MAG_OFFX_H(Register, addr=0x2E):
    """Hard-iron offset X, high byte of an int16."""

    MAG_OFFX_H = Bits(7, 0, doc="bits 15 to 8, in LSB of the magnetometer")


class MAG_OFFY_L(Register, addr=0x2F):
    """Hard-iron offset Y, low byte of an int16."""

    MAG_OFFY_L = Bits(7, 0, doc="bits 7 to 0, in LSB of the magnetometer")


class MAG_OFFY_H(Register, addr=0x30):
    """Hard-iron offset Y, high byte of an int16."""

    MAG_OFFY_H = Bits(7, 0, doc="bits 15 to 8, in LSB of the magnetometer")


class MAG_OFFZ_L(Register, addr=0x31):
    """Hard-iron offset Z, low byte of an int16."""

    MAG_OFFZ_L = Bits(7, 0, doc="bits 7 to 0, in LSB of the magnetometer")


class MAG_OFFZ_H(Register, addr=0x32):
    """Hard-iron offset Z, high byte of an int16."""

    MAG_OFFZ_H = Bits(7, 0, doc="bits 15 to 8, in LSB of the magnetometer")
