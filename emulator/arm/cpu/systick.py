"""SysTick: counts HCLK, or HCLK / 8, down from RVR (ARMv7-M ARM B3.3; RM0368 section 10.1.4).

From a counter of 0 the first clock reloads it; each step from 1 to 0 sets COUNTFLAG and, with TICKINT,
makes the exception pending. So the period is RVR + 1. Steps from 1 to 0 are events at exact multiples of
the period; the counter's value in between is worked out when it is read. A new RVR counts from the next
reload on; 0 stops it there (B3.3.1).
"""

from __future__ import annotations

from typing import Final

from emulator.arm.cpu.nvic import SYS_TICK, Nvic
from emulator.arm.soc import Soc
from emulator.clock import PS_PER_S, Event

CSR, RVR, CVR, CALIB = 0x010, 0x014, 0x018, 0x01C

ENABLE, TICKINT, CLKSOURCE, COUNTFLAG = 1 << 0, 1 << 1, 1 << 2, 1 << 16
_CALIBRATION = 0x4000_2904  # 10500: 1 ms of 84 MHz / 8, not exact (SKEW); PM0214 4.5.4
_MAXIMUM = 0xFF_FFFF


class SysTick:
    """The core's own timer; ``calibration`` reads as ST has fixed it."""

    OFFSETS: Final = (CSR, RVR, CVR, CALIB)

    def __init__(self, soc: Soc, nvic: Nvic) -> None:
        self._soc = soc
        self._clock = soc.clock
        self._nvic = nvic
        self._event: Event | None = None
        self._control = self._reload = 0
        self.reset()
        soc.clocks.on_change(self._retime)

    def reset(self) -> None:
        """Off."""
        self._stop()
        self._control = self._reload = 0
        self._value = 0  # when the counter was last started or stopped
        self._origin_ps = 0
        self._hz = 0  # the rate since then
        self._wraps = 0
        self._first = self._period = 0

    # -- registers --------------------------------------------------------------------------------------

    def read(self, offset: int) -> int:
        """Reading CSR clears COUNTFLAG."""
        value = self.peek(offset)
        if offset == CSR:
            self._control &= ~COUNTFLAG
        return value

    def peek(self, offset: int) -> int:
        """The same without clearing."""
        if offset == CVR:
            return self._now()
        return {CSR: self._control, RVR: self._reload, CALIB: _CALIBRATION}[offset]

    def pure_read(self, offset: int) -> bool:
        """The counter runs; CSR is cleared by reading once its flag is set."""
        return offset != CVR and not (offset == CSR and self._control & COUNTFLAG)

    def write(self, offset: int, value: int, mask: int) -> None:
        """Any write of CVR clears it and COUNTFLAG."""
        if offset == CSR:
            self._switch(self._control & ~mask | value & mask)
        elif offset == RVR:
            self._reload = (self._reload & ~mask | value & mask) & _MAXIMUM
            if self._control & ENABLE and self._event is None:
                self._start(self._value)  # it stood still at 0 with nothing to reload
        elif offset == CVR:
            self._control &= ~COUNTFLAG
            self._start(0)

    def _switch(self, control: int) -> None:
        changed = (self._control ^ control) & (ENABLE | CLKSOURCE)  # all else leaves the count alone
        value = self._now() if changed else 0
        self._control = self._control & COUNTFLAG | control & (ENABLE | TICKINT | CLKSOURCE)
        if changed:
            self._start(value)

    # -- counting ---------------------------------------------------------------------------------------

    def _elapsed(self) -> int:
        """Clocks since the start. Times are rounded down by less than 1 ps, which is given back here."""
        return (self._clock.now_ps - self._origin_ps + 1) * self._hz // PS_PER_S

    def _now(self) -> int:
        if self._event is None:
            return self._value
        left = self._first - self._elapsed()
        if left == self._period and self._value == 0:
            return 0  # started from 0 and not reloaded yet
        return left % self._period

    def _start(self, value: int) -> None:
        """Count down from ``value``; 0 is reloaded first."""
        self._stop()
        self._value = value
        if not self._control & ENABLE or (value == 0 and self._reload == 0):
            return
        self._origin_ps = self._clock.now_ps
        self._hz = self._soc.clocks.hclk_hz // (1 if self._control & CLKSOURCE else 8)
        self._wraps = 0
        self._period = self._reload + 1
        self._first = value or self._period
        self._schedule()

    def _stop(self) -> None:
        if self._event is not None:
            self._event.cancel()
            self._event = None

    def _schedule(self) -> None:
        cycles = self._first + self._wraps * self._period
        self._event = self._clock.schedule(self._origin_ps + cycles * PS_PER_S // self._hz, self._wrap)

    def _wrap(self) -> None:
        self._control |= COUNTFLAG
        if self._control & TICKINT:
            self._nvic.pend(SYS_TICK)
        if self._reload and self._reload + 1 == self._period:
            self._wraps += 1
            self._schedule()
        else:
            self._event = None
            self._start(0)

    def _retime(self) -> None:
        """HCLK has changed: the counter goes on from where it is."""
        if self._event is not None:
            self._start(self._now())
