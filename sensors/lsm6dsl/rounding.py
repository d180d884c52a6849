"""Bursts that go round: ROUNDING and ROUNDING_STATUS of the LSM6DSL (AN5040 Rev 3, 4.7).

Decision: the last address of a pattern leads to its first wherever the burst began. The road not taken, only
for bursts that begin inside the pattern, cannot be told from the note's text, and drivers begin at its first
address. FIFO_DATA_OUT goes round whatever these bits say; that jump is the register file's own.
"""

from __future__ import annotations

from sensors.lsm6dsl.feature import Chip
from sensors.lsm6dsl.registers import CTRL5_C, CTRL7_G
from sensors.register import Register
from sensors.sampling import NEVER_PS

_ROUNDING: tuple[dict[int, int], ...] = (
    {},
    {0x2D: 0x28},  # accelerometer
    {0x27: 0x22},  # gyroscope
    {0x2D: 0x22},  # gyroscope, accelerometer
    {0x33: 0x2E},  # sensor hub 1 to 6
    {0x33: 0x28},  # accelerometer, sensor hub 1 to 6
    {0x39: 0x22},  # gyroscope, accelerometer, sensor hub 1 to 12
    {0x33: 0x22},  # gyroscope, accelerometer, sensor hub 1 to 6
)
_ROUNDING_STATUS = {0x1E: 0x53, 0x53: 0x1B}  # the three sources, STATUS_REG, FUNC_SRC1


class Rounding:
    """Sets where bursts jump; there is nothing to catch up with."""

    CONFIGURATION: tuple[type[Register], ...] = (CTRL5_C, CTRL7_G)

    def __init__(self, chip: Chip) -> None:
        self.active = False
        self._registers = chip.registers
        self._jumps: dict[int, int] = {}

    def configure(self, now_ps: int) -> None:
        """Take the pattern from the registers."""
        del now_ps
        mem = self._registers.mem
        jumps = _ROUNDING[CTRL5_C.ROUNDING.get(mem[CTRL5_C.addr])]
        if mem[CTRL7_G.addr] & CTRL7_G.ROUNDING_STATUS.mask:
            jumps = jumps | _ROUNDING_STATUS
        if jumps != self._jumps:
            self._jumps = jumps
            self._registers.set_jumps(jumps)

    def catch_up(self, now_ps: int) -> None:
        """Nothing happens by itself."""

    def reset(self, now_ps: int) -> None:
        """The registers have their reset values already, and ``configure`` reads them."""

    def next_event_ps(self) -> int:
        """No pin changes because of this."""
        return NEVER_PS
