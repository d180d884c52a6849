"""Common driver functions: status codes and register updates.

Decision: a driver's set-up is a table of steps, in the order of ST's drivers (STSW-FCU001). Each
step makes one read and one write.
"""

from __future__ import annotations

from collections.abc import Iterable

from fcu_emulator.firmware_model.hal import HAL_OK, Hal

COMPONENT_OK = 0
COMPONENT_ERROR = 1

Step = tuple[int, int, int]
"""Register, mask of the field, and value of the field shifted to its position."""


def update_register(hal: Hal, device: int, step: Step) -> int:
    """Read and update one field. Return COMPONENT_OK or COMPONENT_ERROR."""
    register, mask, value = step
    status, data = hal.HAL_I2C_Mem_Read(device, register, 1)
    if status != HAL_OK:
        return COMPONENT_ERROR
    return write_register(hal, device, register, (data[0] & ~mask & 0xFF) | value)


def update_registers(hal: Hal, device: int, steps: Iterable[Step]) -> int:
    """Apply steps until one fails, and return its status."""
    for step in steps:
        if update_register(hal, device, step) != COMPONENT_OK:
            return COMPONENT_ERROR
    return COMPONENT_OK


def write_register(hal: Hal, device: int, register: int, value: int) -> int:
    """Write a register without reading it first."""
    status = hal.HAL_I2C_Mem_Write(device, register, bytes((value,)))
    return COMPONENT_OK if status == HAL_OK else COMPONENT_ERROR


def check_who_am_i(hal: Hal, device: int, register: int, expected: int) -> int:
    """Read the identity. Return COMPONENT_ERROR for a bus error or another sensor's identity."""
    status, data = hal.HAL_I2C_Mem_Read(device, register, 1)
    return COMPONENT_OK if status == HAL_OK and data[0] == expected else COMPONENT_ERROR
