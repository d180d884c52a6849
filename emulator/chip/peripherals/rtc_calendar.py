"""The RTC's calendar arithmetic: BCD registers to a point in time and back (RM0368 17.6.1, 17.6.2).

Values that are no date (month 13, 99 seconds) carry over into the next larger unit here; on the chip they
are undefined.
"""

from __future__ import annotations

from datetime import UTC, datetime, timedelta

_CENTURY = datetime(2000, 1, 1, tzinfo=UTC)
_DAYS_IN_CENTURY = 36525  # every fourth year of this one is a leap year, as the RTC has it


def bcd(value: int) -> int:
    """Two decimal digits as BCD."""
    return value // 10 << 4 | value % 10


def from_bcd(value: int) -> int:
    """BCD as a number."""
    return (value >> 4) * 10 + (value & 0xF)


def seconds_of(time_register: int, date_register: int) -> int:
    """Seconds since the century began, from TR and DR in 24 hour format."""
    months = max(from_bcd(date_register >> 8 & 0x1F), 1) - 1
    year = 2000 + from_bcd(date_register >> 16 & 0xFF) + months // 12
    day = datetime(year, months % 12 + 1, 1, tzinfo=UTC)
    day += timedelta(
        days=max(from_bcd(date_register & 0x3F), 1) - 1,
        hours=from_bcd(time_register >> 16 & 0x3F),
        minutes=from_bcd(time_register >> 8 & 0x7F),
        seconds=from_bcd(time_register & 0x7F),
    )
    return int((day - _CENTURY).total_seconds())


def time_register(seconds: int) -> int:
    """TR in 24 hour format."""
    minutes, second = divmod(seconds, 60)
    hours, minute = divmod(minutes, 60)
    return bcd(hours % 24) << 16 | bcd(minute) << 8 | bcd(second)


def date_register(seconds: int, weekday: int) -> int:
    """DR; ``weekday`` is 1 (Monday) to 7."""
    day = _CENTURY + timedelta(days=seconds // 86400 % _DAYS_IN_CENTURY)
    return bcd(day.year % 100) << 16 | weekday << 13 | bcd(day.month) << 8 | bcd(day.day)
