"""The timestamp counter of the LSM6DSL (AN5040 6.5; datasheet 9.57 to 9.59).

Decisions where the documents are silent: TIMER_EN alone starts the timestamp counter, as the driver in Linux expects; a
change of TIMER_HR does not change the count; only the value 0xAA, written to TIMESTAMP2_REG, has an effect. The
counter's rate has the same error as the output rates, as in the LSM6DSO.
"""

from __future__ import annotations

from fcu_emulator.sensors.lsm6dsl.feature import FeatureContext
from fcu_emulator.sensors.lsm6dsl.registers import (
    CTRL1_XL,
    CTRL2_G,
    CTRL10_C,
    TIMESTAMP0_REG,
    TIMESTAMP1_REG,
    TIMESTAMP2_REG,
    WAKE_UP_DUR,
)
from fcu_emulator.sensors.register import Register
from fcu_emulator.sensors.register_file import NEVER_PS

_COUNTS = 1 << 24
_TICK_PS = (6_400 * 10**6, 25 * 10**6)  # TIMER_HR = 0, 1
_WARNING = (0xFFFF00, 0xFF0000)  # INT1_TIMER rises here, 1.6384 s before the counter wraps
_RESTART = 0xAA
_XL_LAST_CODE, _G_LAST_CODE = 11, 10


class Timestamp:
    """The timestamp counter; ``active`` while it counts."""

    CONFIGURATION: tuple[type[Register], ...] = (CTRL1_XL, CTRL2_G, CTRL10_C, WAKE_UP_DUR)

    def __init__(self, chip: FeatureContext) -> None:
        self.active = False
        self._chip = chip
        self._mem = chip.registers.mem
        self._factor_num, self._factor_den = chip.rate_factor.as_integer_ratio()
        self._count = 0  # value at ``_since_ps``
        self._since_ps = 0
        self._high_resolution = 0
        for register in (TIMESTAMP0_REG, TIMESTAMP1_REG, TIMESTAMP2_REG):
            chip.registers.before_read(register, self._show)
        chip.registers.on_write(TIMESTAMP2_REG, self._write)

    def value(self, at_ps: int) -> int:
        """Return the count at ``at_ps``, which must not be before the counter's latest configuration."""
        if not self.active:
            return self._count
        passed = (at_ps - self._since_ps) * self._factor_num
        return (self._count + passed // (_TICK_PS[self._high_resolution] * self._factor_den)) % _COUNTS

    def configure(self, now_ps: int) -> None:
        mem = self._mem
        active = bool(mem[CTRL10_C.addr] & CTRL10_C.TIMER_EN.mask) and _powered(mem)
        high_resolution = WAKE_UP_DUR.TIMER_HR.get(mem[WAKE_UP_DUR.addr])
        if (active, high_resolution) != (self.active, self._high_resolution):
            self._restart(self.value(now_ps), now_ps)
            self.active, self._high_resolution = active, high_resolution
            self.catch_up(now_ps)  # with the new unit, the warning may be due immediately

    def catch_up(self, now_ps: int) -> None:
        """Raise the warning if it is due. Only a write of 0xAA clears it."""
        due_ps = self.next_event_ps()
        if due_ps <= now_ps:
            self._chip.signals.set("TIMER", True, due_ps)

    def reset(self, now_ps: int) -> None:
        self.active = False
        self._high_resolution = 0
        self._restart(0, now_ps)
        self._chip.signals.set("TIMER", False, now_ps)

    def next_event_ps(self) -> int:
        if not self.active or self._chip.signals["TIMER"]:
            return NEVER_PS
        ticks = max(0, _WARNING[self._high_resolution] - self._count)
        passed = ticks * _TICK_PS[self._high_resolution] * self._factor_den
        return self._since_ps - (-passed // self._factor_num)

    def _restart(self, count: int, now_ps: int) -> None:
        self._count, self._since_ps = count, now_ps

    def _show(self, first: int, end: int, now_ps: int) -> None:
        del first, end
        value = self.value(now_ps).to_bytes(3, "little")
        self._mem[TIMESTAMP0_REG.addr : TIMESTAMP2_REG.addr + 1] = value

    def _write(self, old: int, new: int, now_ps: int) -> None:
        del old
        if new == _RESTART:
            self._chip.catch_up(now_ps)  # the FIFO stores earlier timestamps
            self._restart(0, now_ps)
            self._chip.signals.set("TIMER", False, now_ps)
            self._chip.catch_up(now_ps)  # for the pin


def _powered(mem: bytearray) -> bool:
    xl, g = CTRL1_XL.ODR_XL.get(mem[CTRL1_XL.addr]), CTRL2_G.ODR_G.get(mem[CTRL2_G.addr])
    return 0 < xl <= _XL_LAST_CODE or 0 < g <= _G_LAST_CODE
