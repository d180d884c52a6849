"""LPS22HB barometer: set-up over I2C, and readings.

The steps follow ST's STSW-FCU001 without SPI.

Decision: the driver of the LPS22HB sets IF_ADD_INC in the transaction in which ST's driver clears
it, because bursts need this bit.

Decision: ``LPS22HB_WaitForData`` is not in ST's driver. ST's main.c may read its reference pressure before
the first conversion; such a read gave 758.4 hPa.
"""

from __future__ import annotations

from functools import lru_cache

from fcu_emulator.firmware_model.c_semantics import f32, int_divide
from fcu_emulator.firmware_model.drivers.component import (
    COMPONENT_ERROR,
    COMPONENT_OK,
    Step,
    check_who_am_i,
    update_register,
    update_registers,
)
from fcu_emulator.firmware_model.hal import HAL_OK, Hal

LPS22HB_ADDRESS = 0xBA  # SA0 high: 0x5D in 7 bits

WHO_AM_I = 0x0F
CTRL_REG1 = 0x10
CTRL_REG2 = 0x11
RES_CONF = 0x1A
STATUS = 0x27
PRESS_OUT_XL = 0x28
TEMP_OUT_L = 0x2B

WHO_AM_I_VALUE = 0xB1

ODR = 0x70
EN_LPFP = 0x08
LPFP_CFG = 0x04
BDU = 0x02
BOOT_SWRESET = 0x84
IF_ADD_INC = 0x10
LC_EN = 0x01
P_DA_T_DA = 0x03

ODR_25_HZ = 0x30
RESET_TIME_MS = 1000
FIRST_SAMPLE_TIMEOUT_MS = 100  # two and a half periods at 25 Hz

_INIT: tuple[Step, ...] = (
    (RES_CONF, LC_EN, LC_EN),
    (CTRL_REG1, ODR, 0),  # one-shot until enabled
    (CTRL_REG1, EN_LPFP, 0),
    (CTRL_REG1, LPFP_CFG, 0),
    (CTRL_REG1, BDU, BDU),
    (CTRL_REG2, IF_ADD_INC, IF_ADD_INC),
)


def LPS22HB_Init(hal: Hal) -> int:
    """Reset the sensor, wait 1 s, and set it up in power-down.

    Return COMPONENT_ERROR if the sensor is absent.
    """
    if update_register(hal, LPS22HB_ADDRESS, (CTRL_REG2, BOOT_SWRESET, BOOT_SWRESET)) != COMPONENT_OK:
        return COMPONENT_ERROR
    hal.HAL_Delay(RESET_TIME_MS)
    if check_who_am_i(hal, LPS22HB_ADDRESS, WHO_AM_I, WHO_AM_I_VALUE) != COMPONENT_OK:
        return COMPONENT_ERROR
    return update_registers(hal, LPS22HB_ADDRESS, _INIT)


def LPS22HB_Enable(hal: Hal) -> int:
    """Start at 25 Hz, and read the setting back, as ST's driver does."""
    if update_register(hal, LPS22HB_ADDRESS, (CTRL_REG1, ODR, ODR_25_HZ)) != COMPONENT_OK:
        return COMPONENT_ERROR
    status, _ = hal.HAL_I2C_Mem_Read(LPS22HB_ADDRESS, CTRL_REG1, 1)
    return COMPONENT_OK if status == HAL_OK else COMPONENT_ERROR


def LPS22HB_WaitForData(hal: Hal) -> int:
    """Wait for the first sample. Return COMPONENT_ERROR after 100 ms or a bus error."""
    for _ in range(FIRST_SAMPLE_TIMEOUT_MS):
        status, data = hal.HAL_I2C_Mem_Read(LPS22HB_ADDRESS, STATUS, 1)
        if status != HAL_OK:
            return COMPONENT_ERROR
        if data[0] & P_DA_T_DA == P_DA_T_DA:
            return COMPONENT_OK
        hal.HAL_Delay(1)
    return COMPONENT_ERROR


def pressure_hpa(raw: int) -> float:
    """Convert 24-bit output to hPa (float32): ``(float)((raw * 100) / 4096) / 100.0f``."""
    return f32(int_divide(raw * 100, 4096) / 100.0)


def temperature_degc(raw: int) -> float:
    """Convert 16-bit output to degC (float32): ``(float)((raw * 10) / 100) / 10.0f``."""
    return f32(int_divide(raw * 10, 100) / 10.0)


@lru_cache(maxsize=64)  # 25 new samples per second, read 800 times
def _pressure_of(data: bytes) -> float:
    return pressure_hpa(int.from_bytes(data, "little", signed=True))


def LPS22HB_Get_Press(hal: Hal, press: float) -> float:
    """Return the pressure in hPa, or ``press`` after a failed read."""
    status, data = hal.HAL_I2C_Mem_Read(LPS22HB_ADDRESS, PRESS_OUT_XL, 3)
    return _pressure_of(data) if status == HAL_OK else press


def LPS22HB_Get_Temp(hal: Hal, temperature: float) -> float:
    """Return the temperature in degC, or ``temperature`` after a failed read."""
    status, data = hal.HAL_I2C_Mem_Read(LPS22HB_ADDRESS, TEMP_OUT_L, 2)
    return temperature_degc(int.from_bytes(data, "little", signed=True)) if status == HAL_OK else temperature
