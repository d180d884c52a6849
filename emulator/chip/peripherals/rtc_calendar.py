"""The calendar of the RTC in BCD (RM0368 17.6.1, 17.6.2)."""

from __future__ import annotations

from datetime import UTC, datetime, timedelta

from fcu_emulator.emulator.chip.registers import rtc

_CENTURY = datetime(2000, 1, 1, tzinfo=UTC)
_DAYS_IN_CENTURY = 36525  # every fourth year is a leap year


def bcd(value: int) -> int:
    """Return two decimal digits as BCD."""
    return value // 10 << 4 | value % 10


def from_bcd(value: int) -> int:
    """Return the decimal value of a BCD number."""
    return (value >> 4) * 10 + (value & 0xF)


def hour_of(time_register: int, *, twelve: bool) -> int:
    """Return the hour of TR; ``twelve``: in 12 hour format, in which midnight is 12 am (17.6.1)."""
    hour = from_bcd(time_register >> 16 & 0x3F)
    if not twelve:
        return hour
    return hour % 12 + 12 * rtc.TR.PM.get(time_register)


def seconds_of(time_register: int, date_register: int, *, twelve: bool = False) -> int:
    """Return the seconds since the century began, from TR and DR."""
    months = max(from_bcd(date_register >> 8 & 0x1F), 1) - 1
    year = 2000 + from_bcd(date_register >> 16 & 0xFF) + months // 12
    day = datetime(year, months % 12 + 1, 1, tzinfo=UTC)
    day += timedelta(
        days=max(from_bcd(date_register & 0x3F), 1) - 1,
        hours=hour_of(time_register, twelve=twelve),
        minutes=from_bcd(time_register >> 8 & 0x7F),
        seconds=from_bcd(time_register & 0x7F),
    )
    return int((day - _CENTURY).total_seconds())


def time_register(seconds: int, *, twelve: bool = False) -> int:
    """Return TR in 24 hour format or in 12 hour format."""
    minutes, second = divmod(seconds, 60)
    hours, minute = divmod(minutes, 60)
    hour = hours % 24
    afternoon = twelve and hour >= 12
    shown = (hour % 12 or 12) if twelve else hour
    return rtc.TR.PM.put(0, int(afternoon)) | bcd(shown) << 16 | bcd(minute) << 8 | bcd(second)


def date_register(seconds: int, weekday: int) -> int:
    """Return DR; ``weekday`` 1 is Monday."""
    day = _CENTURY + timedelta(days=seconds // 86400 % _DAYS_IN_CENTURY)
    return bcd(day.year % 100) << 16 | weekday << 13 | bcd(day.month) << 8 | bcd(day.day)
