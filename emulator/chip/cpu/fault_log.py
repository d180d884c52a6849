"""The core's faults, with the state before exception entry."""

from __future__ import annotations

import struct
from dataclasses import dataclass

from fcu_emulator.emulator.chip.cpu.core import Core
from fcu_emulator.emulator.chip.cpu.exceptions import FAULT_HANDLERS, STKERR, CoreFault
from fcu_emulator.emulator.chip.memory_map import RAM
from fcu_emulator.emulator.chip.registers import address_of, flash, scb
from fcu_emulator.emulator.clock import PS_PER_MS, PS_PER_US

CORE = struct.Struct("<17I")
_CFSR, _HFSR = address_of("SCB", scb.CFSR), address_of("SCB", scb.HFSR)
_FLASH_CR, _PG = address_of("FLASH", flash.CR), flash.CR.PG.mask
_SOON_PS = PS_PER_MS
_SP, _LR, _XPSR = 13, 14, 16


def word_of(ram: bytes, address: int) -> int | None:
    """Return a word from a copy of the RAM."""
    offset = address - RAM
    if 0 <= offset <= len(ram) - 4:
        return int.from_bytes(ram[offset : offset + 4], "little")
    return None


@dataclass(frozen=True)
class FaultRecord:
    """One fault. ``registers``: R0 to R12, SP, LR, PC, xPSR. ``active``: a bit per exception."""

    t_ps: int
    fault: CoreFault
    pc: int
    registers: tuple[int, ...]
    cfsr: int
    hfsr: int
    ram: bytes
    active: int

    @property
    def sp(self) -> int:
        return self.registers[_SP]

    @property
    def lr(self) -> int:
        return self.registers[_LR]

    @property
    def handled(self) -> int:
        """The exception whose handler was running, or 0."""
        return self.registers[_XPSR] & 0x1FF

    def follows(self, other: FaultRecord) -> bool:
        """Return whether this fault is a consequence of ``other``."""
        if self.fault.cfsr & STKERR:
            return self.t_ps - other.t_ps <= PS_PER_US
        return bool(self.active & FAULT_HANDLERS)

    def word(self, address: int) -> int | None:
        return word_of(self.ram, address)


@dataclass(frozen=True)
class LostStore:
    """A store that FLASH refused; FaultRecord explains ``registers``."""

    t_ps: int
    address: int
    registers: tuple[int, ...]
    ram: bytes

    def word(self, address: int) -> int | None:
        return word_of(self.ram, address)


class FaultLog:
    """Records the core's faults, and the first store that FLASH refused.

    ``origin`` is the latest fault that is not a consequence of another fault. ``times`` counts how
    often this fault occurred within short intervals.
    """

    def __init__(self, core: Core) -> None:
        self._core = core
        self.seen = self.times = 0
        self.last_ps = 0
        self.latest: FaultRecord | None = None
        self.origin: FaultRecord | None = None
        self.lost_store: LostStore | None = None
        core.on_fault = self._record
        core.on_lost_store = self._record_lost_store

    def _record_lost_store(self, address: int) -> None:
        core = self._core
        # if PG is set, firmware programs the flash on purpose, and the order or size of its stores is wrong
        is_programming = (core.peek(_FLASH_CR) or 0) & _PG
        if self.lost_store is None and not is_programming:
            registers = CORE.unpack(core.core_state())
            self.lost_store = LostStore(core.clock.now_ps, address, registers, bytes(core.ram))

    def _record(self, fault: CoreFault) -> None:
        core = self._core
        now_ps, pc = core.clock.now_ps, core.pc
        self.seen += 1
        if self.origin is not None and self.origin.pc == pc and now_ps - self.last_ps <= _SOON_PS:
            self.times, self.last_ps = self.times + 1, now_ps
            return
        before = self.latest
        self.latest = record = FaultRecord(
            t_ps=now_ps,
            fault=fault,
            pc=pc,
            registers=CORE.unpack(core.core_state()),
            cfsr=core.peek(_CFSR) or 0,
            hfsr=core.peek(_HFSR) or 0,
            ram=bytes(core.ram),
            active=core.active,
        )
        if before is None or not record.follows(before):
            self.origin, self.times, self.last_ps = record, 1, now_ps
