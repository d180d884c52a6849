"""Access to core registers by name, several in one call."""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Sequence
from typing import Protocol

IT_BITS = 0x0600_FC00
"""ITSTATE in xPSR (ARMv7-M ARM B1.4.2)."""

SPSEL = 1 << 1
"""Bit of CONTROL: Thread mode uses the process stack (ARMv7-M ARM B1.4.4)."""

CORE = (*(f"r{number}" for number in range(13)), "sp", "lr", "pc", "xpsr")
MASKS = ("primask", "basepri", "faultmask", "control")
FLOATING_POINT = (*(f"s{number}" for number in range(32)), "fpscr")
EVERYTHING = ("xpsr", "control", *MASKS[:3], "msp", "psp", *CORE[:15], *FLOATING_POINT)
"""All registers except PC, in an order in which they can be written."""


RegisterCalls = tuple["memoryview[int]", Callable[[], object], Callable[[], object]]
"""Words for the values, a call that reads the registers into them, and a call that writes the registers."""


class Engine(Protocol):
    """A core whose registers are accessible."""

    def register_calls(self, names: tuple[str, ...]) -> RegisterCalls:
        """Return the calls for these names."""


class CoreRegisters:
    """Registers that are accessed in one call, with values in ``words``."""

    def __init__(self, engine: Engine, names: Sequence[str]) -> None:
        self.names = tuple(names)
        self.words, self.fetch, self._write = engine.register_calls(self.names)

    def read(self) -> memoryview[int]:
        """Return the values. The next call overwrites the returned memory."""
        self.fetch()
        return self.words

    def write(self, *values: int) -> None:
        if values:
            self.words[:] = memoryview((ctypes.c_uint32 * len(values))(*values)).cast("B").cast("I")
        self._write()
