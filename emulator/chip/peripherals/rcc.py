"""RCC: oscillators, PLL, clock selection, gates and resets of the other blocks, reset flags (RM0368 section
6).

An oscillator is ready its typical start-up time after it was switched on (STM32F401xB/C datasheet, tables
of the oscillators' characteristics): firmware that forgets to wait for a ready flag fails here as on the
board. The PLL is latched when it starts; SYSCLK follows RCC_CFGR.SW as soon as the selected source is
ready.

Not modelled, but stored: clock outputs MCO1 and MCO2, the clock security system (the crystal never fails),
spread spectrum, clocks in sleep mode (xxxLPENR). Whether the board has a 32 kHz crystal is not established;
here it has.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import partial
from typing import ClassVar

from emulator.chip.peripherals import clock_tree
from emulator.chip.peripherals.irq_line import IrqLine
from emulator.chip.peripherals.peripheral import WORD, Peripheral
from emulator.chip.peripherals.pwr import Pwr
from emulator.chip.peripherals.rcc_gates import ENABLE, RESET
from emulator.chip.soc import Soc
from emulator.time.clock import PS_PER_MS, PS_PER_S, PS_PER_US, Event

CR, PLLCFGR, CFGR, CIR = 0x00, 0x04, 0x08, 0x0C
BDCR, CSR, SSCGR, PLLI2SCFGR, DCKCFGR = 0x70, 0x74, 0x80, 0x84, 0x8C

_RESET_FLAG = {"PIN": 26, "SYSRESETREQ": 28, "IWDG": 29, "WWDG": 30}  # bits of RCC_CSR (6.3.21)
_PINRSTF, _RMVF = 1 << 26, 1 << 24
_POWER_ON_FLAGS = 0x0E00_0000
_FLAGS = 0xFE00_0000
_BDRST, _RTCEN = 1 << 16, 1 << 15
_TIMPRE = 1 << 24
_CHECK_AFTER_PS = PS_PER_MS
"""Limits are judged when a setting has lasted: ST's HAL 1.6 divides APB1 after switching to the PLL."""


@dataclass(frozen=True)
class _Source:
    """An oscillator or PLL: where its bits are, how long it takes to start; ``flag`` is its bit in CIR."""

    register: int
    on: int
    ready: int
    flag: int
    start_ps: int


_SOURCES = {
    "HSI": _Source(CR, 0, 1, 2, 2 * PS_PER_US),
    "HSE": _Source(CR, 16, 17, 3, 2 * PS_PER_MS),
    "PLL": _Source(CR, 24, 25, 4, 100 * PS_PER_US),
    "PLLI2S": _Source(CR, 26, 27, 5, 100 * PS_PER_US),
    "LSI": _Source(CSR, 0, 1, 0, 15 * PS_PER_US),
    "LSE": _Source(BDCR, 0, 1, 1, 2 * PS_PER_S),
}
_SYSTEM = ("HSI", "HSE", "PLL")  # in the order of SW


class Rcc(Peripheral):
    """Implements :class:`emulator.chip.soc.ClockTree`; tell it with :meth:`control` which blocks it feeds."""

    REGISTERS: ClassVar[dict[int, int]] = {
        CR: 0x0000_0083,
        PLLCFGR: 0x2400_3010,
        CFGR: 0,
        CIR: 0,
        **dict.fromkeys(RESET, 0),
        **dict.fromkeys(ENABLE, 0),
        0x50: 0x0061_900F,
        0x54: 0x0000_0080,
        0x60: 0x10E2_C80F,
        0x64: 0x0007_7930,
        BDCR: 0,
        CSR: _POWER_ON_FLAGS,
        SSCGR: 0,
        PLLI2SCFGR: 0x2400_3000,
        DCKCFGR: 0,
    }
    NAMES: ClassVar[dict[int, str]] = {
        CR: "CR",
        PLLCFGR: "PLLCFGR",
        CFGR: "CFGR",
        CIR: "CIR",
        0x10: "AHB1RSTR",
        0x14: "AHB2RSTR",
        0x20: "APB1RSTR",
        0x24: "APB2RSTR",
        0x30: "AHB1ENR",
        0x34: "AHB2ENR",
        0x40: "APB1ENR",
        0x44: "APB2ENR",
        0x50: "AHB1LPENR",
        0x54: "AHB2LPENR",
        0x60: "APB1LPENR",
        0x64: "APB2LPENR",
        BDCR: "BDCR",
        CSR: "CSR",
        SSCGR: "SSCGR",
        PLLI2SCFGR: "PLLI2SCFGR",
        DCKCFGR: "DCKCFGR",
    }
    WRITABLE: ClassVar[dict[int, int]] = {
        CR: 0x050D_00F9,
        CFGR: 0xFFFF_FCF3,
        CIR: 0x0000_3F00,
        BDCR: 0x0001_8305,
        CSR: 0x0000_0001,
    }

    def __init__(self, soc: Soc, name: str, base: int, pwr: Pwr, irq: IrqLine) -> None:
        super().__init__(soc, name, base)
        self._pwr = pwr
        self._irq = irq
        self._blocks: dict[str, Peripheral] = {}
        self._listeners: list[Callable[[], None]] = []
        self._backup_listeners: list[Callable[[], None]] = []
        self._starting: dict[str, Event] = {}
        self._check: Event | None = None
        self._pll_hz = 0
        self._adopted: tuple[clock_tree.Frequencies, int] | None = None  # and the RTC's
        self._adopt(clock_tree.frequencies(clock_tree.HSI_HZ, 0))

    # -- for the other blocks ---------------------------------------------------------------------------

    def control(self, blocks: Iterable[Peripheral]) -> None:
        """The blocks whose clock gates and resets are here, found by their names; all start without clock."""
        self._blocks = {block.name: block for block in blocks}
        self._apply_gates()

    def on_change(self, changed: Callable[[], None]) -> None:
        """Call ``changed()`` after any frequency has become another one, the RTC's included."""
        self._listeners.append(changed)

    def on_backup_reset(self, reset: Callable[[], None]) -> None:
        """Call ``reset()`` when firmware resets the backup domain (BDCR.BDRST)."""
        self._backup_listeners.append(reset)

    def rtc_hz(self) -> int:
        """The RTC's input clock; 0 while it is off or its source is not ready (6.2.8)."""
        bdcr = self.registers[BDCR]
        if not bdcr & _RTCEN:
            return 0
        name = (None, "LSE", "LSI", "HSE")[bdcr >> 8 & 3]
        if name is None or not self._ready(name):
            return 0
        if name == "HSE":
            divider = self.registers[CFGR] >> 16 & 0x1F
            return clock_tree.HSE_HZ // divider if divider >= 2 else 0
        return clock_tree.LSE_HZ if name == "LSE" else clock_tree.LSI_HZ

    def reset_because(self, reason: str) -> None:
        """Show the cause in CSR: "PIN", "SYSRESETREQ", "IWDG" or "WWDG"; each pulls NRST too (6.1.1)."""
        self.registers[CSR] |= _PINRSTF | 1 << _RESET_FLAG[reason]

    def reset(self) -> None:
        """System reset: the backup domain and the reset flags stay (6.3.20, 6.3.21)."""
        kept = {BDCR: self.registers[BDCR], CSR: self.registers[CSR] & _FLAGS}
        for name in [name for name in self._starting if _SOURCES[name].register != BDCR]:
            self._starting.pop(name).cancel()
        self.registers = dict(self.REGISTERS) | kept
        self._irq.set(self.name, False)
        self._apply_gates()
        self._update()

    # -- registers --------------------------------------------------------------------------------------

    def write(self, offset: int, value: int, mask: int = WORD) -> None:
        """Write a register and let the clocks follow."""
        if offset == BDCR and not self._pwr.backup_writable:
            self.note("refused", "BDCR written while PWR_CR.DBP is 0")
            return
        if offset == PLLCFGR and self.registers[CR] >> _SOURCES["PLL"].on & 1:
            self.note("forbidden", "PLLCFGR written while the PLL is on; it counts from the PLL's next start")
        old = self.registers.get(offset, 0)
        super().write(offset, value, mask)
        value &= mask
        if offset in ENABLE:
            self._apply_gates()
        elif offset in RESET:
            self._apply_resets(offset, self.registers[offset] & ~old)
        elif offset == CIR:
            self.registers[CIR] &= ~(value >> 16 & 0xBF)
            self._signal()
        else:
            self._clocks_written(offset, value)

    def _clocks_written(self, offset: int, value: int) -> None:
        if offset == CR:
            self._keep_used_sources()
        elif offset == CSR and value & _RMVF:
            self.registers[CSR] &= ~_FLAGS
        elif offset == BDCR and value & _BDRST:
            self.registers[BDCR] = _BDRST
            for reset in self._backup_listeners:
                reset()
        self._update()

    def _keep_used_sources(self) -> None:
        """What drives SYSCLK cannot be switched off: the hardware keeps the bit set (6.3.1)."""
        used = {_SYSTEM[self.registers[CFGR] >> 2 & 3]}
        if "PLL" in used:
            used.add(self._pll_source())
        for name in used:
            self.registers[CR] |= 1 << _SOURCES[name].on

    def _apply_gates(self) -> None:
        for offset, names in ENABLE.items():
            enabled = self.registers[offset]
            for bit, name in names.items():
                if name in self._blocks:
                    self._blocks[name].gate(clocked=bool(enabled >> bit & 1))

    def _apply_resets(self, offset: int, rising: int) -> None:
        for bit, name in RESET[offset].items():
            if rising >> bit & 1 and name in self._blocks:
                self._blocks[name].reset()

    # -- oscillators ------------------------------------------------------------------------------------

    def _ready(self, name: str) -> bool:
        source = _SOURCES[name]
        return bool(self.registers[source.register] >> source.ready & 1)

    def _pll_source(self) -> str:
        return "HSE" if self.registers[PLLCFGR] >> 22 & 1 else "HSI"

    def _update(self) -> None:
        """Start and stop sources as their bits say, then let SYSCLK follow."""
        for name, source in _SOURCES.items():
            on = self.registers[source.register] >> source.on & 1
            if not on:
                self.registers[source.register] &= ~(1 << source.ready)
                if name in self._starting:
                    self._starting.pop(name).cancel()
            elif not self._ready(name) and name not in self._starting and self._has_input(name):
                self._start(name, source)
        self._select()

    def _has_input(self, name: str) -> bool:
        return name not in {"PLL", "PLLI2S"} or self._ready(self._pll_source())

    def _start(self, name: str, source: _Source) -> None:
        if name == "PLL":
            output = clock_tree.pll(self.registers[PLLCFGR])
            self._pll_hz = output.p_hz
            if output.problem():
                self.note("forbidden", output.problem())
            if not self._pll_hz:  # N is 0, a "wrong configuration" (6.3.2): nothing oscillates
                return
        at_ps = self.soc.clock.now_ps + source.start_ps
        self._starting[name] = self.soc.clock.schedule(at_ps, partial(self._started, name))

    def _started(self, name: str) -> None:
        source = _SOURCES[name]
        del self._starting[name]
        self.registers[source.register] |= 1 << source.ready
        if self.registers[CIR] >> 8 + source.flag & 1:
            self.registers[CIR] |= 1 << source.flag
        self._signal()
        self._update()

    def _signal(self) -> None:
        cir = self.registers[CIR]
        self._irq.set(self.name, bool(cir & cir >> 8 & 0x3F))

    # -- frequencies ------------------------------------------------------------------------------------

    def _select(self) -> None:
        wanted = self.registers[CFGR] & 3
        if wanted < len(_SYSTEM) and self._ready(_SYSTEM[wanted]):
            self.registers[CFGR] = self.registers[CFGR] & ~0xC | wanted << 2
        used = self.registers[CFGR] >> 2 & 3
        sysclk_hz = (clock_tree.HSI_HZ, clock_tree.HSE_HZ, self._pll_hz)[used]
        timpre = bool(self.registers[DCKCFGR] & _TIMPRE)
        self._adopt(clock_tree.frequencies(sysclk_hz, self.registers[CFGR], timpre=timpre))

    def _adopt(self, clocks: clock_tree.Frequencies) -> None:
        adopted = clocks, self.rtc_hz()
        if adopted == self._adopted:
            return
        self._adopted = adopted
        self.sysclk_hz, self.hclk_hz = clocks.sysclk_hz, clocks.hclk_hz
        self.pclk1_hz, self.pclk2_hz = clocks.pclk1_hz, clocks.pclk2_hz
        self.timer1_hz, self.timer2_hz = clocks.timer1_hz, clocks.timer2_hz
        for changed in self._listeners:
            changed()
        if clocks.problem() and self._check is None:
            self._check = self.soc.clock.schedule(self.soc.clock.now_ps + _CHECK_AFTER_PS, self._judge)

    def _judge(self) -> None:
        self._check = None
        problem = self._adopted[0].problem() if self._adopted else ""
        if problem:
            self.note("forbidden", problem)
