"""The data-ready signals DRDY_XL, DRDY_G and DRDY_TEMP (AN5040 4.3).

Latched, a signal follows its flag in STATUS_REG: it rises with a sample and falls when a high byte is read.
With DRDY_PULSED every sample gives a pulse of 75 us instead, whether anybody reads or not; the flag itself is
always latched. With DRDY_MASK there is neither flag nor signal until a sensor has settled: as many samples
after a change as AN5040 says are to be discarded (``settling``).
"""

from __future__ import annotations

from sensors.lsm6dsl.feature import Chip
from sensors.lsm6dsl.pins import routes
from sensors.lsm6dsl.registers import (
    CTRL1_XL,
    CTRL2_G,
    CTRL4_C,
    DRDY_PULSE_CFG_G,
    INT1_CTRL,
    INT2_CTRL,
    OUT_G,
    OUT_TEMP,
    OUT_XL,
    STATUS_REG,
)
from sensors.lsm6dsl.signals import SignalName
from sensors.register import Register
from sensors.register_file import AfterHook
from sensors.sampling import NEVER_PS, PS_PER_S, SampleStream

PULSE_PS = 75 * PS_PER_S // 10**6


class _Source:
    """One sensor's signal: ``next`` is the first sample that has not been signalled yet."""

    def __init__(self, name: SignalName, flag: int, stream: SampleStream) -> None:
        self.name: SignalName = name
        self.flag = flag
        self.sensor = self.stream = stream  # which may be shown through another one
        self.next = 0
        self.routed = False


class DataReadySignals:
    """``active`` while a data-ready signal is routed to a pin."""

    CONFIGURATION: tuple[type[Register], ...] = (
        CTRL1_XL,
        CTRL2_G,
        CTRL4_C,
        DRDY_PULSE_CFG_G,
        INT1_CTRL,
        INT2_CTRL,
    )

    def __init__(self, chip: Chip) -> None:
        self.active = False
        self._chip = chip
        self._pulsed = self._masked = self._wired = False
        self._sources = (
            _Source("DRDY_XL", STATUS_REG.XLDA.mask, chip.xl),
            _Source("DRDY_G", STATUS_REG.GDA.mask, chip.g),
            _Source("DRDY_TEMP", STATUS_REG.TDA.mask, chip.temperature),
        )

    def configure(self, now_ps: int) -> None:
        """Decode routing and shape; the flags in STATUS_REG are those of ``now_ps``."""
        mem = self._chip.registers.mem
        int1, int2 = routes(mem)
        was_pulsed = self._pulsed
        self._pulsed = bool(mem[DRDY_PULSE_CFG_G.addr] & DRDY_PULSE_CFG_G.DRDY_PULSED.mask)
        self._masked = bool(mem[CTRL4_C.addr] & CTRL4_C.DRDY_MASK.mask)
        for source in self._sources:
            source.stream = self._chip.gates.shown(source.sensor)
            was_routed, source.routed = source.routed, source.name in int1 | int2
            source.next = source.stream.latest(now_ps) + 1
            if self._masked:
                source.next = max(source.next, source.stream.settled_index)
            if self._masked or (was_routed, was_pulsed) != (source.routed, self._pulsed):
                self._follow_flag(source, now_ps)
        self.active = any(source.routed for source in self._sources)
        if self.active and not self._wired:
            self._wire()

    def catch_up(self, now_ps: int) -> None:
        """Signal the samples that have come since the last time."""
        for source in self._sources:
            stream = source.stream
            if not source.routed or not stream.running:
                continue
            latest = stream.latest(now_ps)
            if latest < source.next:
                continue
            if self._pulsed:
                self._pulse(source, latest)
            else:
                self._chip.signals.set(source.name, True, stream.time_ps(source.next))
            source.next = latest + 1

    def reset(self, now_ps: int) -> None:
        """The flags are cleared."""
        for source in self._sources:
            self._chip.signals.set(source.name, False, now_ps)

    def next_event_ps(self) -> int:
        """The next sample of a sensor whose signal is low."""
        signals = self._chip.signals
        return min(
            (
                source.stream.time_ps(source.next)
                for source in self._sources
                if source.routed and source.stream.running and not signals[source.name]
            ),
            default=NEVER_PS,
        )

    def _wire(self) -> None:
        """Watch the reads of samples, from the first time on that a signal is routed."""
        self._wired = True
        for register, source in zip((OUT_XL, OUT_G, OUT_TEMP), self._sources, strict=True):
            self._chip.registers.after_read(register, self._hook(source))

    def _hook(self, source: _Source) -> AfterHook:
        def after_read(first: int, end: int, now_ps: int) -> None:
            del first, end
            self._after_read(source, now_ps)

        return after_read

    def _pulse(self, source: _Source, latest: int) -> None:
        # Where nobody listens to the pins, only the latest pulse can still be seen.
        wired = self._chip.int1.wired or self._chip.int2.wired
        for index in range(source.next if wired else latest, latest + 1):
            at_ps = source.stream.time_ps(index)
            self._chip.signals.set(source.name, True, at_ps)
            self._chip.signals.set(source.name, False, at_ps + PULSE_PS)

    def _follow_flag(self, source: _Source, now_ps: int) -> None:
        flag = self._chip.registers.mem[STATUS_REG.addr] & source.flag
        hidden = self._masked and source.stream.index < source.stream.settled_index
        on = source.routed and bool(flag) and not (self._pulsed or hidden)
        self._chip.signals.set(source.name, on, now_ps)

    def _after_read(self, source: _Source, now_ps: int) -> None:
        """The read may have cleared the flag; the samples before it still count."""
        self._chip.catch_up(now_ps)
        if source.routed and not self._pulsed:
            self._follow_flag(source, now_ps)
            self._chip.catch_up(now_ps)
