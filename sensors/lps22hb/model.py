"""The LPS22HB's behaviour behind its registers (datasheet DocID027083 Rev 6).

Decisions where the datasheet is silent: a one-shot takes 13 ms in low noise and 5 ms in low current (figures
of the sister part LPS22HH), and writing ONE_SHOT again while it is busy does not restart it; SWRESET clears
its bit after 10 us and keeps RPDS and RES_CONF, which section 9.6 does not list; BOOT ends after one period
of the data rate, or 1 ms in power-down, and disturbs no setting (the board's own firmware sets BOOT by
mistake and works); P_DA and T_DA are cleared by reading the high byte of their output.
"""

from __future__ import annotations

from typing import ClassVar

from sensors.lps22hb import registers
from sensors.lps22hb.barometer import COUNTS_PER_DEGC, COUNTS_PER_HPA, Barometer, BarometerSettings
from sensors.lps22hb.errors import LPS22HBErrors
from sensors.lps22hb.registers import (
    CTRL_REG1,
    CTRL_REG2,
    CTRL_REG3,
    FIFO_CTRL,
    INTERRUPT_CFG,
    PRESS_OUT,
    REF_P,
    RES_CONF,
    RPDS,
    STATUS,
    TEMP_OUT,
    THS_P,
)
from sensors.part import Part, SelfClearingBits, Signal
from sensors.register import RegisterMap
from sensors.sampling import PS_PER_S, SampleStream

_SWRESET_PS = 10 * PS_PER_S // 10**6
_BOOT_PS = PS_PER_S // 10**3
_ONE_SHOT_PS = {False: 13 * PS_PER_S // 10**3, True: 5 * PS_PER_S // 10**3}
_BURST_WRAP = {0x2C: 0x28}  # reading on after the temperature starts again at the pressure (datasheet 5.8)
_RESET_BY_SWRESET = (INTERRUPT_CFG, THS_P, CTRL_REG1, CTRL_REG2, CTRL_REG3, FIFO_CTRL, REF_P)
_NEW, _OVERRUN_SHIFT = STATUS.P_DA.mask | STATUS.T_DA.mask, 4
_FIRST, _END = PRESS_OUT.addr, TEMP_OUT.addr + TEMP_OUT.size
_TEMP_FIRST = TEMP_OUT.addr
_P_READ = 0xFF & ~(STATUS.P_DA.mask | STATUS.P_OR.mask)
_PRESS_OUT_H, _TEMP_OUT_H = PRESS_OUT.addr + 2, TEMP_OUT.addr + 1


class LPS22HB(Part):
    """Barometer with thermometer; ``pressure_hpa`` and ``temperature_degc``: (n,)."""

    NAME: ClassVar[str] = "LPS22HB"
    WHO_AM_I: ClassVar[int] = 0xB1
    MAP: ClassVar[RegisterMap] = RegisterMap.of(registers)

    def __init__(
        self,
        pressure_hpa: Signal,
        temperature_degc: Signal,
        errors: LPS22HBErrors | None = None,
        seed: int = 0,
    ) -> None:
        super().__init__(self.MAP, _BURST_WRAP)
        main = self.registers
        self._barometer = Barometer(pressure_hpa, temperature_degc, errors or LPS22HBErrors(), seed)
        self._barometer.settings = BarometerSettings.decode(main.mem)
        self._stream = SampleStream(_END - _FIRST, self._barometer.produce)
        self._bdu = False
        self._held = False  # BDU: a read of the output has begun and not reached its high byte
        self._behind = False  # while it was held, a sample may have come that is not shown yet
        self._one_shot = False
        self._clearing = SelfClearingBits(main, CTRL_REG2)
        main.before_read(STATUS, self._before_status)
        main.before_read(CTRL_REG2, self._before_control2)
        main.before_read(PRESS_OUT, self._before_output)
        main.before_read(TEMP_OUT, self._before_output)
        main.on_write(CTRL_REG1, self._configure)
        main.on_write(CTRL_REG2, self._write_control2)
        main.on_write(RES_CONF, self._configure)
        main.on_write(RPDS, self._configure)

    def world_changed(self, now_ps: int | None = None) -> None:
        """The signals differ from what they were: samples still to come are computed anew."""
        del now_ps
        self._stream.invalidate()

    def sample_range(self, channel: str) -> tuple[float, float, float]:
        """``pressure_hpa`` (the specified range, not that of 24 bits) or ``temperature_degc``."""
        return {
            "pressure_hpa": (260.0, 1260.0, 1 / COUNTS_PER_HPA),
            "temperature_degc": (-327.68, 327.67, 1 / COUNTS_PER_DEGC),
        }[channel]

    # -- output and data-ready --------------------------------------------------------------------------

    def _refresh(self, now_ps: int) -> None:
        stream, mem = self._stream, self.registers.mem
        fresh = stream.advance(now_ps) if now_ps >= stream.next_ps else 0
        self._behind = self._held
        if not self._held:  # also what came while the output was held
            mem[_FIRST:_END] = stream.data
        if not fresh:
            return
        unread = _NEW if fresh > 1 else mem[STATUS.addr] & _NEW
        mem[STATUS.addr] |= _NEW | unread << _OVERRUN_SHIFT
        if self._one_shot:
            self._one_shot = False
            mem[CTRL_REG2.addr] &= ~CTRL_REG2.ONE_SHOT.mask
            stream.stop()

    def _before_status(self, first: int, end: int, now_ps: int) -> None:
        del first, end
        self._refresh(now_ps)

    def _before_output(self, first: int, end: int, now_ps: int) -> None:
        """Datasheet 9.5: with BDU the output is held from the first byte read until PRESS_OUT_H is read."""
        if now_ps >= self._stream.next_ps or self._behind:
            self._refresh(now_ps)
        mem = self.registers.mem
        if first == _FIRST and end == _TEMP_FIRST and not self._held:  # the usual whole read
            mem[STATUS.addr] &= _P_READ
            return
        cleared = 0
        if first <= _PRESS_OUT_H < end:
            cleared = STATUS.P_DA.mask | STATUS.P_OR.mask
        elif first <= _TEMP_OUT_H < end:
            cleared = STATUS.T_DA.mask | STATUS.T_OR.mask
        mem[STATUS.addr] &= ~cleared
        if self._bdu and first <= _PRESS_OUT_H:
            self._held = end <= _PRESS_OUT_H

    # -- configuration ----------------------------------------------------------------------------------

    def _before_control2(self, first: int, end: int, now_ps: int) -> None:
        self._refresh(now_ps)
        self._clearing.before_read(first, end, now_ps)

    def _write_control2(self, old: int, new: int, now_ps: int) -> None:
        main = self.registers
        main.mem[CTRL_REG2.addr] = old  # a one-shot may have ended meanwhile: settle it first
        self._before_control2(0, 0, now_ps)
        busy = self._one_shot
        main.mem[CTRL_REG2.addr] = new | (CTRL_REG2.ONE_SHOT.mask if busy else 0)
        if new & CTRL_REG2.SWRESET.mask:
            main.reset(*_RESET_BY_SWRESET)
            self._one_shot = busy = False
            self._stream.stop()
            self._clearing.begin(CTRL_REG2.SWRESET.mask, now_ps + _SWRESET_PS)
        if new & CTRL_REG2.BOOT.mask:
            rate = self._barometer.settings.rate
            self._clearing.begin(CTRL_REG2.BOOT.mask, now_ps + (int(PS_PER_S / rate) if rate else _BOOT_PS))
        main.increment = bool(main.mem[CTRL_REG2.addr] & CTRL_REG2.IF_ADD_INC.mask)
        self._configure(old, new, now_ps)
        if main.mem[CTRL_REG2.addr] & CTRL_REG2.ONE_SHOT.mask and not busy:
            self._trigger(now_ps)

    def _trigger(self, now_ps: int) -> None:
        settings = self._barometer.settings
        if settings.rate:
            self.registers.note(now_ps, "forbidden", "CTRL_REG2.ONE_SHOT while CTRL_REG1.ODR is not 0")
            self.registers.mem[CTRL_REG2.addr] &= ~CTRL_REG2.ONE_SHOT.mask
            return
        self._one_shot = True
        self._stream.start_single(now_ps, _ONE_SHOT_PS[settings.low_current])

    def _configure(self, old: int, new: int, now_ps: int) -> None:
        del old, new
        self._refresh(now_ps)
        mem = self.registers.mem
        if CTRL_REG1.ODR.get(mem[CTRL_REG1.addr]) > 5:
            self.registers.note(now_ps, "forbidden", "CTRL_REG1.ODR above 5")
        was = self._barometer.settings
        settings = self._barometer.settings = BarometerSettings.decode(mem)
        self._bdu = bool(mem[CTRL_REG1.addr] & CTRL_REG1.BDU.mask)
        if not self._bdu:
            self._held = False
        self._stream.invalidate()
        if settings.rate != was.rate:
            self._one_shot = False
            if settings.rate:
                self._stream.start(now_ps, settings.rate)
            else:
                self._stream.stop()
