"""Time stamp and tamper detection of the RTC at PC13, which is RTC_AF1 (RM0368 17.3.12, 17.3.13).

An edge takes effect immediately; on the chip this takes two RTC clocks. With a filter, the level must hold for
2, 4 or 8 sampling periods; the phase of the sampling is not modelled.

NOT MODELLED, with a note: RTC_AF2 and tamper input 2, which the chip's package lacks.
"""

from __future__ import annotations

from typing import Protocol

from fcu_emulator.emulator.chip.peripherals.peripheral import Soc
from fcu_emulator.emulator.chip.registers import rtc
from fcu_emulator.emulator.chip.registers.declaration import masks
from fcu_emulator.emulator.clock import PS_PER_S, Event

_PIN = ("C", 13)
_TSE, _TSEDGE = masks(rtc.CR.TSE, rtc.CR.TSEDGE)
_TAFCR = rtc.TAFCR
_TAMP1E, _TAMP1TRG, _TAMPTS = masks(_TAFCR.TAMP1E, _TAFCR.TAMP1TRG, _TAFCR.TAMPTS)
_TAMPPUDIS = _TAFCR.TAMPPUDIS.mask
_ON_OTHER_PINS = _TAFCR.TSINSEL.mask | _TAFCR.TAMP1INSEL.mask | _TAFCR.TAMP2E.mask
_TSF, _TSOVF, _TAMP1F = masks(rtc.ISR.TSF, rtc.ISR.TSOVF, rtc.ISR.TAMP1F)
_STAMPS = (rtc.TSTR.addr, rtc.TSDR.addr, rtc.TSSSR.addr)
_SLOWEST_SAMPLING = 15  # TAMPFREQ = 0: RTCCLK / 2 ** 15


class Calendar(Protocol):
    """The RTC's registers and time."""

    registers: dict[int, int]

    def now(self) -> tuple[int, int, int]:
        """Return TR, DR and SSR of the present time."""
        ...

    def clock_hz(self) -> int: ...

    def raise_flag(self, flag: int) -> None: ...

    def erase_backup(self) -> None: ...

    def note(self, what: str, problem: str, text: str) -> None: ...


class RtcInputs:
    """The input RTC_AF1."""

    def __init__(self, soc: Soc, calendar: Calendar) -> None:
        self._soc = soc
        self._calendar = calendar
        self._listens = False
        self._sampling: Event | None = None

    def control_written(self) -> None:
        """Watch the pin while the time stamp is on."""
        if self._calendar.registers[rtc.CR.addr] & _TSE:
            self._listen()

    def tamper_written(self, before: int) -> None:
        """Start or stop the detection after a write to TAFCR."""
        tafcr = self._calendar.registers[_TAFCR.addr]
        if tafcr & _ON_OTHER_PINS:
            self._calendar.note("not modelled", "rtc-af2", "TAFCR: RTC_AF2 and tamper input 2")
        self._stop_sampling()
        if not tafcr & _TAMP1E:
            return
        self._listen()
        if _TAFCR.TAMPFLT.get(tafcr):
            self._sample()
        elif not before & _TAMP1E and self._is_active():
            self._tampered()

    def flags_cleared(self) -> None:
        """Clear the time stamp with its flag (17.6.12)."""
        registers = self._calendar.registers
        if not registers[rtc.ISR.addr] & _TSF:
            registers |= dict.fromkeys(_STAMPS, 0)

    def reset(self) -> None:
        self._stop_sampling()

    # -- the pin ----------------------------------------------------------------------------------------

    def _listen(self) -> None:
        if not self._listens:
            self._listens = True
            self._soc.gpio.listen(*_PIN, self._changed)

    def _changed(self, level: int) -> None:
        registers = self._calendar.registers
        tafcr = registers[_TAFCR.addr]
        if registers[rtc.CR.addr] & _TSE and bool(registers[rtc.CR.addr] & _TSEDGE) is not bool(level):
            self._stamp()
        if not tafcr & _TAMP1E:
            return
        if _TAFCR.TAMPFLT.get(tafcr):
            self._stop_sampling()
            self._sample()
        elif self._is_active():
            self._tampered()

    def _level(self) -> int:
        tafcr = self._calendar.registers[_TAFCR.addr]
        pulled_up = _TAFCR.TAMPFLT.get(tafcr) and not tafcr & _TAMPPUDIS
        level = self._soc.gpio.level(*_PIN)
        return level if level is not None else int(bool(pulled_up))

    def _is_active(self) -> bool:
        """Return whether the pin has the level of a tamper event (17.6.17, TAMP1TRG)."""
        tafcr = self._calendar.registers[_TAFCR.addr]
        high_is_active = bool(tafcr & _TAMP1TRG) is bool(_TAFCR.TAMPFLT.get(tafcr))
        return bool(self._level()) is high_is_active

    # -- events -----------------------------------------------------------------------------------------

    def _stamp(self) -> None:
        registers = self._calendar.registers
        if registers[rtc.ISR.addr] & _TSF:
            registers[rtc.ISR.addr] |= _TSOVF
            return
        time, date, subseconds = self._calendar.now()
        registers |= dict(zip(_STAMPS, (time, date & 0xFFFF, subseconds), strict=True))
        self._calendar.raise_flag(_TSF)

    def _tampered(self) -> None:
        self._calendar.erase_backup()
        if self._calendar.registers[_TAFCR.addr] & _TAMPTS:
            self._stamp()
        self._calendar.raise_flag(_TAMP1F)

    # -- filter -----------------------------------------------------------------------------------------

    def _stop_sampling(self) -> None:
        if self._sampling is not None:
            self._sampling.cancel()
            self._sampling = None

    def _sample(self) -> None:
        """Schedule the event, which comes if the pin keeps its active level."""
        hz, tafcr = self._calendar.clock_hz(), self._calendar.registers[_TAFCR.addr]
        if not hz or not self._is_active():
            return
        cycles = (1 << _TAFCR.TAMPFLT.get(tafcr)) << _SLOWEST_SAMPLING - _TAFCR.TAMPFREQ.get(tafcr)
        at_ps = self._soc.clock.now_ps + cycles * PS_PER_S // hz
        self._sampling = self._soc.clock.schedule(at_ps, self._sampled)

    def _sampled(self) -> None:
        self._sampling = None
        self._tampered()
