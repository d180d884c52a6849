"""TIM1 to TIM5 and TIM9 to TIM11 (native/peripherals/tim.c)."""

from __future__ import annotations

import ctypes
from dataclasses import dataclass
from typing import Any

from fcu_emulator.emulator.chip.library import PERIPHERAL_CLASSES, FcuChip, NativePeripheral
from fcu_emulator.emulator.clock import PS_PER_S
from fcu_emulator.emulator.trace import TickLate, TickLost


@dataclass(frozen=True)
class Pwm:
    """A PWM output; ``duty`` is the share of time with a high level."""

    frequency_hz: float
    duty: float


class _TickCounts(ctypes.Structure):
    """struct TickCounts of tim.h."""

    _fields_ = tuple((name, ctypes.c_int64) for name in ("ticks", "late", "lost", "longest_wait_ps"))


_COUNTED = ctypes.CFUNCTYPE(None, ctypes.c_int64, ctypes.c_int32, ctypes.c_int64)


class TimerCalls(ctypes.Structure):
    """struct TimCalls of tim.h."""

    _fields_ = (("late", _COUNTED), ("lost", _COUNTED))


class Timer(NativePeripheral):
    """One timer, with counts of its update interrupts."""

    def __init__(self, chip: FcuChip, index: int, name: str, base: int) -> None:
        super().__init__(chip, index, name, base)
        address = chip.library.fcu_timer_counts(chip.handle, index)
        self._counts: Any = _TickCounts.from_address(address)

    @property
    def ticks(self) -> int:
        """Number of updates while the update interrupt was enabled."""
        count: int = self._counts.ticks
        return count

    @property
    def late(self) -> int:
        count: int = self._counts.late
        return count

    @property
    def lost(self) -> int:
        """Number of ticks at which the flag of the previous tick was still set."""
        count: int = self._counts.lost
        return count

    @property
    def longest_wait_s(self) -> float:
        wait_ps: int = self._counts.longest_wait_ps
        return wait_ps / PS_PER_S

    @property
    def rate_hz(self) -> float:
        """The configured update rate; 0 while ARR is 0."""
        rate: float = self._chip.library.fcu_timer_rate(self._chip.handle, self.index)
        return rate

    def pwm(self, channel: int) -> Pwm | None:
        """Return a channel's PWM output, or None (RM0368 12.3.9). TIM1 needs BDTR.MOE. Raises IndexError."""
        frequency, duty = ctypes.c_double(), ctypes.c_double()
        result = self._chip.library.fcu_timer_pwm(
            self._chip.handle, self.index, channel, ctypes.addressof(frequency), ctypes.addressof(duty)
        )
        if result < 0:
            raise IndexError(f"{self.name} has no channel {channel}")
        return Pwm(frequency.value, duty.value) if result else None

    def next_change_ps(self) -> int:
        at_ps: int = self._chip.library.fcu_timer_next_change(self._chip.handle, self.index)
        return at_ps


def connect_timers(chip: FcuChip) -> dict[str, Timer]:
    """Return the timers, keyed by name. From now on, they report late and lost ticks to the trace."""
    clock, trace = chip.clock, chip.trace

    def late(peripheral: int, wait_ps: int) -> None:
        trace.add(TickLate(clock.now_ps, chip.peripheral_by_index(peripheral).name, wait_ps))

    def lost(peripheral: int, count: int) -> None:
        trace.add(TickLost(clock.now_ps, chip.peripheral_by_index(peripheral).name, count))

    calls = TimerCalls(chip.callback(_COUNTED, late), chip.callback(_COUNTED, lost))
    chip.library.fcu_connect_timers(chip.handle, ctypes.addressof(calls))
    return {
        name: peripheral for name, peripheral in chip.peripherals.items() if isinstance(peripheral, Timer)
    }


PERIPHERAL_CLASSES["TIM"] = Timer
