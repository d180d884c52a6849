"""Banks, sensor synchronisation, identity (datasheet 9.1 to 9.3, 9.12, 9.87, 9.88)."""

from sensors.register import Bits, Register


class FUNC_CFG_ACCESS(Register, addr=0x01):
    """Bank at addresses 0x02 up: 0x00 main, 0x80 bank A, 0xA0 bank B (0x20 alone is forbidden)."""

    FUNC_CFG_EN = Bits(7, doc="1: embedded-function registers, bank A unless FUNC_CFG_EN_B")
    FUNC_CFG_EN_B = Bits(5, doc="1: bank B; only together with FUNC_CFG_EN")


class SENSOR_SYNC_TIME_FRAME(Register, addr=0x04, modelled=False):
    """Sensor synchronisation: time frame."""

    TPH = Bits(3, 0, doc="500 ms per LSB, 0 to 10; 0 synchronisation off")


class SENSOR_SYNC_RES_RATIO(Register, addr=0x05, modelled=False):
    """Sensor synchronisation: resolution ratio."""

    RR = Bits(1, 0, doc="0 2^-11, 1 2^-12, 2 2^-13, 3 2^-14")


class WHO_AM_I(Register, addr=0x0F, access="r", reset=0x6A):
    """Identity of the part: always 0x6A."""

    WHO_AM_I = Bits(7, 0, doc="0x6A, the same in LSM6DSM and LSM6DS3TR-C")


class MASTER_CMD_CODE(Register, addr=0x60, modelled=False):
    """Sensor synchronisation: the master's command."""

    MASTER_CMD_CODE = Bits(7, 0, doc="command code")


class SENS_SYNC_SPI_ERROR_CODE(Register, addr=0x61, modelled=False):
    """Sensor synchronisation over SPI: error."""

    ERROR_CODE = Bits(7, 0, doc="error code")
