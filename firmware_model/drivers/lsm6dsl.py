"""LSM6DSL accelerometer and gyroscope: set-up over I2C.

The steps follow ST's STSW-FCU001 without SPI.
"""

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

LSM6DSL_ADDRESS = 0xD6  # SA0 high: 0x6B in 7 bits

FIFO_CTRL5 = 0x0A
WHO_AM_I = 0x0F
CTRL1_XL = 0x10
CTRL2_G = 0x11
CTRL3_C = 0x12
CTRL6_C = 0x15
CTRL8_XL = 0x17
OUTX_L_G = 0x22
OUTX_L_XL = 0x28

WHO_AM_I_VALUE = 0x6A

FIFO_MODE = 0x07
ODR = 0xF0  # ODR_XL and ODR_G have the same bits and codes
FS = 0x0C
BW0_XL = 0x01
BDU = 0x40
IF_INC = 0x04
FTYPE = 0x03
LPF2_XL_EN = 0x80
HPCF_XL = 0x60
INPUT_COMPOSITE = 0x08

ODR_104_HZ = 0x40
ODR_6660_HZ = 0xA0
FS_XL_2_G = 0x00
FS_XL_4_G = 0x08
FS_G_2000_DPS = 0x0C
HPCF_XL_ODR_400 = 0x60
CTRL2_G_416_HZ_2000_DPS = 0x6C

_COMMON_INIT: tuple[Step, ...] = (
    (CTRL3_C, IF_INC, IF_INC),
    (CTRL3_C, BDU, BDU),
    (FIFO_CTRL5, FIFO_MODE, 0),  # bypass
)
_X_INIT: tuple[Step, ...] = (
    *_COMMON_INIT,
    (CTRL1_XL, ODR, 0),  # power-down until enabled
    (CTRL1_XL, FS, FS_XL_2_G),
)
_G_INIT: tuple[Step, ...] = (
    *_COMMON_INIT,
    (CTRL2_G, ODR, 0),
    (CTRL2_G, FS, FS_G_2000_DPS),
)
_FLIGHT_SETUP: tuple[Step, ...] = (
    (CTRL1_XL, ODR, ODR_6660_HZ),
    (CTRL1_XL, FS, FS_XL_4_G),
    (CTRL8_XL, INPUT_COMPOSITE, 0),  # ODR/2; ST's header has the wrong bit 7 here, which also gives 00
    (CTRL8_XL, LPF2_XL_EN, LPF2_XL_EN),
    (CTRL8_XL, HPCF_XL, HPCF_XL_ODR_400),
    (CTRL1_XL, BW0_XL, 0),  # analog bandwidth 1.5 kHz
    (CTRL6_C, FTYPE, 0x01),
)


def LSM6DSL_X_Init(hal: Hal) -> int:
    """Set up the accelerometer in power-down. Return COMPONENT_ERROR if absent."""
    if check_who_am_i(hal, LSM6DSL_ADDRESS, WHO_AM_I, WHO_AM_I_VALUE) != COMPONENT_OK:
        return COMPONENT_ERROR
    return update_registers(hal, LSM6DSL_ADDRESS, _X_INIT)


def LSM6DSL_G_Init(hal: Hal) -> int:
    """Identify the sensor again, as ST's driver does, and set up the gyroscope in power-down."""
    if check_who_am_i(hal, LSM6DSL_ADDRESS, WHO_AM_I, WHO_AM_I_VALUE) != COMPONENT_OK:
        return COMPONENT_ERROR
    return update_registers(hal, LSM6DSL_ADDRESS, _G_INIT)


def LSM6DSL_X_Enable(hal: Hal) -> int:
    """Start the accelerometer at 104 Hz."""
    return update_register(hal, LSM6DSL_ADDRESS, (CTRL1_XL, ODR, ODR_104_HZ))


def LSM6DSL_G_Enable(hal: Hal) -> int:
    """Start the gyroscope at 104 Hz."""
    return update_register(hal, LSM6DSL_ADDRESS, (CTRL2_G, ODR, ODR_104_HZ))


def LSM6DSL_FlightSetup(hal: Hal) -> None:
    """Set accelerometer (6.66 kHz, 4 g, LPF2 at ODR/400) and gyroscope (416 Hz, 2000 dps)."""
    for step in _FLIGHT_SETUP:
        update_register(hal, LSM6DSL_ADDRESS, step)
    write_register(hal, LSM6DSL_ADDRESS, CTRL2_G, CTRL2_G_416_HZ_2000_DPS)
