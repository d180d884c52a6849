"""RCC: clocks, gates, resets and reset flags (RM0368 section 6).

Oscillators are ready after their typical start-up times (STM32F401xB/C datasheet). MCO1, MCO2, clock security,
spread spectrum and xxxLPENR have no effect. The model has a 32 kHz crystal, but it may be missing
on the real board.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from functools import lru_cache, partial

from fcu_emulator.emulator.boards.description import CRYSTAL_HZ, BoardErrors
from fcu_emulator.emulator.chip.library import FcuChip
from fcu_emulator.emulator.chip.peripherals.peripheral import WORD, InterruptInput, Peripheral, Soc
from fcu_emulator.emulator.chip.peripherals.pwr import Pwr
from fcu_emulator.emulator.chip.registers import DECLARED, rcc
from fcu_emulator.emulator.chip.registers.declaration import Word, masks, offsets
from fcu_emulator.emulator.clock import PS_PER_MS, PS_PER_S, PS_PER_US, Event

# -- frequencies (section 6.2, figure 12) -------------------------------------------------------------------

HSI_HZ = 16_000_000
HSE_HZ = CRYSTAL_HZ
LSI_HZ = 32_000  # STM32F401xB/C datasheet, LSI oscillator: 17 to 47 kHz
LSE_HZ = 32_768

_SETTINGS = 64  # maximum number of cached settings of a register

HSI, HSE, PLL = range(3)  # RCC_CFGR.SW and SWS

_AHB_SHIFT = (0, 0, 0, 0, 0, 0, 0, 0, 1, 2, 3, 4, 6, 7, 8, 9)  # the divider 32 does not exist (6.3.3)
_APB_SHIFT = (0, 0, 0, 0, 1, 2, 3, 4)


@dataclass(frozen=True)
class Oscillators:
    """The real frequencies of the oscillators for SYSCLK, in Hz."""

    hsi_hz: int = HSI_HZ
    hse_hz: int = HSE_HZ
    crystal_hz: int = HSE_HZ
    """The crystal's nominal frequency."""

    @classmethod
    def of(cls, errors: BoardErrors, crystal_hz: int = HSE_HZ) -> Oscillators:
        hse_hz = round(crystal_hz * (1 + errors.hse_ppm / 1e6))
        return cls(round(HSI_HZ * (1 + errors.hsi_percent / 100)), hse_hz, crystal_hz)

    @property
    def nominal(self) -> Oscillators:
        """The same oscillators without errors."""
        return Oscillators(HSI_HZ, self.crystal_hz, self.crystal_hz)


_OTHER_CRYSTALS_HZ = (HSE_HZ, 8_000_000, 25_000_000, 12_000_000)  # usual crystals of other boards

NOMINAL = Oscillators()
"""Exact oscillators for checks of the manual's limits. A real oscillator within its tolerance does not violate
these limits.
"""


@dataclass(frozen=True)
class PllOutput:
    """PLL outputs: ``p_hz`` for SYSCLK, ``q_hz`` for USB and SDIO."""

    input_hz: int
    vco_hz: int
    p_hz: int
    q_hz: int

    def problem(self) -> str:
        """Return the violated rule, or "" (6.3.2)."""
        if not 950_000 <= self.input_hz <= 2_100_000:  # the datasheet's limits; the manual says 1 to 2 MHz
            return f"PLL input, set by M, must be 1 to 2 MHz, not {self.input_hz / 1e6:g} MHz"
        if not 192_000_000 <= self.vco_hz <= 432_000_000:
            return f"PLL VCO, set by N, must be 192 to 432 MHz, not {self.vco_hz / 1e6:g} MHz"
        if self.p_hz > 84_000_000:
            return f"PLL output is {self.p_hz / 1e6:g} MHz; the chip's limit is 84 MHz"
        return ""


@lru_cache(maxsize=_SETTINGS)
def pll(pllcfgr: int, oscillators: Oscillators = NOMINAL) -> PllOutput:
    """Return the PLL's frequencies; the forbidden M = 0 counts as 1."""
    fields = rcc.PLLCFGR
    source_hz = oscillators.hse_hz if fields.PLLSRC.get(pllcfgr) else oscillators.hsi_hz
    m, n = max(fields.PLLM.get(pllcfgr), 1), fields.PLLN.get(pllcfgr)
    p, q = 2 * (fields.PLLP.get(pllcfgr) + 1), max(fields.PLLQ.get(pllcfgr), 1)
    vco_hz = source_hz * n // m
    return PllOutput(source_hz // m, vco_hz, vco_hz // p, vco_hz // q)


def _fitting_crystal_hz(pllcfgr: int) -> int:
    """Return the frequency of another board's crystal that fits the settings, or 0."""
    if not rcc.PLLCFGR.PLLSRC.get(pllcfgr):
        return 0
    fitting = (hz for hz in _OTHER_CRYSTALS_HZ if not pll(pllcfgr, Oscillators(hse_hz=hz)).problem())
    return next(fitting, 0)


@dataclass(frozen=True)
class Frequencies:
    """All clocks derived from SYSCLK, in Hz."""

    sysclk_hz: int
    hclk_hz: int
    pclk1_hz: int
    pclk2_hz: int
    timer1_hz: int
    timer2_hz: int

    def problem(self) -> str:
        """Return the exceeded limit of APB1 (42 MHz), or "". The PLL's limit keeps AHB and APB2 at or below
        84 MHz (6.2)."""
        if self.pclk1_hz > 42_000_000:
            return f"APB1 must run at 42 MHz or less, not {self.pclk1_hz / 1e6:g} MHz; change PPRE1"
        return ""


@lru_cache(maxsize=_SETTINGS)
def frequencies(sysclk_hz: int, cfgr: int, *, timpre: bool = False) -> Frequencies:
    """Return the clocks after RCC_CFGR's prescalers; ``timpre`` is RCC_DCKCFGR.TIMPRE (6.3.23)."""
    hclk_hz = sysclk_hz >> _AHB_SHIFT[rcc.CFGR.HPRE.get(cfgr)]
    shift1, shift2 = _APB_SHIFT[rcc.CFGR.PPRE1.get(cfgr)], _APB_SHIFT[rcc.CFGR.PPRE2.get(cfgr)]
    return Frequencies(
        sysclk_hz,
        hclk_hz,
        hclk_hz >> shift1,
        hclk_hz >> shift2,
        _timer_hz(hclk_hz, shift1, timpre),
        _timer_hz(hclk_hz, shift2, timpre),
    )


def _timer_hz(hclk_hz: int, shift: int, timpre: bool) -> int:
    multiple = 2 if timpre else 1
    return hclk_hz >> max(shift - multiple, 0)


# -- gate and reset bits (sections 6.3.5 to 6.3.12) --------------------------------------------------------------

_PERIPHERALS_BY_FIELD = {"OTGFS": "OTG_FS", "ADC": "ADC1"}
"""Fields that do not begin with their peripheral's name. The ADCs share one reset."""


def _gates(suffix: str, *registers: type[Word]) -> dict[int, dict[int, str]]:
    names = {
        register.addr: {bits.lsb: bits.name.removesuffix(suffix) for bits in register.fields}
        for register in registers
    }
    return {
        offset: {bit: _PERIPHERALS_BY_FIELD.get(name, name) for bit, name in by_bit.items()}
        for offset, by_bit in names.items()
    }


ENABLE = _gates("EN", rcc.AHB1ENR, rcc.AHB2ENR, rcc.APB1ENR, rcc.APB2ENR)
RESET = _gates("RST", rcc.AHB1RSTR, rcc.AHB2RSTR, rcc.APB1RSTR, rcc.APB2RSTR)

# -- the peripheral ----------------------------------------------------------------------------------------------

CR, PLLCFGR, CFGR, CIR = offsets(rcc.CR, rcc.PLLCFGR, rcc.CFGR, rcc.CIR)
BDCR, CSR, DCKCFGR = offsets(rcc.BDCR, rcc.CSR, rcc.DCKCFGR)

_RESET_FLAG = {
    "PIN": rcc.CSR.PINRSTF.mask,
    "SYSRESETREQ": rcc.CSR.SFTRSTF.mask,
    "IWDG": rcc.CSR.IWDGRSTF.mask,
    "WWDG": rcc.CSR.WWDGRSTF.mask,
}
_FLAGS = sum(bits.mask for bits in rcc.CSR.fields if bits.name.endswith("RSTF"))
_RMVF, _BDRST, _RTCEN = masks(rcc.CSR.RMVF, rcc.BDCR.BDRST, rcc.BDCR.RTCEN)
_CHECK_AFTER_PS = PS_PER_MS
"""Limits are checked after this time, because ST's HAL 1.6 switches to the PLL before it divides APB1."""


@dataclass(frozen=True)
class _Source:
    """An oscillator or PLL: its bits and start-up time."""

    register: int
    on: int
    ready: int
    flag: int
    """The bit in CIR; ``enable`` is its enable bit."""
    enable: int
    start_ps: int


def _source(register: type[Word], name: str, start_ps: int) -> _Source:
    own = {bits.name: bits.mask for bits in register.fields}
    cir = {bits.name: bits.mask for bits in rcc.CIR.fields}
    ready = f"{name}RDY"
    return _Source(register.addr, own[f"{name}ON"], own[ready], cir[f"{ready}F"], cir[f"{ready}IE"], start_ps)


_SOURCES = {
    "HSI": _source(rcc.CR, "HSI", 2 * PS_PER_US),
    "HSE": _source(rcc.CR, "HSE", 2 * PS_PER_MS),
    "PLL": _source(rcc.CR, "PLL", 100 * PS_PER_US),
    "PLLI2S": _source(rcc.CR, "PLLI2S", 100 * PS_PER_US),
    "LSI": _source(rcc.CSR, "LSI", 15 * PS_PER_US),
    "LSE": _source(rcc.BDCR, "LSE", 2 * PS_PER_S),
}
_READY_FLAGS = sum(source.flag for source in _SOURCES.values())
_SYSCLK_SOURCES = ("HSI", "HSE", "PLL")  # in the order of the codes of SW


_OSCILLATORS = frozenset((CR, PLLCFGR, BDCR, CSR))
"""Registers that start and stop oscillators."""


class _Controlled:
    """The peripherals whose clocks or resets are controlled by the bits of a register."""

    def __init__(self, names: Mapping[int, str], peripherals: Mapping[str, Peripheral]) -> None:
        known = [(bit, peripherals[name]) for bit, name in names.items() if name in peripherals]
        self._in_c = {
            1 << bit: 1 << peripheral.index for bit, peripheral in known if peripheral.index is not None
        }
        self._in_python = tuple((bit, peripheral) for bit, peripheral in known if peripheral.index is None)
        self._latest: dict[int, tuple[int, tuple[tuple[int, Peripheral], ...]]] = {}

    def of(self, bits: int) -> tuple[int, tuple[tuple[int, Peripheral], ...]]:
        """Return the peripherals that ``bits`` select: those in C as a mask, those in Python with their bits.

        Bit n of the mask is the peripheral with index n.
        """
        found = self._latest.get(bits)
        if found is None:
            if len(self._latest) >= _SETTINGS:
                self._latest.clear()
            in_c = sum(index for bit, index in self._in_c.items() if bits & bit)
            in_python = tuple(one for one in self._in_python if bits >> one[0] & 1)
            self._latest[bits] = found = in_c, in_python
        return found


class Rcc(Peripheral, declared=DECLARED["RCC"]):
    """The clocks, gates and resets of the peripherals."""

    def __init__(
        self,
        soc: Soc,
        name: str,
        base: int,
        pwr: Pwr,
        irq: InterruptInput,
        oscillators: Oscillators = NOMINAL,
    ) -> None:
        super().__init__(soc, name, base)
        self._oscillators = oscillators
        self._pwr = pwr
        self._irq = irq
        self._gated: dict[int, _Controlled] = {}
        self._reset: dict[int, _Controlled] = {}
        self._chip: FcuChip | None = None
        self._listeners: list[Callable[[], None]] = []
        self._backup_listeners: list[Callable[[], None]] = []
        self.clocked_until_ps: dict[str, int] = {}
        """The latest time at which a peripheral's clock was switched off, by name."""
        self._starting: dict[str, Event] = {}
        self._check: Event | None = None
        self._pll_hz = self._pll_nominal_hz = 0
        # the frequencies in use, and the frequencies of the low-speed oscillators
        self._adopted: tuple[Frequencies, tuple[int, int, int]] | None = None
        self._adopt(frequencies(oscillators.hsi_hz, 0), frequencies(HSI_HZ, 0))

    # -- for the other peripherals ---------------------------------------------------------------------------

    def control(self, peripherals: Iterable[Peripheral], chip: FcuChip | None = None) -> None:
        """Set the peripherals to control, and switch their clocks off."""
        by_name = {peripheral.name: peripheral for peripheral in peripherals}
        self._chip = chip
        self._gated = {offset: _Controlled(names, by_name) for offset, names in ENABLE.items()}
        self._reset = {offset: _Controlled(names, by_name) for offset, names in RESET.items()}
        self._apply_all_gates()

    def on_change(self, changed: Callable[[], None]) -> None:
        """Call ``changed()`` after a change of any clock."""
        self._listeners.append(changed)

    def on_backup_reset(self, reset: Callable[[], None]) -> None:
        self._backup_listeners.append(reset)

    def rtc_hz(self) -> int:
        """Return the frequency of the RTC's clock; 0 if the clock is off or not ready (6.2.8)."""
        bdcr = self.registers[BDCR]
        if not bdcr & _RTCEN:
            return 0
        name = (None, "LSE", "LSI", "HSE")[rcc.BDCR.RTCSEL.get(bdcr)]
        if name is None or not self._ready(name):
            return 0
        if name == "HSE":
            divider = rcc.CFGR.RTCPRE.get(self.registers[CFGR])
            return self._oscillators.hse_hz // divider if divider >= 2 else 0
        return LSE_HZ if name == "LSE" else LSI_HZ

    def stop(self) -> None:
        """Select HSI, and switch HSE and the PLLs off, as after Stop (5.3.5, 6.3.1, 6.3.3)."""
        for name in ("HSE", "PLL", "PLLI2S"):
            self.registers[CR] &= ~(_SOURCES[name].on | _SOURCES[name].ready)
            if name in self._starting:
                self._starting.pop(name).cancel()
        self.registers[CR] |= _SOURCES["HSI"].on | _SOURCES["HSI"].ready
        self.registers[CFGR] = rcc.CFGR.SW.put(rcc.CFGR.SWS.put(self.registers[CFGR], HSI), HSI)
        self._update()

    def standby(self) -> None:
        """Reset all registers except the backup domain and LSI, which continue in Standby (5.3.6)."""
        self.stop()
        self._reset_registers({CSR: self.registers[CSR]})

    def reset_because(self, reason: str) -> None:
        """Set the flags of a reset; the end of Standby is a power reset (6.1.2)."""
        if reason == "STANDBY":
            self.registers[CSR] = self.REGISTERS[CSR]
        else:
            self.registers[CSR] |= _RESET_FLAG["PIN"] | _RESET_FLAG[reason]

    def reset(self) -> None:
        """Reset all registers except the backup domain and the reset flags (6.3.20, 6.3.21)."""
        for name in [name for name in self._starting if _SOURCES[name].register != BDCR]:
            self._starting.pop(name).cancel()
        self._adopted = None  # after Stop and Standby all clocks start again
        self._reset_registers({CSR: self.registers[CSR] & _FLAGS})

    def _reset_registers(self, kept: dict[int, int]) -> None:
        kept |= {BDCR: self.registers[BDCR]}
        for gates in ENABLE:
            self._note_clock_off(gates, self.registers[gates])
        self.registers = dict(self.REGISTERS) | kept
        self._irq.set(self.name, False)
        self._apply_all_gates()
        self._update()

    # -- registers --------------------------------------------------------------------------------------

    def write(self, offset: int, value: int, mask: int = WORD) -> None:
        if offset == BDCR and not self._pwr.backup_writable:
            self.note("refused", "backup-locked", "BDCR written while PWR_CR.DBP is 0")
            return
        if offset == PLLCFGR and self.registers[CR] & _SOURCES["PLL"].on:
            self.note(
                "forbidden",
                "pll-is-on",
                "PLLCFGR written while the PLL is on; it takes effect at the PLL's next start",
            )
        old = self.registers.get(offset, 0)
        super().write(offset, value, mask)
        value &= mask
        if offset in ENABLE:
            self._note_clock_off(offset, old & ~self.registers[offset])
            self._apply_gates(offset, self.registers[offset] ^ old)
        elif offset in RESET:
            self._apply_resets(offset, self.registers[offset] & ~old)
        elif offset == CIR:
            cleared = value >> rcc.CIR.LSIRDYC.lsb & (_READY_FLAGS | rcc.CIR.CSSF.mask)
            self.registers[CIR] &= ~cleared
            self._signal()
        elif offset in _OSCILLATORS:
            self._oscillators_written(offset, value)
        elif self.registers.get(offset, 0) != old:
            self._select()

    def _oscillators_written(self, offset: int, value: int) -> None:
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
        """Do not switch off the oscillator and the PLL that SYSCLK uses (6.3.1)."""
        used = {_SYSCLK_SOURCES[rcc.CFGR.SWS.get(self.registers[CFGR])]}
        if "PLL" in used:
            used.add(self._pll_source())
        for name in used:
            self.registers[CR] |= _SOURCES[name].on

    def _note_clock_off(self, offset: int, bits: int) -> None:
        off = (name for bit, name in ENABLE[offset].items() if bits >> bit & 1)
        self.clocked_until_ps |= dict.fromkeys(off, self.soc.clock.now_ps)

    def _apply_all_gates(self) -> None:
        for offset in self._gated:
            self._apply_gates(offset, WORD)

    def _apply_gates(self, offset: int, changed: int) -> None:
        controlled = self._gated.get(offset)
        if controlled is None:
            return
        enabled = self.registers[offset]
        in_c, in_python = controlled.of(changed)
        if self._chip is not None and in_c:
            self._chip.gate(in_c, controlled.of(enabled)[0])
        for bit, peripheral in in_python:
            clocked = bool(enabled >> bit & 1)
            peripheral.gate(clocked=clocked)
            if self._chip is not None:
                self._chip.gate_python(peripheral, clocked)

    def _apply_resets(self, offset: int, rising: int) -> None:
        controlled = self._reset.get(offset)
        if controlled is None or not rising:
            return
        in_c, in_python = controlled.of(rising)
        if self._chip is not None and in_c:
            self._chip.reset_peripherals(in_c)
        for _, peripheral in in_python:
            peripheral.reset()

    # -- oscillators ------------------------------------------------------------------------------------

    def _ready(self, name: str) -> bool:
        source = _SOURCES[name]
        return bool(self.registers[source.register] & source.ready)

    def _pll_source(self) -> str:
        return "HSE" if rcc.PLLCFGR.PLLSRC.get(self.registers[PLLCFGR]) else "HSI"

    def _update(self) -> None:
        for name, source in _SOURCES.items():
            on = self.registers[source.register] & source.on
            if not on:
                self.registers[source.register] &= ~source.ready
                if name in self._starting:
                    self._starting.pop(name).cancel()
            elif not self._ready(name) and name not in self._starting and self._has_input(name):
                self._start(name, source)
        self._select()

    def _has_input(self, name: str) -> bool:
        return name not in {"PLL", "PLLI2S"} or self._ready(self._pll_source())

    def _start(self, name: str, source: _Source) -> None:
        if name == "PLL":
            pllcfgr = self.registers[PLLCFGR]
            nominal = pll(pllcfgr, self._oscillators.nominal)
            self._pll_hz, self._pll_nominal_hz = pll(pllcfgr, self._oscillators).p_hz, nominal.p_hz
            self._note_settings(nominal, pllcfgr)
            if not self._pll_hz:  # N is 0 (6.3.2)
                return
        at_ps = self.soc.clock.now_ps + source.start_ps
        self._starting[name] = self.soc.clock.schedule(at_ps, partial(self._started, name))

    def _note_settings(self, nominal: PllOutput, pllcfgr: int) -> None:
        problem, fitting_hz = nominal.problem(), _fitting_crystal_hz(pllcfgr)
        if problem and fitting_hz:
            crystal_mhz, fits_mhz = self._oscillators.crystal_hz / 1e6, fitting_hz / 1e6
            self.note(
                "forbidden",
                "wrong-crystal",
                f"{problem}; the board's crystal has {crystal_mhz:g} MHz, but the settings fit {fits_mhz:g} MHz",
                crystal_mhz=crystal_mhz,
                fits_mhz=fits_mhz,
            )
        elif problem:
            self.note("forbidden", "pll-settings", problem, vco_mhz=nominal.vco_hz / 1e6)

    def _started(self, name: str) -> None:
        source = _SOURCES[name]
        del self._starting[name]
        self.registers[source.register] |= source.ready
        if self.registers[CIR] & source.enable:
            self.registers[CIR] |= source.flag
        self._signal()
        self._update()

    def _signal(self) -> None:
        cir = self.registers[CIR]
        enabled = cir >> rcc.CIR.LSIRDYIE.lsb
        self._irq.set(self.name, bool(cir & enabled & _READY_FLAGS))

    # -- frequencies ------------------------------------------------------------------------------------

    def _select(self) -> None:
        wanted = rcc.CFGR.SW.get(self.registers[CFGR])
        if wanted < len(_SYSCLK_SOURCES) and self._ready(_SYSCLK_SOURCES[wanted]):
            self.registers[CFGR] = rcc.CFGR.SWS.put(self.registers[CFGR], wanted)
        used = rcc.CFGR.SWS.get(self.registers[CFGR])
        true_hz = (self._oscillators.hsi_hz, self._oscillators.hse_hz, self._pll_hz)[used]
        nominal_hz = (HSI_HZ, self._oscillators.crystal_hz, self._pll_nominal_hz)[used]
        timpre, cfgr = bool(rcc.DCKCFGR.TIMPRE.get(self.registers[DCKCFGR])), self.registers[CFGR]
        self._adopt(frequencies(true_hz, cfgr, timpre=timpre), frequencies(nominal_hz, cfgr, timpre=timpre))

    def _adopt(self, clocks: Frequencies, nominal: Frequencies) -> None:
        lsi_hz, lse_hz = self._ready("LSI") * LSI_HZ, self._ready("LSE") * LSE_HZ
        adopted = clocks, (self.rtc_hz(), lsi_hz, lse_hz)
        if adopted == self._adopted:
            return
        self._adopted = adopted
        self._nominal = nominal
        self.lsi_hz, self.lse_hz = lsi_hz, lse_hz
        self.nominal_hclk_hz, self.nominal_pclk1_hz = nominal.hclk_hz, nominal.pclk1_hz
        self.sysclk_hz, self.hclk_hz = clocks.sysclk_hz, clocks.hclk_hz
        self.pclk1_hz, self.pclk2_hz = clocks.pclk1_hz, clocks.pclk2_hz
        self.timer1_hz, self.timer2_hz = clocks.timer1_hz, clocks.timer2_hz
        for changed in self._listeners:
            changed()
        if self._check is None and nominal.problem():
            self._check = self.soc.clock.schedule(self.soc.clock.now_ps + _CHECK_AFTER_PS, self._check_limits)

    def _check_limits(self) -> None:
        self._check = None
        problem = self._nominal.problem()
        if problem:
            self.note("forbidden", "bus-too-fast", problem, pclk1_mhz=self._nominal.pclk1_hz / 1e6)
