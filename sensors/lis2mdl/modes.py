"""The LIS2MDL's modes and its output registers (AN5069 sections 3, 6 and 7).

Decisions where the documents are silent: a second MD = 01 during a single measurement does not restart it (ST's
examples write MD = 01 in their polling loop). After REBOOT, the sensor makes one measurement and is then idle.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from fractions import Fraction

from fcu_emulator.sensors.lis2mdl.magnetometer import MagnetometerSettings, Pulses
from fcu_emulator.sensors.lis2mdl.registers import CFG_REG_A, CFG_REG_C, OUT, STATUS_REG, TEMP_OUT
from fcu_emulator.sensors.register_file import RegisterFile
from fcu_emulator.sensors.sampling import PS_PER_S, DataReady, OutputWords, SampleStream


@dataclass(frozen=True)
class Streams:
    """Streams of field, temperature (with COMP_TEMP_EN = 1) and comparison."""

    field: SampleStream
    temperature: SampleStream
    compared: SampleStream
    pulses: Pulses

    @property
    def all(self) -> tuple[SampleStream, ...]:
        return self.field, self.temperature, self.compared

    def next_number(self) -> int:
        """Return the next sample's number; restarts do not reset it."""
        return self.pulses.first + self.field.index + 1

    def start(self, now_ps: int, first_delay_ps: int, rate: Fraction | None, *, temperature: bool) -> None:
        """Leave idle: take one sample after ``first_delay_ps``, then sample at ``rate``."""
        self.pulses.leave_idle(self.next_number())
        # the samples of both streams have equal numbers, even if ``compared`` was not read
        self.compared.index = self.field.index
        self.temperature.stop()
        running = (
            (self.field, self.compared, self.temperature) if temperature else (self.field, self.compared)
        )
        for stream in running:
            if rate is None:
                stream.start_single(now_ps, first_delay_ps)
            else:
                stream.start(now_ps, rate, first_delay_ps)

    def switch_temperature(self, now_ps: int, rate: Fraction, *, on: bool) -> None:
        """Handle COMP_TEMP_EN in continuous measurement."""
        if not on:
            self.temperature.stop()
        elif not self.temperature.running:
            self.temperature.start(now_ps, rate, self.field.next_ps - now_ps)

    def stop(self) -> None:
        for stream in self.all:
            stream.stop()

    def invalidate(self) -> None:
        for stream in self.all:
            stream.invalidate()


_DATA_READY = DataReady(
    STATUS_REG,
    words=(STATUS_REG.xda.mask, STATUS_REG.yda.mask, STATUS_REG.zda.mask),
    any=STATUS_REG.Zyxda.mask,
    overrun_shift=4,
)


class Outputs:
    """Output registers; ``after_sample(count)`` is called after new samples of the field."""

    def __init__(
        self, registers: RegisterFile, streams: Streams, after_sample: Callable[[int], None]
    ) -> None:
        self._mem = registers.mem
        self.field = OutputWords(registers, OUT, streams.field, _DATA_READY, after_sample)
        self._temperature = OutputWords(registers, TEMP_OUT, streams.temperature, None)

    def configure(self) -> None:
        control = self._mem[CFG_REG_C.addr]
        for output in (self.field, self._temperature):
            output.set_format(
                bdu=bool(control & CFG_REG_C.BDU.mask), big_endian=bool(control & CFG_REG_C.BLE.mask)
            )

    def refresh(self, now_ps: int) -> None:
        self.field.refresh(now_ps)
        self._temperature.refresh(now_ps)

    def reset(self) -> None:
        self.field.reset()
        self._temperature.reset()


BOOT_PS = 20 * PS_PER_S // 10**3  # AN5069 sections 3 and 7: power-on and REBOOT
CONTINUOUS, SINGLE, IDLE = 0, 1, 3  # CFG_REG_A.MD; 2 is also idle
_AFTER_BOOT = 4  # the single measurement after a boot; meanwhile MD reads idle


class Modes:
    """State machine of modes, which starts and stops the streams; a boot ends at ``booted_ps``."""

    def __init__(self, mem: bytearray, streams: Streams, booted_ps: int) -> None:
        self._mem = mem
        self._streams = streams
        self._booted_ps = booted_ps
        self._mode = IDLE

    @property
    def continuous(self) -> bool:
        return self._mode == CONTINUOUS

    def configure(self, was: MagnetometerSettings, settings: MagnetometerSettings, now_ps: int) -> None:
        """Decode the registers; ``was``: the previous settings."""
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
        self._mode, self._booted_ps = _AFTER_BOOT, now_ps + BOOT_PS
        self._start(now_ps, BOOT_PS, None)

    def stop(self) -> None:
        self._mode = IDLE
        self._streams.stop()

    def measured(self) -> None:
        """Return to idle after a single measurement (AN5069 3.3)."""
        if self._mode != CONTINUOUS:
            self._mode = IDLE
            self._mem[CFG_REG_A.addr] = CFG_REG_A.MD.put(self._mem[CFG_REG_A.addr], IDLE)
            self._streams.field.stop()

    def _switch(self, settings: MagnetometerSettings, now_ps: int) -> None:
        if self._mode == IDLE:
            self._streams.stop()
        else:
            delay_ps = max(self._booted_ps - now_ps, 0) + settings.turn_on_ps
            self._start(now_ps, delay_ps, settings.rate if self._mode == CONTINUOUS else None)

    def _start(self, now_ps: int, first_delay_ps: int, rate: Fraction | None) -> None:
        self._streams.start(now_ps, first_delay_ps, rate, temperature=self._with_temperature())

    def _with_temperature(self) -> bool:
        return bool(self._mem[CFG_REG_A.addr] & CFG_REG_A.COMP_TEMP_EN.mask)
