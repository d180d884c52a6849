"""Which samples make the LSM6DSL's FIFO store data sets (AN5040 Rev 3, section 8 and figure 32).

The faster of the two sensors leads; with both at the same rate the gyroscope, to which the accelerometer is
synchronised (section 3). ODR_FIFO can only slow the FIFO down: then every 2nd, 4th ... sample triggers,
counted from the moment the FIFO was switched on.
"""

from __future__ import annotations

from fractions import Fraction
from math import log2

from sensors.lsm6dsl.accelerometer import ODR_HZ
from sensors.lsm6dsl.feature import Chip
from sensors.sampling import NEVER_PS


class SampleTriggers:
    """Counts the leading sensor's samples; ``rate_code``: ODR_FIFO, 0 for off."""

    def __init__(self, chip: Chip) -> None:
        self._chip = chip
        self._leader = chip.xl  # as it is shown
        self._every = 0  # samples from trigger to trigger; 0: none triggers
        self._next = 0  # the next one that does

    def follow(self, rate_code: int, now_ps: int, *, restart: bool) -> None:
        """Lead by the sensors' present rates; without ``restart`` go on in step where that is possible."""
        xl, g = self._chip.xl, self._chip.g
        leader = g if g.rate_hz >= xl.rate_hz else xl
        self._leader = self._chip.gates.shown(leader)
        self._every = _samples_per_trigger(leader.rate_hz, rate_code)
        if self._leader is not leader:  # data enable lets single samples through: each one triggers
            self._every = min(self._every, 1) if self._leader.running else 0
        latest = self._leader.latest(now_ps)
        if restart or not latest < self._next <= latest + self._every:  # or the stream began anew
            self._next = latest + 1

    def begin(self, at_ps: int) -> None:
        """The first sample from ``at_ps`` on triggers."""
        self._next = self._leader.latest(at_ps - 1) + 1

    def due(self, until_ps: int) -> int:
        """How many triggers have come until ``until_ps``, and with it, that nobody has taken."""
        if not self._every:
            return 0
        return max(0, (self._leader.latest(until_ps) - self._next) // self._every + 1)

    def take(self, count: int) -> list[int]:
        """When the next ``count`` triggers come; they are dealt with."""
        first, self._next = self._next, self._next + count * self._every
        return [self._leader.time_ps(sample) for sample in range(first, self._next, self._every)]

    def skip(self, count: int) -> None:
        """So many triggers are dealt with."""
        self._next += count * self._every

    def time_ps(self, number: int) -> int:
        """When the next trigger but ``number`` comes (``NEVER_PS`` if none does)."""
        if not self._every:
            return NEVER_PS
        return self._leader.time_ps(self._next + number * self._every)


def _samples_per_trigger(sensor_hz: Fraction, rate_code: int) -> int:
    """Each rate is nominally twice the one below, so they are related by a power of two."""
    if not sensor_hz or not rate_code:
        return 0
    return 1 << max(0, round(log2(sensor_hz / Fraction(ODR_HZ[rate_code]))))
