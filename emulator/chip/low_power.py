"""Stop and Standby (RM0368 5.3.5, 5.3.6), and the chip's supply current.

Wake-up times and currents are typical values of the STM32F401xB/C datasheet at 25 degC (low-power mode
wake-up timings; features; supply current). The currents of Stop with the main regulator are rounded.

In Stop, EXTI, RTC and IWDG continue; all other peripherals stop. DBG_STOP keeps HCLK on, from HSI
(23.16.1); then every interrupt ends the sleep. In Standby only RTC, IWDG, the WKUP pin and CSR of PWR
remain; the end of Standby is a power reset (6.1.2). DBG_STANDBY keeps the RAM.

NOT MODELLED: if a transfer, conversion or erase operation is in progress when Stop begins, it continues.
A debugger can always halt the chip, which needs DBG_STOP or DBG_STANDBY on the real chip.
"""

from __future__ import annotations

import random
from typing import Final

from fcu_emulator.emulator.chip.cpu.core import Core
from fcu_emulator.emulator.chip.library import DEEP_REFUSED, DEEP_STANDBY, DEEP_WITH_CLOCKS
from fcu_emulator.emulator.chip.memory_map import RAM_SIZE
from fcu_emulator.emulator.chip.peripherals import pwr
from fcu_emulator.emulator.chip.peripherals.dbgmcu import DBG_STANDBY, DBG_STOP, Dbgmcu
from fcu_emulator.emulator.chip.peripherals.pwr import Pwr
from fcu_emulator.emulator.chip.peripherals.rcc import Rcc
from fcu_emulator.emulator.chip.peripherals.rtc import Rtc
from fcu_emulator.emulator.chip.peripherals.watchdogs import Iwdg, Wwdg
from fcu_emulator.emulator.chip.registers import address_of, exti, scb
from fcu_emulator.emulator.clock import PS_PER_US

_WAKE_UP_US: Final = {0: 13.5, pwr.FPDS: 105, pwr.LPDS: 21, pwr.LPDS | pwr.FPDS: 113}
"""Wake-up times of Stop, by the bits of PWR_CR."""
_STOP_UA: Final = {0: 110.0, pwr.FPDS: 75.0, pwr.LPDS: 42.0, pwr.LPDS | pwr.FPDS: 10.0}
_STANDBY_UA, _RTC_UA, _RUN_UA_PER_MHZ = 2.4, 1.0, 128.0
_SLEEPDEEP = scb.SCR.SLEEPDEEP.mask
_SCR, _EXTI_PR = address_of("SCB", scb.SCR), address_of("EXTI", exti.PR)


class LowPower:
    """Enters and leaves the modes of one chip."""

    def __init__(self, core: Core, power: Pwr, rcc: Rcc, rtc: Rtc, dbgmcu: Dbgmcu, wwdg: Wwdg) -> None:
        self._core = core
        self._pwr, self._rcc, self._rtc, self._dbgmcu, self._wwdg = power, rcc, rtc, dbgmcu, wwdg
        self.in_stop = False
        core.on_deep_sleep = self._sleep
        core.on_stop_ended = self._wake
        power.on_wake_up = self._woken

    @property
    def in_standby(self) -> bool:
        return self._pwr.in_standby

    def reset(self) -> None:
        """Leave every mode; the caller resets the peripherals."""
        self.in_stop = False
        self._wwdg.freeze(False)

    def supply_current_ua(self) -> float:
        """Return the typical supply current of the chip, with all peripherals off.

        In Sleep it is the current of Run, an upper bound.
        """
        if self.in_standby:
            return _STANDBY_UA + (_RTC_UA if self._rcc.rtc_hz() else 0)
        if self.in_stop:
            return _STOP_UA[self._pwr.registers[pwr.CR] & (pwr.LPDS | pwr.FPDS)]
        return _RUN_UA_PER_MHZ * self._rcc.hclk_hz / 1e6

    def can_wake(self) -> bool:
        """Return whether a wake-up source of the present mode is on."""
        if any(one.is_running for one in self._core.all_peripherals if isinstance(one, Iwdg)):
            return True
        if self.in_standby:
            return bool(self._pwr.registers[pwr.CSR] & pwr.EWUP) or self._rtc.can_interrupt()
        lines = self._core.peripherals["EXTI"]
        return bool(lines.peek(exti.IMR.addr) | lines.peek(exti.EMR.addr))

    # -- called by the chip -----------------------------------------------------------------------------

    def _sleep(self) -> int:
        control = self._pwr.registers[pwr.CR]
        if control & pwr.PDDS:
            return self._standby()
        if self._core.peek(_EXTI_PR) or self._rtc.has_event():
            self._pwr.note(
                "refused",
                "stop-refused",
                "Stop is not entered while a bit of EXTI_PR or an event flag of RTC_ISR is set",
            )
            return DEEP_REFUSED
        self._rcc.stop()
        if self._dbgmcu.has(DBG_STOP):
            return DEEP_WITH_CLOCKS
        self.in_stop = True
        self._wwdg.freeze(True)
        self._core.stop_clocks(True, self._rcc)
        return round(_WAKE_UP_US[control & (pwr.LPDS | pwr.FPDS)] * PS_PER_US)

    def _wake(self) -> None:
        self.in_stop = False
        self._wwdg.freeze(False)
        self._core.stop_clocks(False, self._rcc)

    def _standby(self) -> int:
        if self._pwr.registers[pwr.CSR] & pwr.WUF or self._rtc.has_event():
            self._pwr.note(
                "refused",
                "standby-refused",
                "Standby is not entered while WUF in PWR_CSR or an event flag of RTC_ISR is set",
            )
            return DEEP_REFUSED
        core = self._core
        self._pwr.in_standby = core.is_off = True
        self._pwr.registers[pwr.CSR] |= pwr.SBF
        for native in core.peripherals.values():
            native.reset()
        for peripheral in core.all_peripherals:
            if peripheral.index is None and not isinstance(peripheral, Pwr | Rcc | Iwdg | Dbgmcu):
                peripheral.reset()
        self._rcc.standby()
        if not self._dbgmcu.has(DBG_STANDBY):
            core.ram[:] = random.Random(core.clock.now_ps).randbytes(RAM_SIZE)
            self._dbgmcu.lose_power()
        core.stop_clocks(True, self._rcc)
        return DEEP_STANDBY

    def _woken(self) -> None:
        if self.in_standby:
            self._pwr.soc.reset("STANDBY")
