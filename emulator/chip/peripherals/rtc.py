"""RTC: calendar, alarms, wake-up timer, backup registers, write protection (RM0368 section 17).

INITF, RSF, WUTWF and ALRxWF are set immediately, and a shift or a calibration takes effect immediately; on
the chip this takes two RTC clocks or more. The excess of an invalid date is carried over to the next unit:
31 June becomes 1 July. A note reports coarse calibration as not modelled.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from fcu_emulator.emulator.chip.peripherals.peripheral import NOT_CACHEABLE_PS, WORD, Peripheral, Soc
from fcu_emulator.emulator.chip.peripherals.pwr import Pwr
from fcu_emulator.emulator.chip.peripherals.rcc import Rcc
from fcu_emulator.emulator.chip.peripherals.rtc_alarms import (
    Subseconds,
    matches,
    wake_up_period,
    wake_up_unit,
)
from fcu_emulator.emulator.chip.peripherals.rtc_calendar import date_register, seconds_of, time_register
from fcu_emulator.emulator.chip.peripherals.rtc_inputs import RtcInputs
from fcu_emulator.emulator.chip.registers import DECLARED, rtc
from fcu_emulator.emulator.chip.registers.declaration import masks, offsets
from fcu_emulator.emulator.clock import NEVER_PS, PS_PER_S, Event

TR, DR, CR, ISR, PRER, WPR, SSR = offsets(rtc.TR, rtc.DR, rtc.CR, rtc.ISR, rtc.PRER, rtc.WPR, rtc.SSR)

_INITS, _RSF, _INITF, _INIT = masks(rtc.ISR.INITS, rtc.ISR.RSF, rtc.ISR.INITF, rtc.ISR.INIT)
_WUTE, _WUTIE, _WUCKSEL = masks(rtc.CR.WUTE, rtc.CR.WUTIE, rtc.CR.WUCKSEL)
_WUTF, _WUTWF = masks(rtc.ISR.WUTF, rtc.ISR.WUTWF)
_TSF, _TSOVF, _TAMP1F = masks(rtc.ISR.TSF, rtc.ISR.TSOVF, rtc.ISR.TAMP1F)
_TSIE, _TAMPIE = masks(rtc.CR.TSIE, rtc.TAFCR.TAMPIE)
_ALARM_LINE, _STAMP_LINE, _WAKE_UP_LINE = 17, 21, 22  # lines of EXTI (10.2.5)


@dataclass(frozen=True)
class _Alarm:
    """An alarm's registers and bits."""

    time: int
    subseconds: int
    on: int
    interrupt: int
    flag: int
    writable: int


_ALARMS = tuple(
    _Alarm(time.addr, subseconds.addr, *masks(*bits))
    for time, subseconds, bits in (
        (rtc.ALRMAR, rtc.ALRMASSR, (rtc.CR.ALRAE, rtc.CR.ALRAIE, rtc.ISR.ALRAF, rtc.ISR.ALRAWF)),
        (rtc.ALRMBR, rtc.ALRMBSSR, (rtc.CR.ALRBE, rtc.CR.ALRBIE, rtc.ISR.ALRBF, rtc.ISR.ALRBWF)),
    )
)
_BITS_THAT_ALLOW = {rtc.WUTR.addr: _WUTWF} | {
    offset: alarm.writable for alarm in _ALARMS for offset in (alarm.time, alarm.subseconds)
}
"""By register: the bit of ISR that must be set before a write."""
_INTERRUPT_OF = {_WUTF: _WUTIE, _TSF: _TSIE} | {alarm.flag: alarm.interrupt for alarm in _ALARMS}
"""Interrupt enable bits in CR, keyed by event flag."""
_EVENT_FLAGS = _WUTF | _TSF | _TSOVF | _TAMP1F | sum(alarm.flag for alarm in _ALARMS)
_EVENT_BITS = _WUTE | _WUTIE | _WUCKSEL | sum(alarm.on | alarm.interrupt for alarm in _ALARMS)
_BYPSHAD, _FMT, _ADD1H, _SUB1H = masks(rtc.CR.BYPSHAD, rtc.CR.FMT, rtc.CR.ADD1H, rtc.CR.SUB1H)
_STAMP_BITS = _TSIE | rtc.CR.TSE.mask | rtc.CR.TSEDGE.mask
_CR_MODELLED = _EVENT_BITS | _STAMP_BITS | _BYPSHAD | _FMT | rtc.CR.BKP.mask  # BKP has no effect
_LOCKED_BY = {SSR: (TR, DR), TR: (DR,)}
"""Shadow registers that a read locks until DR is read (17.3.6), keyed by the read register."""
_CALIBRATION_CYCLES = 1 << 20  # of the smooth calibration (17.3.11)
_CALP_PULSES = 512
_KEYS = (0xCA, 0x53)
_BACKUP = range(rtc.BKPxR.addr, rtc.BKPxR.addr + rtc.BKPxR.count * rtc.BKPxR.step, rtc.BKPxR.step)


class Rtc(Peripheral, declared=DECLARED["RTC"]):
    """The real-time clock. This peripheral is reset only by a reset of the backup domain."""

    def __init__(self, soc: Soc, name: str, base: int, pwr: Pwr, rcc: Rcc) -> None:
        super().__init__(soc, name, base)
        self._pwr = pwr
        self._rcc = rcc
        self._events: dict[int, Event] = {}
        """The next wake-up and the next alarms, by their flags in ISR."""
        self._set_line: Callable[[int, bool], None] = lambda _line, _level: None
        self._inputs = RtcInputs(soc, self)
        self._power_on()
        rcc.on_change(self._clock_changed)
        rcc.on_backup_reset(self._power_on)

    def connect(self, set_exti_line: Callable[[int, bool], None]) -> None:
        """Connect the lines of EXTI: ``set_exti_line(number, level)``."""
        self._set_line = set_exti_line

    def _power_on(self) -> None:
        self.registers = dict(self.REGISTERS)
        self._inputs.reset()
        self._cancel(*self._events)
        self._hz = self._rcc.rtc_hz()
        self._keys = 0  # number of correct keys of the unlock sequence so far
        self._cycles = 0  # RTC clocks from the start of the century to ``_since_ps``
        self._since_ps = self.soc.clock.now_ps
        self._first_weekday = 1  # weekday of the century's first day
        self._locked: dict[int, int] = {}  # values of TR and DR until DR is read
        self._signal()

    def reset(self) -> None:
        """Protect the registers against writes, and unlock the shadow registers (17.3.5, 17.3.7)."""
        self._keys = 0
        self._locked.clear()

    # -- registers --------------------------------------------------------------------------------------

    def peek(self, offset: int) -> int:
        if offset not in {TR, DR, SSR} or self.registers[ISR] & _INITF:
            return super().peek(offset)
        locked = self._locked.get(offset)
        return self._present(offset) if locked is None else locked

    def _present(self, offset: int) -> int:
        """Return TR, DR or SSR, regardless of the shadow registers."""
        seconds, below = divmod(self._now_cycles(), self._cycles_per_s())
        if offset == TR:
            return self._time(seconds)
        if offset == DR:
            return self._date(seconds)
        return rtc.PRER.PREDIV_S.get(self.registers[PRER]) - below // self._asynchronous()

    def read(self, offset: int) -> int:
        value = self.peek(offset)
        self._lock(offset)
        return value

    def _lock(self, offset: int) -> bool:
        """Lock or unlock the shadow registers after a read (17.3.6). Return whether anything has changed."""
        if self.registers[CR] & _BYPSHAD or self.registers[ISR] & _INITF:
            return False
        if offset == DR:
            unlocked = bool(self._locked)
            self._locked.clear()
            return unlocked
        higher = [one for one in _LOCKED_BY.get(offset, ()) if one not in self._locked]
        self._locked |= {one: self._present(one) for one in higher}
        return bool(higher)

    def read_with_validity(self, offset: int) -> tuple[int, int]:
        """Return the value of a register, and the time of its next change."""
        value, frozen = self.peek(offset), offset in self._locked
        if self._lock(offset):
            return value, NOT_CACHEABLE_PS
        if offset not in {TR, DR, SSR} or self.registers[ISR] & _INITF or not self._hz or frozen:
            return value, NEVER_PS
        step = self._asynchronous() if offset == SSR else self._cycles_per_s()
        return value, self._time_ps((self._now_cycles() // step + 1) * step)

    def pure_read(self, offset: int) -> bool:
        return offset not in {TR, DR, SSR}

    def write(self, offset: int, value: int, mask: int = WORD) -> None:
        """Write a register if DBP and the keys allow it; the calendar also needs initialisation mode (17.3.5)."""
        value &= mask
        if offset == WPR:
            expected = _KEYS[self._keys] if self._keys < len(_KEYS) else None
            self._keys = self._keys + 1 if value & 0xFF == expected else 0
        elif not self._pwr.backup_writable:
            self.note(
                "refused",
                "backup-locked",
                f"{self._named(offset)} written while PWR_CR.DBP is 0",
                register=self._named(offset),
            )
        elif offset in _BACKUP:
            super().write(offset, value, mask)
        elif offset == ISR:
            self._write_status(value, mask)
        elif self._keys < len(_KEYS):
            self._refuse_without_keys(offset)
        elif offset in {TR, DR, PRER}:
            self._set_calendar(offset, value, mask)
        elif offset in _BITS_THAT_ALLOW:
            self._write_event(offset, value, mask)
        elif offset == CR:
            self._control(value, mask)
        elif offset == rtc.SHIFTR.addr:
            self._shift(value)
        elif offset == rtc.CALR.addr:
            self._calibrate(value, mask)
        elif offset == rtc.TAFCR.addr:
            before = self.registers[offset]
            super().write(offset, value, mask)
            self._inputs.tamper_written(before)
            self._signal()
        else:
            super().write(offset, value, mask)
            self.note(
                "not modelled", "not-modelled", f"{self._named(offset)} written", register=self._named(offset)
            )

    def _refuse_without_keys(self, offset: int) -> None:
        self.note(
            "refused",
            "no-key",
            f"{self._named(offset)} written without the keys 0xCA, 0x53 in WPR",
            register=self._named(offset),
        )

    def _write_status(self, value: int, mask: int) -> None:
        """Clear flags, which needs no keys; enter or leave initialisation mode (17.3.5)."""
        self.registers[ISR] &= ~_EVENT_FLAGS | value | ~mask
        self._inputs.flags_cleared()
        self._signal()
        wanted = bool(value & _INIT)
        if self._keys == len(_KEYS):
            self._initialise(wanted)
        elif mask & _INIT and wanted is not bool(self.registers[ISR] & _INIT):
            self._refuse_without_keys(ISR)

    def _write_event(self, offset: int, value: int, mask: int) -> None:
        """Write a register of an alarm or timer, which must be off except in initialisation mode."""
        if self.registers[ISR] & (_BITS_THAT_ALLOW[offset] | _INITF):
            super().write(offset, value, mask)
        else:
            self.note(
                "refused",
                "written-while-enabled",
                f"{self._named(offset)} written while its alarm or timer is on",
                register=self._named(offset),
            )

    def _control(self, value: int, mask: int) -> None:
        old = self.registers[CR]
        if mask & _FMT and (value ^ old) & _FMT and not self.registers[ISR] & _INITF:
            self.note(
                "refused", "not-initialising", "FMT in CR written outside initialisation mode (ISR.INIT)"
            )
            mask &= ~_FMT
        super().write(CR, value, mask)
        cr = self.registers[CR]
        if cr & _BYPSHAD:
            self._locked.clear()
        if value & (_ADD1H | _SUB1H):
            self._change_hour(value)
        if cr & ~_CR_MODELLED:
            self.note("not modelled", "not-modelled", "CR written", register="CR")
        changed = cr ^ old
        for on, flag, writable in (
            (_WUTE, _WUTF, _WUTWF),
            *((alarm.on, alarm.flag, alarm.writable) for alarm in _ALARMS),
        ):
            if changed & on:
                self.registers[ISR] = self.registers[ISR] & ~writable | (0 if cr & on else writable)
                self._plan(flag)
        self._inputs.control_written()
        self._signal()

    def _named(self, offset: int) -> str:
        return self.NAMES.get(offset, f"0x{offset:02X}")

    def _set_calendar(self, offset: int, value: int, mask: int) -> None:
        if not self.registers[ISR] & _INITF:
            self.note(
                "refused",
                "not-initialising",
                f"{self._named(offset)} written outside initialisation mode (ISR.INIT)",
                register=self._named(offset),
            )
            return
        super().write(offset, value, mask)

    def _change_hour(self, control: int) -> None:
        """Add or subtract an hour for summer time (17.6.3)."""
        hour = self._now_cycles() // self._cycles_per_s() // 3600 % 24
        hours = int(bool(control & _ADD1H)) - int(bool(control & _SUB1H) and hour > 0)
        self._advance(3600 * hours * self._cycles_per_s())

    def _shift(self, value: int) -> None:
        """Move the calendar by a part of a second (17.3.8)."""
        delay = rtc.SHIFTR.SUBFS.get(value) * self._asynchronous()
        self._advance(rtc.SHIFTR.ADD1S.get(value) * self._cycles_per_s() - delay)

    def _advance(self, cycles: int) -> None:
        if not self.registers[ISR] & _INITF:
            self._rebase()
            self._cycles = max(self._cycles + cycles, 0)
            self._locked.clear()
            self._plan_all()

    def _calibrate(self, value: int, mask: int) -> None:
        """Change the number of RTC clocks in a cycle of 2 ** 20 clocks (17.3.11)."""
        self._rebase()
        super().write(rtc.CALR.addr, value, mask)
        self._plan_all()

    # -- calendar ---------------------------------------------------------------------------------------

    def _initialise(self, wanted: bool) -> None:
        """Stop the calendar, or start it at the newly set time."""
        running = not self.registers[ISR] & _INITF
        if wanted and running:
            shown = {offset: self.peek(offset) for offset in (TR, DR)}
            self.registers |= shown
            self.registers[ISR] = self.registers[ISR] & ~_RSF | _INIT | _INITF
        elif not wanted and not running:
            seconds = seconds_of(self.registers[TR], self.registers[DR], twelve=self._twelve())
            weekday = rtc.DR.WDU.get(self.registers[DR]) or 1
            self._first_weekday = (weekday - 1 - seconds // 86400) % 7 + 1
            self._cycles = seconds * self._cycles_per_s()
            self._since_ps = self.soc.clock.now_ps
            self._locked.clear()
            initialised = _INITS if self.registers[DR] >> 16 & 0xFF else 0  # the year is not 0 (17.6.4)
            self.registers[ISR] = self.registers[ISR] & ~(_INIT | _INITF | _INITS) | _RSF | initialised
        elif running:
            self.registers[ISR] |= _RSF  # the chip sets RSF again soon after software clears RSF

        if wanted is running:
            self._plan_all()

    def _asynchronous(self) -> int:
        return rtc.PRER.PREDIV_A.get(self.registers[PRER]) + 1

    def _cycles_per_s(self) -> int:
        """Return the number of RTC clocks per second (17.3.1)."""
        return self._asynchronous() * (rtc.PRER.PREDIV_S.get(self.registers[PRER]) + 1)

    def _rate(self) -> tuple[int, int]:
        """Return the calibrated frequency of the RTC clock as a fraction, in Hz."""
        calr = self.registers[rtc.CALR.addr]
        if not calr:
            return self._hz, 1
        removed = rtc.CALR.CALM.get(calr) - _CALP_PULSES * rtc.CALR.CALP.get(calr)
        return self._hz * _CALIBRATION_CYCLES, _CALIBRATION_CYCLES + removed

    def _now_cycles(self) -> int:
        elapsed_ps = self.soc.clock.now_ps - self._since_ps
        numerator, denominator = self._rate()
        return self._cycles + elapsed_ps * numerator // (denominator * PS_PER_S)

    def _rebase(self) -> None:
        """Count from the present time on."""
        if not self.registers[ISR] & _INITF:
            self._cycles = self._now_cycles()
            self._since_ps = self.soc.clock.now_ps

    def _clock_changed(self) -> None:
        if self._hz == self._rcc.rtc_hz():
            return
        self._rebase()
        self._hz = self._rcc.rtc_hz()
        self._plan_all()

    def _twelve(self) -> bool:
        return bool(self.registers[CR] & _FMT)

    def _time(self, seconds: int) -> int:
        return time_register(seconds, twelve=self._twelve())

    def _date(self, seconds: int) -> int:
        return date_register(seconds, (self._first_weekday - 1 + seconds // 86400) % 7 + 1)

    def _time_ps(self, cycles: int) -> int:
        numerator, denominator = self._rate()
        return self._since_ps - (-(cycles - self._cycles) * denominator * PS_PER_S // numerator)

    # -- wake-up timer and alarms -----------------------------------------------------------------------

    def _cancel(self, *flags: int) -> None:
        for flag in flags:
            if flag in self._events:
                self._events.pop(flag).cancel()

    def _plan_all(self) -> None:
        for flag in (_WUTF, *(alarm.flag for alarm in _ALARMS)):
            self._plan(flag)

    def _plan(self, flag: int) -> None:
        """Schedule the next event, unless the calendar is stopped or has no clock."""
        self._cancel(flag)
        if not self._hz or self.registers[ISR] & _INITF:
            return
        now, per_s = self._now_cycles(), self._cycles_per_s()
        if flag == _WUTF:
            if self.registers[CR] & _WUTE:
                unit = wake_up_unit(self.registers[CR], per_s)
                self._wake_up_at(now // unit * unit + self._wake_up_period())
            return
        alarm = next(one for one in _ALARMS if one.flag == flag)
        if self.registers[CR] & alarm.on:
            self._compare_after(alarm, now)

    def _wake_up_period(self) -> int:
        return wake_up_period(self.registers[CR], self.registers[rtc.WUTR.addr], self._cycles_per_s())

    def _wake_up_at(self, cycles: int) -> None:
        self._events[_WUTF] = self.soc.clock.schedule(self._time_ps(cycles), lambda: self._wake_up(cycles))

    def _wake_up(self, cycles: int) -> None:
        self.raise_flag(_WUTF)
        self._wake_up_at(cycles + self._wake_up_period())

    def _compare_after(self, alarm: _Alarm, cycles: int) -> None:
        """Schedule a comparison of the calendar at the alarm's next subsecond after ``cycles``."""
        steps_per_s = rtc.PRER.PREDIV_S.get(self.registers[PRER]) + 1
        instants = Subseconds.of(self.registers[alarm.subseconds], steps_per_s - 1)
        following = instants.after(cycles // self._asynchronous(), steps_per_s) * self._asynchronous()
        self._events[alarm.flag] = self.soc.clock.schedule(
            self._time_ps(following), lambda: self._compare(alarm, following)
        )

    def _compare(self, alarm: _Alarm, cycles: int) -> None:
        seconds = cycles // self._cycles_per_s()
        if matches(self.registers[alarm.time], self._time(seconds), self._date(seconds)):
            self.raise_flag(alarm.flag)
        self._compare_after(alarm, cycles)

    def has_event(self) -> bool:
        """Return whether an event flag is set, which prevents Stop and Standby (5.3.5, 5.3.6)."""
        return bool(self.registers[ISR] & _EVENT_FLAGS)

    def can_interrupt(self) -> bool:
        """Return whether an event with an interrupt is scheduled, or an input has its interrupt on."""
        scheduled = any(self.registers[CR] & _INTERRUPT_OF[flag] for flag in self._events)
        return scheduled or bool(self.registers[CR] & _TSIE) or self._tamper_interrupts()

    def raise_flag(self, flag: int) -> None:
        """Set an event flag; with its interrupt enabled, it is also a wake-up event (5.4.2)."""
        self.registers[ISR] |= flag
        self._signal()
        if self.registers[CR] & _INTERRUPT_OF.get(flag, 0) or (flag == _TAMP1F and self._tamper_interrupts()):
            self._pwr.wake_up()

    # -- for the inputs ---------------------------------------------------------------------------------

    def now(self) -> tuple[int, int, int]:
        """Return TR, DR and SSR of the present time."""
        if self.registers[ISR] & _INITF:
            return self.registers[TR], self.registers[DR], 0
        return self._present(TR), self._present(DR), self._present(SSR)

    def clock_hz(self) -> int:
        return self._hz

    def erase_backup(self) -> None:
        """Erase the backup registers (17.3.12)."""
        self.registers |= dict.fromkeys(_BACKUP, 0)

    def _tamper_interrupts(self) -> bool:
        return bool(self.registers[rtc.TAFCR.addr] & _TAMPIE)

    def _signal(self) -> None:
        isr, cr = self.registers[ISR], self.registers[CR]
        stamped = isr & _TSF and cr & _TSIE
        self._set_line(_STAMP_LINE, bool(stamped or (isr & _TAMP1F and self._tamper_interrupts())))
        self._set_line(_WAKE_UP_LINE, bool(isr & _WUTF and cr & _WUTIE))
        self._set_line(_ALARM_LINE, any(isr & one.flag and cr & one.interrupt for one in _ALARMS))
