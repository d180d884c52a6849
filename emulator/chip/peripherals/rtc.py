"""RTC: calendar, backup registers, write protection (RM0368 section 17).

INITF and RSF are set at once; on the chip this takes two RTC clocks. Invalid dates carry over into the next unit. Notes
report alarms, wake-up timer, tamper, time stamp, calibration and 12 hour format as not modelled.
"""

from __future__ import annotations

from datetime import UTC, datetime, timedelta

from fcu_emulator.emulator.chip.peripherals.peripheral import WORD, Peripheral, Soc
from fcu_emulator.emulator.chip.peripherals.pwr import Pwr
from fcu_emulator.emulator.chip.peripherals.rcc import Rcc
from fcu_emulator.emulator.chip.registers import DECLARED, rtc
from fcu_emulator.emulator.chip.registers.declaration import masks, offsets
from fcu_emulator.emulator.clock import NEVER_PS, PS_PER_S

# -- the calendar in BCD (17.6.1, 17.6.2) -------------------------------------------------------------------

_CENTURY = datetime(2000, 1, 1, tzinfo=UTC)
_DAYS_IN_CENTURY = 36525  # every fourth year is a leap year


def bcd(value: int) -> int:
    """Return two decimal digits as BCD."""
    return value // 10 << 4 | value % 10


def from_bcd(value: int) -> int:
    """Return the decimal value of a BCD number."""
    return (value >> 4) * 10 + (value & 0xF)


def seconds_of(time_register: int, date_register: int) -> int:
    """Return the seconds since the century began, in 24 hour format."""
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
    """Return TR in 24 hour format."""
    minutes, second = divmod(seconds, 60)
    hours, minute = divmod(minutes, 60)
    return bcd(hours % 24) << 16 | bcd(minute) << 8 | bcd(second)


def date_register(seconds: int, weekday: int) -> int:
    """Return DR; ``weekday`` 1 is Monday."""
    day = _CENTURY + timedelta(days=seconds // 86400 % _DAYS_IN_CENTURY)
    return bcd(day.year % 100) << 16 | weekday << 13 | bcd(day.month) << 8 | bcd(day.day)


# -- the peripheral ----------------------------------------------------------------------------------------------

TR, DR, CR, ISR, PRER, WPR, SSR = offsets(rtc.TR, rtc.DR, rtc.CR, rtc.ISR, rtc.PRER, rtc.WPR, rtc.SSR)

_INITS, _RSF, _INITF, _INIT = masks(rtc.ISR.INITS, rtc.ISR.RSF, rtc.ISR.INITF, rtc.ISR.INIT)
_CR_MODELLED = rtc.CR.BYPSHAD.mask | rtc.CR.BKP.mask  # BYPSHAD and BKP have no visible effect
_KEYS = (0xCA, 0x53)
_BACKUP = range(rtc.BKPxR.addr, rtc.BKPxR.addr + rtc.BKPxR.count * rtc.BKPxR.step, rtc.BKPxR.step)


class Rtc(Peripheral, declared=DECLARED["RTC"]):
    """Real-time clock; only a backup domain reset resets it."""

    def __init__(self, soc: Soc, name: str, base: int, pwr: Pwr, rcc: Rcc) -> None:
        super().__init__(soc, name, base)
        self._pwr = pwr
        self._rcc = rcc
        self._power_on()
        rcc.on_change(self._clock_changed)
        rcc.on_backup_reset(self._power_on)

    def _power_on(self) -> None:
        self.registers = dict(self.REGISTERS)
        self._hz = self._rcc.rtc_hz()
        self._keys = 0  # number of correct keys of the unlock sequence so far
        self._cycles = 0  # RTC clocks from the start of the century to ``_since_ps``
        self._since_ps = self.soc.clock.now_ps
        self._first_weekday = 1  # weekday of the century's first day

    def reset(self) -> None:
        """Lock the backup domain (17.3.5)."""
        self._keys = 0

    # -- registers --------------------------------------------------------------------------------------

    def peek(self, offset: int) -> int:
        if offset not in {TR, DR, SSR} or self.registers[ISR] & _INITF:
            return super().peek(offset)
        seconds, below = divmod(self._now_cycles(), self._cycles_per_s())
        if offset == TR:
            return time_register(seconds)
        if offset == DR:
            weekday = (self._first_weekday - 1 + seconds // 86400) % 7 + 1
            return date_register(seconds, weekday)
        return rtc.PRER.PREDIV_S.get(self.registers[PRER]) - below // self._asynchronous()

    def read(self, offset: int) -> int:
        return self.peek(offset)

    def read_with_validity(self, offset: int) -> tuple[int, int]:
        """Return the calendar registers, and the time of their next change."""
        value = self.read(offset)
        if offset not in {TR, DR, SSR} or self.registers[ISR] & _INITF or not self._hz:
            return value, NEVER_PS
        step = self._asynchronous() if offset == SSR else self._cycles_per_s()
        cycles = (self._now_cycles() // step + 1) * step - self._cycles
        return value, self._since_ps - (-cycles * PS_PER_S // self._hz)

    def pure_read(self, offset: int) -> bool:
        return offset not in {TR, DR, SSR}

    def write(self, offset: int, value: int, mask: int = WORD) -> None:
        """Write if DBP and keys allow it; the calendar is writable in initialisation mode only (17.3.5)."""
        value &= mask
        if offset == WPR:
            expected = _KEYS[self._keys] if self._keys < len(_KEYS) else None
            self._keys = self._keys + 1 if value & 0xFF == expected else 0
        elif not self._pwr.backup_writable:
            self.note("refused", f"{self._named(offset)} written while PWR_CR.DBP is 0")
        elif offset in _BACKUP:
            super().write(offset, value, mask)
        elif self._keys < len(_KEYS):
            self.note("refused", f"{self._named(offset)} written without the keys 0xCA, 0x53 in WPR")
        elif offset == ISR:
            self._initialise(bool(value & _INIT))
        elif offset in {TR, DR, PRER}:
            self._set_calendar(offset, value, mask)
        else:
            super().write(offset, value, mask)
            if offset != CR or self.registers[CR] & ~_CR_MODELLED:
                self.note("not modelled", f"{self._named(offset)} written")

    def _named(self, offset: int) -> str:
        return self.NAMES.get(offset, f"0x{offset:02X}")

    def _set_calendar(self, offset: int, value: int, mask: int) -> None:
        if not self.registers[ISR] & _INITF:
            self.note("refused", f"{self._named(offset)} written outside initialisation mode (ISR.INIT)")
            return
        super().write(offset, value, mask)
        if offset == TR and value & rtc.TR.PM.mask:
            self.note("not modelled", "TR.PM: the 12 hour format")

    # -- calendar ---------------------------------------------------------------------------------------

    def _initialise(self, wanted: bool) -> None:
        """Stop the calendar, or start it at the newly set time."""
        running = not self.registers[ISR] & _INITF
        if wanted and running:
            shown = {offset: self.peek(offset) for offset in (TR, DR)}
            self.registers |= shown
            self.registers[ISR] = self.registers[ISR] & ~_RSF | _INIT | _INITF
        elif not wanted and not running:
            seconds = seconds_of(self.registers[TR], self.registers[DR])
            weekday = rtc.DR.WDU.get(self.registers[DR]) or 1
            self._first_weekday = (weekday - 1 - seconds // 86400) % 7 + 1
            self._cycles = seconds * self._cycles_per_s()
            self._since_ps = self.soc.clock.now_ps
            initialised = _INITS if self.registers[DR] >> 16 & 0xFF else 0  # the year is not 0 (17.6.4)
            self.registers[ISR] = self.registers[ISR] & ~(_INIT | _INITF | _INITS) | _RSF | initialised
        elif running:
            self.registers[ISR] |= _RSF  # the chip sets it again soon after software clears it

    def _asynchronous(self) -> int:
        return rtc.PRER.PREDIV_A.get(self.registers[PRER]) + 1

    def _cycles_per_s(self) -> int:
        """Return the number of RTC clocks per second (17.3.1)."""
        return self._asynchronous() * (rtc.PRER.PREDIV_S.get(self.registers[PRER]) + 1)

    def _now_cycles(self) -> int:
        elapsed_ps = self.soc.clock.now_ps - self._since_ps
        return self._cycles + elapsed_ps * self._hz // PS_PER_S

    def _clock_changed(self) -> None:
        if self._hz == self._rcc.rtc_hz():
            return
        if not self.registers[ISR] & _INITF:
            self._cycles = self._now_cycles()
            self._since_ps = self.soc.clock.now_ps
        self._hz = self._rcc.rtc_hz()
