"""The system control block: state, vector table, reset, fault status, FPU context (ARMv7-M ARM B3.2).

FPCCR.LSPACT never becomes 1: floating-point registers are stacked at exception entry, not at the
handler's first floating-point instruction. A program sees the difference only by looking at a frame that
it has not made use of. FPDSCR is stored; the engine starts a new context with FPSCR 0, which is FPDSCR's
reset value.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from emulator.arm.cpu import faults
from emulator.arm.cpu.nvic import (
    BUS_FAULT,
    FIRST_INTERRUPT,
    MEM_MANAGE,
    NMI,
    PEND_SV,
    SV_CALL,
    SYS_TICK,
    USAGE_FAULT,
    Nvic,
)

ACTLR, CPUID, ICSR, VTOR, AIRCR, SCR, CCR = 0x008, 0xD00, 0xD04, 0xD08, 0xD0C, 0xD10, 0xD14
SHPR1, SHPR2, SHPR3, SHCSR, CFSR, HFSR, DFSR = 0xD18, 0xD1C, 0xD20, 0xD24, 0xD28, 0xD2C, 0xD30
MMFAR, BFAR, AFSR, CPACR = 0xD34, 0xD38, 0xD3C, 0xD88
DHCSR, DCRSR, DCRDR, DEMCR = 0xDF0, 0xDF4, 0xDF8, 0xDFC
FPCCR, FPCAR, FPDSCR, MVFR0, MVFR1 = 0xF34, 0xF38, 0xF3C, 0xF40, 0xF44

SLEEPONEXIT, SLEEPDEEP, SEVONPEND = 1 << 1, 1 << 2, 1 << 4
NONBASETHRDENA, UNALIGN_TRP, DIV_0_TRP, STKALIGN = 1 << 0, 1 << 3, 1 << 4, 1 << 9
_SYSRESETREQ, _VECTCLRACTIVE, _PRIGROUP = 1 << 2, 1 << 1, 0x700
_ISRPENDING, _RETTOBASE = 1 << 22, 1 << 11
_BREAKPOINT_SEEN = 1 << 1

NAMES: Final = {
    ACTLR: "ACTLR",
    CPUID: "CPUID",
    ICSR: "ICSR",
    VTOR: "VTOR",
    AIRCR: "AIRCR",
    SCR: "SCR",
    CCR: "CCR",
    SHPR1: "SHPR1",
    SHPR2: "SHPR2",
    SHPR3: "SHPR3",
    SHCSR: "SHCSR",
    CFSR: "CFSR",
    HFSR: "HFSR",
    DFSR: "DFSR",
    MMFAR: "MMFAR",
    BFAR: "BFAR",
    AFSR: "AFSR",
    CPACR: "CPACR",
    DHCSR: "DHCSR",
    DCRSR: "DCRSR",
    DCRDR: "DCRDR",
    DEMCR: "DEMCR",
    FPCCR: "FPCCR",
    FPCAR: "FPCAR",
    FPDSCR: "FPDSCR",
    MVFR0: "MVFR0",
    MVFR1: "MVFR1",
}

_RESET: Final = {
    **dict.fromkeys(NAMES, 0),
    CPUID: 0x410F_C241,  # Cortex-M4 r0p1 (PM0214 4.4.2)
    CCR: STKALIGN,
    FPCCR: 0xC000_0000,  # ASPEN, LSPEN
    MVFR0: 0x1011_0021,
    MVFR1: 0x1100_0011,
}
_FEATURES = (0x30, 0x200, 0x10_0000, 0, 0x30, 0, 0x0100_0000, 0)
_INSTRUCTION_SETS = (0x0110_1110, 0x0211_2000, 0x2123_2231, 0x0111_1131, 0x0131_0132)
_IDENTIFICATION: Final = {0xD40 + 4 * n: word for n, word in enumerate(_FEATURES + _INSTRUCTION_SETS)}
"""ID_PFR0 to ID_ISAR4 (Cortex-M4 technical reference manual, table 4-1)."""

_WRITABLE: Final = {
    ACTLR: 0x307,
    VTOR: 0x3FFF_FF80,
    SCR: SLEEPONEXIT | SLEEPDEEP | SEVONPEND,
    CCR: 0x31B,
    SHPR1: 0x00F0_F0F0,
    SHPR2: 0xF000_0000,
    SHPR3: 0xF0F0_00F0,
    MMFAR: 0xFFFF_FFFF,
    BFAR: 0xFFFF_FFFF,
    CPACR: 0x00F0_0000,
    DEMCR: 0x010F_07F1,
    FPCCR: 0xC000_0000,
    FPCAR: 0xFFFF_FFF8,
    FPDSCR: 0x07C0_0000,
}
_SWITCHES = (VTOR, SCR, CCR, CPACR, DEMCR)
_CLEARED_BY_ONES = (CFSR, HFSR, DFSR)
_FIRST_OF_SHPR = {SHPR1: 4, SHPR2: 8, SHPR3: 12}

_ENABLED_BY_SHCSR = {16: MEM_MANAGE, 17: BUS_FAULT, 18: USAGE_FAULT}
_ACTIVE_IN_SHCSR = {0: 4, 1: 5, 3: 6, 7: 11, 8: 12, 10: 14, 11: 15}
_PENDING_IN_SHCSR = {12: USAGE_FAULT, 13: MEM_MANAGE, 14: BUS_FAULT, 15: SV_CALL}


class Scb:
    """Registers 0xE000ED00 and its neighbours.

    ``reset`` is called for SYSRESETREQ; ``present`` says which exception is being handled;
    ``written(offset, value)`` hears of a write to VTOR, SCR, CCR, CPACR or DEMCR, which matter outside.
    """

    OFFSETS: Final = (*NAMES, *_IDENTIFICATION)

    def __init__(
        self,
        nvic: Nvic,
        reset: Callable[[str], None],
        present: Callable[[], int],
        written: Callable[[int, int], None],
    ) -> None:
        self._nvic = nvic
        self._request_reset = reset
        self._present = present
        self._written = written
        self.registers = dict(_RESET)
        self.before_read: Callable[[], None] = lambda: None
        """Called before a register is read."""

    def reset(self) -> None:
        """After reset the vector table is at 0, where the flash appears."""
        self.registers = dict(_RESET)
        self._written(VTOR, 0)
        self._written(SCR, 0)
        self._written(CCR, self.registers[CCR])
        self._written(CPACR, 0)
        self._written(DEMCR, 0)

    def is_set(self, register: int, bit: int) -> bool:
        """Whether a bit of a register is 1."""
        return bool(self.registers[register] & bit)

    def fault_enabled(self, exception: int) -> bool:
        """Whether a configurable fault has its own handler; else it becomes a HardFault (B1.5.14)."""
        bit = {number: bit for bit, number in _ENABLED_BY_SHCSR.items()}.get(exception)
        return bit is None or self.is_set(SHCSR, 1 << bit)

    def record(self, fault: faults.Fault) -> None:
        """Show a fault in CFSR, HFSR and its address register."""
        self.registers[CFSR] |= fault.status
        self.registers[HFSR] |= fault.hard
        if fault.address is not None:
            self.registers[BFAR] = fault.address
        if fault.hard & faults.DEBUGEVT:
            self.registers[DFSR] |= _BREAKPOINT_SEEN

    # -- registers --------------------------------------------------------------------------------------

    def read(self, offset: int) -> int:
        """The word at an offset of the system control space."""
        self.before_read()
        if offset == ICSR:
            return self._state()
        if offset == AIRCR:
            return 0xFA05_0000 | self.registers[AIRCR]
        if offset == SHCSR:
            return self._handlers()
        return _IDENTIFICATION[offset] if offset in _IDENTIFICATION else self.registers[offset]

    def write(self, offset: int, value: int, mask: int) -> None:
        """Write the bits of ``mask``."""
        if offset in _CLEARED_BY_ONES:
            self.registers[offset] &= ~(value & mask)
        elif offset == ICSR:
            self._pend(value & mask)
        elif offset == AIRCR:
            self._control(value)
        elif offset == SHCSR:
            self._set_handlers(self._handlers() & ~mask | value & mask)
        else:
            self._store(offset, value, mask & _WRITABLE.get(offset, 0))

    def _store(self, offset: int, value: int, mask: int) -> None:
        self.registers[offset] = stored = self.registers.get(offset, 0) & ~mask | value & mask
        if offset in _FIRST_OF_SHPR:
            for byte in range(4):
                self._nvic.priority[_FIRST_OF_SHPR[offset] + byte] = stored >> 8 * byte & 0xFF
            self._nvic.changed = True
        elif offset == SCR:
            self._nvic.event_on_pending = bool(stored & SEVONPEND)
        if offset in _SWITCHES:
            self._written(offset, stored)

    def _state(self) -> int:
        """ICSR (B3.2.4)."""
        nvic = self._nvic
        value = self._present() | nvic.most_urgent() << 12
        value |= (nvic.pending >> SYS_TICK & 1) << 26 | (nvic.pending >> PEND_SV & 1) << 28
        value |= (nvic.pending >> NMI & 1) << 31
        if nvic.pending >> FIRST_INTERRUPT:
            value |= _ISRPENDING
        return value | _RETTOBASE if nvic.active.bit_count() <= 1 else value

    def _pend(self, value: int) -> None:
        for bit, exception in ((31, NMI), (28, PEND_SV), (26, SYS_TICK)):
            if value >> bit & 1:
                self._nvic.pend(exception)
        for bit, exception in ((27, PEND_SV), (25, SYS_TICK)):
            if value >> bit & 1:
                self._nvic.pending &= ~(1 << exception)

    def _control(self, value: int) -> None:
        """AIRCR; ignored without the key (B3.2.6)."""
        if value >> 16 != 0x05FA:
            return
        self.registers[AIRCR] = value & _PRIGROUP
        self._nvic.subpriority_bits = (value >> 8 & 7) + 1
        self._nvic.changed = True
        if value & _VECTCLRACTIVE:
            self._nvic.active = 0
        if value & _SYSRESETREQ:
            self._request_reset("SYSRESETREQ")

    def _handlers(self) -> int:
        """SHCSR (B3.2.13)."""
        value = self.registers[SHCSR]
        for bit, exception in _ACTIVE_IN_SHCSR.items():
            value |= (self._nvic.active >> exception & 1) << bit
        for bit, exception in _PENDING_IN_SHCSR.items():
            value |= (self._nvic.pending >> exception & 1) << bit
        return value

    def _set_handlers(self, value: int) -> None:
        nvic = self._nvic
        self.registers[SHCSR] = value & 0x7_0000
        for bit, exception in _ACTIVE_IN_SHCSR.items():
            nvic.active = nvic.active & ~(1 << exception) | (value >> bit & 1) << exception
        for bit, exception in _PENDING_IN_SHCSR.items():
            nvic.pending = nvic.pending & ~(1 << exception) | (value >> bit & 1) << exception
        nvic.changed = True
