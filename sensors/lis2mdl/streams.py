"""The LIS2MDL's sample streams: field, temperature, and what the interrupt sees; they run in step."""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction

from sensors.lis2mdl.pulses import Pulses
from sensors.sampling import SampleStream


@dataclass(frozen=True)
class Streams:
    """``temperature`` runs along only with COMP_TEMP_EN = 1, ``compared`` always, though rarely looked at."""

    field: SampleStream
    temperature: SampleStream
    compared: SampleStream
    pulses: Pulses

    def next_number(self) -> int:
        """Number of the next sample, counted over all runs, as the producers of the streams see it."""
        return self.pulses.first + self.field.index + 1

    def start(self, now_ps: int, first_delay_ps: int, rate: Fraction | None, *, temperature: bool) -> None:
        """Leave idle: the first sample after ``first_delay_ps``, then more at ``rate`` or none (None)."""
        self.pulses.leave_idle(self.next_number())
        self.compared.index = self.field.index  # numbers go on together, though this one was not looked at
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
        """COMP_TEMP_EN written during continuous measurement; the temperature comes with the field."""
        if not on:
            self.temperature.stop()
        elif not self.temperature.running:
            self.temperature.start(now_ps, rate, self.field.next_ps - now_ps)

    def stop(self) -> None:
        """Idle."""
        for stream in (self.field, self.temperature, self.compared):
            stream.stop()

    def invalidate(self) -> None:
        """Samples still to come are computed anew."""
        for stream in (self.field, self.temperature, self.compared):
            stream.invalidate()
