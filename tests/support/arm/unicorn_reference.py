"""Unicorn, the library form of QEMU's translator, as a reference for single instructions.

It has only the chip's flash (also at 0), RAM and system memory. Registers have the names of
:mod:`fcu_emulator.emulator.chip.cpu.core_registers`. The tests rely on these properties of Unicorn 2.1.

An exception number reported to the interrupt hook, and an error, leave PC, xPSR with ITSTATE, and all registers as
before the instruction (as after it for SVC).

The instruction hook is called before each executed instruction. ``uc_emu_stop`` in the hook ends the run before the
instruction, but has no effect inside an IT block, so a block is executed as a whole. The hook is not called if the
condition of an instruction fails; such instructions are counted from the address of the next instruction.

Unaligned LDM, STM, LDRD and STRD are executed, although the architecture requires a fault (ARMv7-M ARM A3.2.1).

Registers are read and written by C functions, because the package's methods take ten times as long per call.
"""

from __future__ import annotations

import ctypes
from functools import partial
from typing import Final

from unicorn import UC_ARCH_ARM, UC_MODE_MCLASS, UC_MODE_THUMB, Uc, UcError, arm_const
from unicorn import unicorn_const as uc
from unicorn.unicorn_py3.unicorn import uclib

from fcu_emulator.emulator.chip.cpu.bare_core import Stop, fetch_fault
from fcu_emulator.emulator.chip.cpu.core_registers import (
    CORE,
    FLOATING_POINT,
    MASKS,
    CoreRegisters,
    RegisterCalls,
)
from fcu_emulator.emulator.chip.memory_map import (
    FLASH,
    FLASH_SIZE,
    RAM,
    RAM_SIZE,
    SYSTEM_MEMORY,
    SYSTEM_MEMORY_SIZE,
)

THUMB = 1 << 24
_PAGE = 4096
_NEVER_REACHED = 0xFFFF_FFFF
_EXECUTABLE = uc.UC_PROT_READ | uc.UC_PROT_EXEC

_NUMBERS: Final = {
    name: getattr(arm_const, f"UC_ARM_REG_{name.upper()}")
    for name in (*CORE, "msp", "psp", *MASKS, *FLOATING_POINT)
}
_INTERRUPTS: Final = {
    1: Stop.UNDEFINED,
    2: Stop.SVC,
    3: Stop.EXECUTE_NEVER,
    4: Stop.UNALIGNED,
    7: Stop.BKPT,
    8: Stop.EXCEPTION_RETURN,
    17: Stop.NO_COPROCESSOR,
    18: Stop.INVALID_STATE,
}
"""QEMU's exception numbers (target/arm/cpu.h). Only LDREX at an unaligned address causes 4, the data abort."""
_READS = uc.UC_ERR_READ_UNMAPPED, uc.UC_ERR_READ_PROT
_WRITES = uc.UC_ERR_WRITE_UNMAPPED, uc.UC_ERR_WRITE_PROT
_FETCHES = uc.UC_ERR_FETCH_UNMAPPED, uc.UC_ERR_FETCH_PROT


class UnicornCore:
    """A Cortex-M4F before its first instruction; set ``pc`` and ``thumb``, then ``run``."""

    def __init__(self) -> None:
        self._uc = Uc(UC_ARCH_ARM, UC_MODE_THUMB | UC_MODE_MCLASS)
        self._uc.ctl_set_cpu_model(arm_const.UC_CPU_ARM_CORTEX_M4)
        self.flash = self._map(FLASH_SIZE, _EXECUTABLE, FLASH, 0)
        self.ram = self._map(RAM_SIZE, uc.UC_PROT_ALL, RAM)
        system = self._map(SYSTEM_MEMORY_SIZE, _EXECUTABLE, SYSTEM_MEMORY)
        self.flash[:], system[:] = b"\xff" * FLASH_SIZE, b"\xff" * SYSTEM_MEMORY_SIZE
        self._memories = ((RAM, self.ram), (FLASH, self.flash), (0, self.flash), (SYSTEM_MEMORY, system))
        self._uc.hook_add(uc.UC_HOOK_CODE, self._before)
        self._uc.hook_add(uc.UC_HOOK_INTR, self._on_interrupt)
        self._core = CoreRegisters(self, CORE)
        self._pc = CoreRegisters(self, ("pc",))
        self.pc, self.thumb = 0, True
        self.executed = self._limit = 0
        self._next = self._conditional = 0  # address of the next instruction; how many an IT block still has
        self._stop = Stop.SLICE

    def _map(self, size: int, rights: int, *addresses: int) -> memoryview[int]:
        """Map memory of this process, so that a comparison need not copy it. Unicorn requires the start of a page."""
        buffer = ctypes.create_string_buffer(size + _PAGE)
        skipped = -ctypes.addressof(buffer) % _PAGE
        for address in addresses:
            self._uc.mem_map_ptr(address, size, rights, ctypes.addressof(buffer) + skipped)
        return memoryview(buffer).cast("B")[skipped : skipped + size]

    # -- state ------------------------------------------------------------------------------------------

    def memory(self, address: int, size: int) -> memoryview[int] | None:
        """Return ``size`` bytes of RAM, flash (also at 0) or system memory; None for other addresses."""
        for base, content in self._memories:
            offset = address - base
            if 0 <= offset <= len(content) - size:
                return content[offset : offset + size]
        return None

    def invalidate_code(self) -> None:
        """Translate code again, because flash or RAM were changed from outside."""
        self._uc.ctl_flush_tb()

    def register_calls(self, names: tuple[str, ...]) -> RegisterCalls:
        """Return the calls for :class:`CoreRegisters`."""
        count = len(names)
        numbers = (ctypes.c_int * count)(*(_NUMBERS[name] for name in names))
        values = (ctypes.c_uint32 * count)()
        places = (ctypes.c_void_p * count)(*(ctypes.addressof(values) + 4 * n for n in range(count)))
        call = self._uc._uch, numbers, places, count
        words = memoryview(values).cast("B").cast("I")
        return words, partial(uclib.uc_reg_read_batch, *call), partial(uclib.uc_reg_write_batch, *call)

    def register(self, number: int) -> int:
        """Return a register of R0 to R15."""
        return self._core.read()[number]

    # -- running ----------------------------------------------------------------------------------------

    def run(self, instructions: int) -> Stop:
        """Execute at most this number from ``pc``; return the reason of the end.

        ``executed`` also counts a faulting instruction.
        """
        self._stop, self.executed, self._limit = Stop.SLICE, 0, instructions
        self._next, self._conditional = self.pc, 0
        ended = self._start()
        self.pc = self._pc.read()[0]
        if self.executed > instructions:
            self.executed -= 1  # the one that the run was ended before
        elif self._stop is Stop.SLICE:
            return ended
        return self._stop

    def _start(self) -> Stop:
        try:
            self._uc.emu_start(self.pc | self.thumb, _NEVER_REACHED)
        except UcError as error:
            return self._met(error.errno)
        return Stop.WFI

    def _met(self, error: int) -> Stop:
        if error in _READS:
            return Stop.READ
        if error in _WRITES:
            return Stop.WRITE
        if error in _FETCHES:
            return fetch_fault(self._pc.read()[0])
        assert error == uc.UC_ERR_INSN_INVALID, f"Unicorn error {error}"
        return Stop.UNDEFINED if self._core.read()[16] & THUMB else Stop.INVALID_STATE

    def _before(self, _uc: Uc, address: int, size: int, _data: object) -> None:
        while self._conditional and self._next != address:
            self._next += 4 if self._half_word(self._next) >> 11 >= 0x1D else 2
            self._conditional -= 1
            self.executed += 1
        self.executed += 1
        self._next = address + size
        if self._conditional:
            self._conditional -= 1
        elif (word := self._half_word(address)) >> 8 == 0xBF and word & 0xF:
            self._conditional = 5 - (word & -word).bit_length()  # IT's mask ends with a 1 (A7.3.2)
        if self.executed > self._limit:
            self._uc.emu_stop()

    def _half_word(self, address: int) -> int:
        content = self.memory(address, 2)
        assert content is not None
        return int.from_bytes(content, "little")

    def _on_interrupt(self, _uc: Uc, number: int, _data: object) -> None:
        self._stop = _INTERRUPTS[number]
        self._uc.emu_stop()
