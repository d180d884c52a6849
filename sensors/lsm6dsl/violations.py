"""Settings that cannot work, noted once when they come about."""

from __future__ import annotations

from collections.abc import Mapping

from sensors.lsm6dsl.feature import Chip
from sensors.lsm6dsl.filters import high_pass_is_idle, reference_mode_is_idle
from sensors.lsm6dsl.registers import (
    CTRL1_XL,
    CTRL2_G,
    CTRL5_C,
    TAP_CFG,
    TAP_THS_6D,
    WAKE_UP_THS,
    X_OFS_USR,
    Y_OFS_USR,
    Z_OFS_USR,
)

_FASTEST_ODR = 10  # 6664 Hz: too fast for activity recognition
_NOT_A_USER_OFFSET = 0x80  # -128; datasheet 9.91 to 9.93 give -127 to 127


class Violations:
    """Remembers which are present, so that the next write to another register does not repeat the note."""

    def __init__(self, chip: Chip) -> None:
        self._chip = chip
        self._present: set[str] = set()

    def report(self, found: Mapping[str, bool], now_ps: int) -> None:
        """``found``: each violation's text, and whether it is present."""
        for text, present in found.items():
            if present and text not in self._present:
                self._chip.note(now_ps, "forbidden", text)
        self._present = {text for text, present in found.items() if present}


def of_measuring(mem: bytearray) -> dict[str, bool]:
    """What cannot work in the settings of accelerometer and gyroscope (datasheet Tables 52, 55, 63, 64)."""
    offsets = {register.__name__: mem[register.addr] for register in (X_OFS_USR, Y_OFS_USR, Z_OFS_USR)}
    return {
        "CTRL1_XL.ODR_XL above 11": CTRL1_XL.ODR_XL.get(mem[CTRL1_XL.addr]) > 11,
        "CTRL2_G.ODR_G above 10": CTRL2_G.ODR_G.get(mem[CTRL2_G.addr]) > 10,
        "CTRL5_C.ST_XL = 11b": CTRL5_C.ST_XL.get(mem[CTRL5_C.addr]) == 3,
        "CTRL5_C.ST_G = 10b": CTRL5_C.ST_G.get(mem[CTRL5_C.addr]) == 2,
        "CTRL8_XL.HP_REF_MODE without HP_SLOPE_XL_EN = 1 and HPCF_XL above 0": reference_mode_is_idle(mem),
        "CTRL7_G.HP_EN_G outside high performance": high_pass_is_idle(mem),
        **{f"{name} = 0x80": value == _NOT_A_USER_OFFSET for name, value in offsets.items()},
    }


def of_events(mem: bytearray) -> dict[str, bool]:
    """What cannot work in the settings of the event functions, while they are on (AN5040 5.5, 5.6)."""
    config = mem[TAP_CFG.addr]
    on = bool(config & TAP_CFG.INTERRUPTS_ENABLE.mask)
    tap, wake_up = TAP_THS_6D.TAP_THS.get(mem[TAP_THS_6D.addr]), WAKE_UP_THS.WK_THS.get(mem[WAKE_UP_THS.addr])
    taps = bool(config & (TAP_CFG.TAP_X_EN.mask | TAP_CFG.TAP_Y_EN.mask | TAP_CFG.TAP_Z_EN.mask))
    rests = bool(TAP_CFG.INACT_EN.get(config))
    return {
        "TAP_THS_6D.TAP_THS not above the wake-up threshold": on and taps and 0 < 2 * tap <= wake_up,
        "TAP_CFG.INACT_EN with ODR_XL above 3332 Hz": on
        and rests
        and CTRL1_XL.ODR_XL.get(mem[CTRL1_XL.addr]) == _FASTEST_ODR,
    }
