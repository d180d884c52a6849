"""CFG_REG_A.MD and REBOOT: what the part does, and what it measures next (AN5069 sections 3 and 7).

Decisions where the documents are silent: a second MD = 01 while a single measurement is under way does not
restart it (ST's own examples poll in such a loop). REBOOT ends in idle "after performing one measurement"
(AN5069 section 7), which is available when the 20 ms are over; MD reads idle meanwhile, and a measurement
asked for in that time begins when it is over.
"""

from __future__ import annotations

from fractions import Fraction

from sensors.lis2mdl.magnetometer import MagnetometerSettings
from sensors.lis2mdl.registers import CFG_REG_A
from sensors.lis2mdl.streams import Streams
from sensors.sampling import NEVER_PS, PS_PER_S

BOOT_PS = 20 * PS_PER_S // 10**3  # AN5069 sections 3 and 7: power-on and REBOOT
CONTINUOUS, SINGLE, IDLE = 0, 1, 3  # CFG_REG_A.MD; 2 is idle too
_AFTER_BOOT = 4  # a single measurement while MD says idle


class Modes:
    """Runs ``streams`` as ``mem``, the part's registers, say; a boot is over at ``booted_ps``."""

    def __init__(self, mem: bytearray, streams: Streams, booted_ps: int) -> None:
        self._mem = mem
        self._streams = streams
        self._booted_ps = booted_ps
        self._mode = IDLE
        self._due_ps = NEVER_PS  # the first sample nobody has looked at

    def configure(self, was: MagnetometerSettings, settings: MagnetometerSettings, now_ps: int) -> None:
        """The registers may have changed; ``was``: the settings until now."""
        mode_was, mode = self._mode, CFG_REG_A.MD.get(self._mem[CFG_REG_A.addr])
        if mode in (CONTINUOUS, SINGLE):
            self._mode = mode
        elif mode_was != _AFTER_BOOT:
            self._mode = IDLE
        if self._mode != mode_was or (self._mode == CONTINUOUS and settings.rate != was.rate):
            self._switch(settings, now_ps)
        elif self._mode == CONTINUOUS:
            self._streams.switch_temperature(now_ps, settings.rate, on=self._with_temperature())

    def boot(self, now_ps: int) -> None:
        """REBOOT: 20 ms, one measurement, idle."""
        self._mode, self._booted_ps = _AFTER_BOOT, now_ps + BOOT_PS
        self._start(now_ps, BOOT_PS, None)

    def stop(self) -> None:
        """SOFT_RST: idle at once."""
        self._mode = IDLE
        self._streams.stop()

    def measured(self) -> int:
        """Samples have been taken since the last call: when the first of them came.

        A single measurement ends in idle by itself (AN5069 3.3).
        """
        if self._mode != CONTINUOUS:
            self._mode = IDLE
            self._mem[CFG_REG_A.addr] = CFG_REG_A.MD.put(self._mem[CFG_REG_A.addr], IDLE)
            self._streams.field.stop()
        due_ps, self._due_ps = self._due_ps, self._streams.field.next_ps
        return due_ps

    def _switch(self, settings: MagnetometerSettings, now_ps: int) -> None:
        if self._mode == IDLE:
            self._streams.stop()
        else:
            delay_ps = max(self._booted_ps - now_ps, 0) + settings.turn_on_ps
            self._start(now_ps, delay_ps, settings.rate if self._mode == CONTINUOUS else None)

    def _start(self, now_ps: int, first_delay_ps: int, rate: Fraction | None) -> None:
        self._streams.start(now_ps, first_delay_ps, rate, temperature=self._with_temperature())
        self._due_ps = self._streams.field.next_ps

    def _with_temperature(self) -> bool:
        return bool(self._mem[CFG_REG_A.addr] & CFG_REG_A.COMP_TEMP_EN.mask)
