"""The core's registers by the names of the architecture, read and written some at a time.

One call for several registers costs half of what a call for one does through the package's own methods.
"""

from __future__ import annotations

import ctypes
from collections.abc import Sequence
from functools import partial
from typing import Final, Protocol

from unicorn import arm_const

_REGISTERS: Final[dict[str, int]] = {
    **{f"r{number}": arm_const.UC_ARM_REG_R0 + number for number in range(13)},
    "sp": arm_const.UC_ARM_REG_SP,
    "lr": arm_const.UC_ARM_REG_LR,
    "pc": arm_const.UC_ARM_REG_PC,
    "xpsr": arm_const.UC_ARM_REG_XPSR,
    "msp": arm_const.UC_ARM_REG_MSP,
    "psp": arm_const.UC_ARM_REG_PSP,
    "primask": arm_const.UC_ARM_REG_PRIMASK,
    "basepri": arm_const.UC_ARM_REG_BASEPRI,
    "faultmask": arm_const.UC_ARM_REG_FAULTMASK,
    "control": arm_const.UC_ARM_REG_CONTROL,
    **{f"s{number}": arm_const.UC_ARM_REG_S0 + number for number in range(32)},
    "fpscr": arm_const.UC_ARM_REG_FPSCR,
}

IT_BITS = 0x0600_FC00
"""ITSTATE in xPSR (ARMv7-M ARM B1.4.2)."""

CORE = (*(f"r{number}" for number in range(13)), "sp", "lr", "pc", "xpsr")
MASKS = ("primask", "basepri", "faultmask", "control")
FLOATING_POINT = (*(f"s{number}" for number in range(32)), "fpscr")
EVERYTHING = ("xpsr", "control", *MASKS[:3], "msp", "psp", *CORE[:15], *FLOATING_POINT)
"""All but PC, in an order in which they can be written."""


class Handle(Protocol):
    """What is needed of the engine."""

    library: ctypes.PyDLL
    handle: ctypes.c_void_p


class Registers:
    """Some registers, read and written in one call; ``words`` are their values, in the order of ``names``."""

    def __init__(self, engine: Handle, names: Sequence[str]) -> None:
        count = len(names)
        self.names = tuple(names)
        self._ids = (ctypes.c_int * count)(*(_REGISTERS[name] for name in names))
        self._values = (ctypes.c_uint32 * count)()
        self._places = (ctypes.c_void_p * count)(
            *(ctypes.addressof(self._values) + 4 * n for n in range(count))
        )
        self.words = memoryview(self._values).cast("B").cast("I")
        call = (engine.handle, ctypes.byref(self._ids), ctypes.byref(self._places), ctypes.c_int(count))
        self.fetch = partial(engine.library.uc_reg_read_batch, *call)
        """Bring ``words`` up to date."""
        self._write = partial(engine.library.uc_reg_write_batch, *call)

    def read(self) -> memoryview[int]:
        """The values now; the same memory each time."""
        self.fetch()
        return self.words

    def write(self, *values: int) -> None:
        """All of them, in order; without ``values`` what is in ``words``."""
        if values:
            self.words[:] = memoryview((ctypes.c_uint32 * len(values))(*values)).cast("B").cast("I")
        self._write()
