"""The BOOT signal: high while the trimming values are reloaded; INT1_BOOT puts it on INT1 (AN5040 5.7)."""

from __future__ import annotations

from sensors.lsm6dsl.signals import Signals
from sensors.register import Register
from sensors.sampling import PS_PER_S

BOOT_PS = 15 * PS_PER_S // 10**3


class Boot:
    """``active`` from the start of a boot until somebody has seen its end."""

    CONFIGURATION: tuple[type[Register], ...] = ()

    def __init__(self, signals: Signals) -> None:
        self.active = False
        self._signals = signals
        self._until_ps = 0

    def begin(self, now_ps: int) -> None:
        """CTRL3_C.BOOT has been written."""
        self.active = True
        self._until_ps = now_ps + BOOT_PS
        self._signals.set("BOOT", True, now_ps)

    def configure(self, now_ps: int) -> None:
        """No register bears on it."""

    def catch_up(self, now_ps: int) -> None:
        """End the boot when its time is over."""
        if now_ps >= self._until_ps:
            self.active = False
            self._signals.set("BOOT", False, self._until_ps)

    def reset(self, now_ps: int) -> None:
        """SW_RESET does not end a boot."""

    def next_event_ps(self) -> int:
        """When the boot is over."""
        return self._until_ps
