"""Settings that the documents forbid: what to tell the user when one is written, or nothing."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeAlias

from sensors.lis2mdl.registers import CFG_REG_A, CFG_REG_B, CFG_REG_C

Violation: TypeAlias = Callable[[int], str]
"""``violation(value)``: what a register with that value violates, empty if nothing."""


def config_a(value: int) -> str:
    """AN5069 section 7; datasheet 8.5: COMP_TEMP_EN "must be 1"."""
    if value & CFG_REG_A.REBOOT.mask and value & CFG_REG_A.SOFT_RST.mask:
        return "CFG_REG_A: REBOOT and SOFT_RST at once"
    idle = CFG_REG_A.MD.get(value) > 1 or value & (CFG_REG_A.REBOOT.mask | CFG_REG_A.SOFT_RST.mask)
    if not idle and not value & CFG_REG_A.COMP_TEMP_EN.mask:
        return "CFG_REG_A: measuring with COMP_TEMP_EN = 0"
    return ""


def config_b(value: int) -> str:
    """AN5069 section 8."""
    if value & CFG_REG_B.OFF_CANC_ONE_SHOT.mask and not value & CFG_REG_B.OFF_CANC.mask:
        return "CFG_REG_B: OFF_CANC_ONE_SHOT without OFF_CANC"
    return ""


def config_c(value: int) -> str:
    """AN5069 Rev 4: INT/DRDY is SDO in 4-wire SPI."""
    shown = value & (CFG_REG_C.INT_on_PIN.mask | CFG_REG_C.DRDY_on_PIN.mask)
    return "CFG_REG_C: INT/DRDY is SDO while 4WSPI = 1" if shown and value & CFG_REG_C.FOURWSPI.mask else ""
