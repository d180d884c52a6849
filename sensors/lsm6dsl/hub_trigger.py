"""What starts the sensor hub's rounds: data-ready at 104 Hz at most, or the INT2 pin (AN5040 7.1).

The accelerometer's data-ready triggers, or the gyroscope's where that alone is on; at higher rates every
second, fourth ... sample. With START_CONFIG it is INT2 going high.

Decision: INT2 triggers when it rises, or when it is high as the hub is switched on, and not again while it
stays high. The road not taken, round after round, would keep the auxiliary bus busy all the time.
"""

from __future__ import annotations

from sensors.lsm6dsl.feature import Chip
from sensors.lsm6dsl.registers import MASTER_CONFIG
from sensors.sampling import NEVER_PS

_FASTEST_HZ = 104


class Trigger:
    """``by_pin``: INT2 triggers, not the samples."""

    def __init__(self, chip: Chip) -> None:
        self.by_pin = False
        self._chip = chip
        self._stream, self._every, self._next = chip.xl, 1, 0  # the samples, and the next one that triggers

    @property
    def running(self) -> bool:
        """Whether a sensor is on; without one the hub does not work."""
        return self._stream.running

    def configure(self, now_ps: int) -> None:
        """Read START_CONFIG, and follow the sensors' rates."""
        self.by_pin = bool(self._chip.registers.mem[MASTER_CONFIG.addr] & MASTER_CONFIG.START_CONFIG.mask)
        self._stream = self._chip.xl if self._chip.xl.running else self._chip.g
        if self._stream.running:
            self._every = max(1, round(self._stream.rate_hz / _FASTEST_HZ))
        self.aim(now_ps)

    def aim(self, after_ps: int) -> None:
        """The next trigger is the first after ``after_ps``; a restarted stream counts from 0 again."""
        following = self._stream.latest(after_ps) + 1
        self._next = -(-following // self._every) * self._every

    def next_ps(self) -> int:
        """When the next sample triggers."""
        return NEVER_PS if self.by_pin else self._stream.time_ps(self._next)
