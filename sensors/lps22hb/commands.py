"""Bits that begin something and end by themselves: CTRL_REG2's BOOT, SWRESET and ONE_SHOT, and RESET_AZ/ARP.

Decisions where the datasheet (9.1, 9.6) is silent: RESET_AZ and RESET_ARP act at once and read 1 for 10 us;
writing ONE_SHOT again, or 0, while it is busy changes nothing, and another rate ends it; SWRESET acts at once
and reads 1 for 10 us; it keeps RPDS and RES_CONF, which the section does not list; BOOT ends after one period
of the data rate, or 1 ms in power-down, and disturbs no setting (the board's own firmware sets BOOT by
mistake and works).
"""

from __future__ import annotations

from collections.abc import Callable

from sensors.lps22hb.barometer import Barometer
from sensors.lps22hb.pipeline import Pipeline
from sensors.lps22hb.registers import (
    CTRL_REG1,
    CTRL_REG2,
    CTRL_REG3,
    FIFO_CTRL,
    INTERRUPT_CFG,
    REF_P,
    THS_P,
)
from sensors.part import SelfClearingBits
from sensors.register_file import RegisterFile
from sensors.sampling import PS_PER_S

_RESET_PS = 10 * PS_PER_S // 10**6
_BOOT_PS = PS_PER_S // 10**3
_RESET_BY_SWRESET = (INTERRUPT_CFG, THS_P, CTRL_REG1, CTRL_REG2, CTRL_REG3, FIFO_CTRL, REF_P)
_BOOT, _SWRESET, _ONE_SHOT = CTRL_REG2.BOOT.mask, CTRL_REG2.SWRESET.mask, CTRL_REG2.ONE_SHOT.mask


class Commands:
    """Works on ``registers``; ``configure(now_ps)`` brings the part in line with them."""

    def __init__(
        self,
        registers: RegisterFile,
        barometer: Barometer,
        pipeline: Pipeline,
        configure: Callable[[int], None],
    ) -> None:
        self._one_shot = False
        self._registers = registers
        self._barometer = barometer
        self._pipeline = pipeline
        self._configure = configure
        self._clearing = SelfClearingBits(registers, CTRL_REG2)
        self._clearing_resets = SelfClearingBits(registers, INTERRUPT_CFG)

    def before_control2(self, first: int, end: int, now_ps: int) -> None:
        """CTRL_REG2 is read: clear the bits of what is over."""
        self._clearing.before_read(first, end, now_ps)

    def before_interrupt_cfg(self, first: int, end: int, now_ps: int) -> None:
        """INTERRUPT_CFG is read: likewise."""
        self._clearing_resets.before_read(first, end, now_ps)

    def booting(self, now_ps: int) -> bool:
        """Whether BOOT is at work."""
        return self._clearing.pending(_BOOT, now_ps)

    def write_interrupt_cfg(self, old: int, new: int, now_ps: int) -> None:
        """INTERRUPT_CFG has been written; all samples until now have been taken."""
        del old
        if new & INTERRUPT_CFG.RESET_AZ.mask:
            self._pipeline.reference.reset_autozero()
        if new & INTERRUPT_CFG.RESET_ARP.mask:
            self._pipeline.reference.reset_autorifp()
        resets = new & (INTERRUPT_CFG.RESET_AZ.mask | INTERRUPT_CFG.RESET_ARP.mask)
        if resets:
            self._clearing_resets.begin(resets, now_ps + _RESET_PS)
        self._configure(now_ps)

    def write_control2(self, old: int, new: int, now_ps: int) -> None:
        """CTRL_REG2 has been written; all samples until now have been taken."""
        del old
        mem, busy = self._registers.mem, self._one_shot
        if busy:
            mem[CTRL_REG2.addr] |= _ONE_SHOT
        if new & _SWRESET:
            self.end_one_shot()
            self._registers.reset(*_RESET_BY_SWRESET)
            self._pipeline.reset()
            self._clearing.begin(_SWRESET, now_ps + _RESET_PS)
        self._configure(now_ps)
        if new & _BOOT:
            rate = self._barometer.settings.rate
            self._clearing.begin(_BOOT, now_ps + (int(PS_PER_S / rate) if rate else _BOOT_PS))
        if mem[CTRL_REG2.addr] & _ONE_SHOT and not busy:
            self._start_one_shot(now_ps)

    def end_one_shot(self) -> None:
        """The one-shot measurement, if there is one, is done or given up."""
        if self._one_shot:
            self._one_shot = False
            self._registers.mem[CTRL_REG2.addr] &= ~_ONE_SHOT
            self._barometer.stream.stop()

    def _start_one_shot(self, now_ps: int) -> None:
        mem = self._registers.mem
        if CTRL_REG1.ODR.get(mem[CTRL_REG1.addr]):
            self._registers.note(now_ps, "forbidden", "CTRL_REG2.ONE_SHOT while CTRL_REG1.ODR is not 0")
            mem[CTRL_REG2.addr] &= ~_ONE_SHOT
            return
        self._one_shot = True
        self._barometer.measure_once(now_ps)
