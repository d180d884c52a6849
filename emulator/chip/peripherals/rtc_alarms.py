"""Times of the RTC's alarms and wake-up timer, in clock cycles (RM0368 17.3.3, 17.3.4, 17.6)."""

from __future__ import annotations

from dataclasses import dataclass

from fcu_emulator.emulator.chip.registers import rtc

_WAKE_UP_SHIFT = (4, 3, 2, 1)  # the clock's divider for WUCKSEL 0 to 3
_EXTENDED = 6  # WUCKSEL 6 and 7 add 2 ** 16


def wake_up_unit(cr: int, cycles_per_s: int) -> int:
    """Return the number of cycles per count of the wake-up timer (17.6.3)."""
    selected = rtc.CR.WUCKSEL.get(cr)
    return 1 << _WAKE_UP_SHIFT[selected] if selected < len(_WAKE_UP_SHIFT) else cycles_per_s


def wake_up_period(cr: int, wutr: int, cycles_per_s: int) -> int:
    """Return the number of cycles between two wake-ups."""
    extended = 1 << 16 if rtc.CR.WUCKSEL.get(cr) >= _EXTENDED else 0
    return ((wutr & 0xFFFF) + 1 + extended) * wake_up_unit(cr, cycles_per_s)


def matches(alarm: int, time: int, date: int) -> bool:
    """Return whether ALRMxR selects these values of TR and DR."""
    if not alarm & rtc.ALRMAR.MSK4.mask:
        by_weekday = alarm & rtc.ALRMAR.WDSEL.mask
        day, wanted = (date >> 13 & 7, alarm >> 24 & 0xF) if by_weekday else (date & 0x3F, alarm >> 24 & 0x3F)
        if day != wanted:
            return False
    fields = (
        (rtc.ALRMAR.MSK3.mask, rtc.ALRMAR.PM.mask | 0x3F_0000),
        (rtc.ALRMAR.MSK2.mask, 0x7F00),
        (rtc.ALRMAR.MSK1.mask, 0x7F),
    )
    return all(alarm & masked or not (alarm ^ time) & compared for masked, compared in fields)


@dataclass(frozen=True)
class Subseconds:
    """The instants of a second that ALRMxSSR selects, in steps of SSR."""

    first: int
    every: int
    """The distance between two of these instants; 0 for a single instant."""

    @classmethod
    def of(cls, alrmssr: int, prediv_s: int) -> Subseconds:
        compared = min(rtc.ALRMASSR.MASKSS.get(alrmssr), 15)
        mask = (1 << compared) - 1
        first = prediv_s - rtc.ALRMASSR.SS.get(alrmssr) & mask
        return cls(first, 1 << compared if compared else 0)

    def after(self, step: int, steps_per_s: int) -> int:
        """Return the next selected instant after ``step``; both count the steps from the same full second."""
        second, within = divmod(step, steps_per_s)
        if within < self.first:
            return second * steps_per_s + self.first
        following = (
            self.first + ((within - self.first) // self.every + 1) * self.every if self.every else steps_per_s
        )
        if following < steps_per_s:
            return second * steps_per_s + following
        return (second + 1) * steps_per_s + self.first
