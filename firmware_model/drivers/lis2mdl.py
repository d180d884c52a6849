"""LIS2MDL magnetometer: set-up over I2C, in the order of ST's STSW-FCU001."""

from __future__ import annotations

from fcu_emulator.firmware_model.drivers.component import (
    COMPONENT_ERROR,
    COMPONENT_OK,
    Step,
    check_who_am_i,
    update_register,
    update_registers,
    write_register,
)
from fcu_emulator.firmware_model.hal import Hal

LIS2MDL_ADDRESS = 0x3C  # 0x1E in 7 bits

WHO_AM_I = 0x4F
CFG_REG_A = 0x60
CFG_REG_B = 0x61
CFG_REG_C = 0x62
OUTX_L_REG = 0x68

WHO_AM_I_VALUE = 0x40

MD = 0x03
ODR = 0x0C
BDU = 0x10
SELF_TEST = 0x02

MD_CONTINUOUS = 0x00
MD_IDLE = 0x03
ODR_100_HZ = 0x0C
CFG_REG_A_COMP_TEMP_100_HZ = 0x8C
CFG_REG_B_OFF_CANC = 0x02

_INIT: tuple[Step, ...] = (
    (CFG_REG_A, MD, MD_IDLE),
    (CFG_REG_C, BDU, BDU),
    (CFG_REG_A, ODR, ODR_100_HZ),
    (CFG_REG_C, SELF_TEST, 0),
)


def LIS2MDL_Init(hal: Hal) -> int:
    """Set up the sensor, which stays idle. Return COMPONENT_ERROR if absent."""
    if check_who_am_i(hal, LIS2MDL_ADDRESS, WHO_AM_I, WHO_AM_I_VALUE) != COMPONENT_OK:
        return COMPONENT_ERROR
    return update_registers(hal, LIS2MDL_ADDRESS, _INIT)


def LIS2MDL_Enable(hal: Hal) -> int:
    """Start measurements in continuous mode."""
    return update_register(hal, LIS2MDL_ADDRESS, (CFG_REG_A, MD, MD_CONTINUOUS))


def LIS2MDL_FlightSetup(hal: Hal) -> None:
    """Set temperature compensation, 100 Hz, continuous mode and offset cancellation."""
    write_register(hal, LIS2MDL_ADDRESS, CFG_REG_A, CFG_REG_A_COMP_TEMP_100_HZ)
    write_register(hal, LIS2MDL_ADDRESS, CFG_REG_B, CFG_REG_B_OFF_CANC)
