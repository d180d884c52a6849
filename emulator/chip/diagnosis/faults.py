"""The report of a fault."""

from __future__ import annotations

import itertools
import struct
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Final

from fcu_emulator.emulator.chip.cpu import exceptions
from fcu_emulator.emulator.chip.cpu.core import Core
from fcu_emulator.emulator.chip.cpu.exceptions import (
    BUS_FAULT,
    FAULT_HANDLERS,
    HARD_FAULT,
    MEM_MANAGE,
    NMI,
    USAGE_FAULT,
)
from fcu_emulator.emulator.chip.cpu.fault_log import CORE, FaultLog, FaultRecord, LostStore
from fcu_emulator.emulator.chip.cpu.thumb import decode
from fcu_emulator.emulator.chip.diagnosis.backtrace import NOTE, Backtrace, Call, Places, ReadCode
from fcu_emulator.emulator.chip.diagnosis.report import Cause, Diagnosis, at, section
from fcu_emulator.emulator.chip.memory_map import FLASH_MEMORY, RAM_MEMORY
from fcu_emulator.emulator.chip.registers import scb
from fcu_emulator.emulator.chip.registers.declaration import Word
from fcu_emulator.emulator.clock import PS_PER_MS, PS_PER_S

# -- fault status registers (ARMv7-M ARM B3.2.15, B3.2.16; PM0214 4.4.10, 4.4.11) ---------------------------

CFSR: Final[Mapping[str, str]] = {
    "IACCVIOL": "an instruction was fetched from memory that must not be executed",
    "DACCVIOL": "a load or store that the memory protection forbids",
    "MUNSTKERR": "the registers could not be restored from the stack (memory protection)",
    "MSTKERR": "the registers could not be saved on the stack (memory protection)",
    "MLSPERR": "floating-point registers could not be saved (memory protection)",
    "MMARVALID": "MMFAR holds the address",
    "IBUSERR": "an instruction was fetched from an address without memory",
    "PRECISERR": "a load or store was refused; the instruction is known exactly",
    "IMPRECISERR": "a store was refused some instructions ago",
    "UNSTKERR": "the registers could not be restored from the stack",
    "STKERR": "the registers could not be saved on the stack",
    "LSPERR": "floating-point registers could not be saved on the stack",
    "BFARVALID": "BFAR holds the address",
    "UNDEFINSTR": "the bytes there are not an instruction",
    "INVSTATE": "execution went to an even address: a Cortex-M runs Thumb code only, bit 0 must be 1",
    "INVPC": "the return from an exception had a wrong value",
    "NOCP": "a floating-point instruction while the floating-point unit is off (CPACR)",
    "UNALIGNED": "an address that is not a multiple of the access size",
    "DIVBYZERO": "a division by zero, with CCR.DIV_0_TRP set",
}
HFSR: Final[Mapping[str, str]] = {
    "VECTTBL": "the handler's address could not be read from the vector table",
    "FORCED": "the fault above became a HardFault: its own handler is not enabled, or may not preempt",
    "DEBUGEVT": "BKPT without a debugger",
}


def decoded(register: type[Word], value: int, meanings: Mapping[str, str]) -> Iterator[str]:
    """Return a line such as ``CFSR 0x00008200``, then one line for each set bit, the lowest bit first."""
    yield f"{register.__name__} 0x{value:08X}"
    for bits in reversed(register.fields):
        if value & bits.mask:
            yield f"  {bits.name}: {meanings[bits.name]}"


# -- causes -------------------------------------------------------------------------------------------------

_NULL_OBJECT = 0x1000  # an access below this address is to a member of an object at address 0
_NEAR = 0x1000  # bytes; an access at most this far from SP counts as an access to the stack
_ERASED_FLASH = 0xFFFF


def cause_of(record: FaultRecord, places: Places, code: ReadCode) -> Cause:
    """Return the likely cause of a fault."""
    status = record.fault.cfsr
    if status & exceptions.PRECISERR and record.fault.address is not None:
        return _of_access(record, record.fault.address, places, code)
    if status & (exceptions.STKERR | exceptions.UNSTKERR):
        return _of_stack(record, places)
    if status & exceptions.INVSTATE:
        return _of_even_address(record)
    if status & (exceptions.IBUSERR | exceptions.IACCVIOL):
        return Cause(
            f"execution went to 0x{record.pc:08X}, an address without code",
            ["A function pointer or a return address on the stack was overwritten, or never set."],
        )
    if status & exceptions.UNDEFINSTR:
        return _of_undefined(record, code)
    return _OTHERS.get(status) or _of_hard_fault(record)


# -- loads and stores -----------------------------------------------------------------------------------


def _of_access(record: FaultRecord, address: int, places: Places, code: ReadCode) -> Cause:
    stores = _stores(record.pc, code)
    on_stack = record.sp <= address < RAM_MEMORY.start or abs(address - record.sp) <= _NEAR
    if on_stack and stack_overflows(record, places):
        return _of_stack(record, places)
    verb = "write to" if stores else "read of"
    where = (
        "after the end of RAM"
        if RAM_MEMORY.end <= address < RAM_MEMORY.end + 0x1_0000
        else "which has no memory"
    )
    return Cause(
        f"{verb} address 0x{address:08X}, {where}",
        ["The pointer was never set or was overwritten, or an index is far too large."],
    )


def _stores(pc: int, code: ReadCode) -> bool:
    content = code(pc, 4)
    return (
        content is not None and decode(pc, content[0] | content[1] << 8, content[2] | content[3] << 8).stores
    )


def lost_store_report(store: LostStore | None, code: ReadCode, places: Places) -> Diagnosis | None:
    """Report the first store to locked flash, or to its alias at address 0."""
    if store is None:
        return None
    *_, sp, lr, pc, _ = store.registers
    trace = Backtrace(places, store.word, code)
    cause = _of_null(store.address) if store.address < FLASH_MEMORY.start else _of_constant(store.address)
    refused = "FLASH refuses the store and sets PGSERR in FLASH_SR; the program continues."
    return Diagnosis(
        "memory",
        f"{cause.short} at {at(store.t_ps)} in {places.place(pc)}: the value is lost",
        (*cause.sentences, refused, *section(f"callers ({NOTE})", trace.lines(pc, lr, sp))),
        fatal=False,
        at_ps=store.t_ps,
    )


def _of_constant(address: int) -> Cause:
    return Cause(
        f"write to flash, address 0x{address:08X},",
        [
            "Constants (const) and texts in quotes are in flash, which a normal store cannot write.",
            "Typical causes: a cast that removes const, or a char * to a string literal.",
        ],
    )


def _of_null(address: int) -> Cause:
    if address >= _NULL_OBJECT:
        what = f"Address 0x{address:08X} is far above a NULL pointer, probably with a large index."
    elif address:
        what = f"Address 0x{address:08X} is a member of a struct, {address} bytes after a NULL pointer."
    else:
        what = "Address 0x00000000 is the target of a NULL pointer."
    return Cause(
        "write through a NULL pointer",
        [
            what,
            "The write does not fault on this chip, because flash is also at 0.",
        ],
    )


# -- the stack ------------------------------------------------------------------------------------------


def stack_overflows(record: FaultRecord, places: Places) -> bool:
    """Return whether the stack pointer is below the space for the stack."""
    end = places.end_of_variables()
    return record.sp < (RAM_MEMORY.start if end is None else end)


def _of_stack(record: FaultRecord, places: Places) -> Cause:
    end = places.end_of_variables()
    sp = f"SP is 0x{record.sp:08X}"
    if record.sp < RAM_MEMORY.start:
        where = f"{sp}, below the RAM, which begins at 0x{RAM_MEMORY.start:08X}."
    elif end is not None and record.sp < end:
        where = f"{sp}, in the variables, which end at 0x{end:08X}."
    else:
        return Cause(
            "the stack cannot be used", [f"{sp}; RAM is {RAM_MEMORY}. The stack pointer was overwritten."]
        )
    return Cause(
        "stack overflow",
        [where, "The cause is endless recursion, or a local array that is too large for the stack."],
    )


# -- the destination of a jump --------------------------------------------------------------------------


def _of_even_address(record: FaultRecord) -> Cause:
    if not record.pc:
        return Cause(
            "call through a NULL function pointer",
            ["A function was called through a pointer that is 0, for example an unregistered callback."],
        )
    return Cause(
        f"jump to the even address 0x{record.pc:08X}",
        [
            "Addresses of functions have bit 0 set on a Cortex-M (Thumb).",
            "Take the address from the function's name, not from a number or a listing.",
        ],
    )


def _of_undefined(record: FaultRecord, code: ReadCode) -> Cause:
    content = code(record.pc, 4)
    word, second = struct.unpack("<2H", content) if content is not None else (0, 0)
    if word == _ERASED_FLASH and FLASH_MEMORY.holds(record.pc, record.pc):
        return Cause(
            f"execution went to erased flash, 0x{record.pc:08X}",
            ["A function pointer or a return address on the stack was overwritten, or never set."],
        )
    shown = f"{word:04X}{second:04X}" if decode(record.pc, word, second).size == 4 else f"{word:04X}"
    return Cause(
        f"0x{shown} at 0x{record.pc:08X} is not an instruction",
        ["Data was executed, or the program was not compiled with -mcpu=cortex-m4."],
    )


def _of_hard_fault(record: FaultRecord) -> Cause:
    if record.fault.hfsr & exceptions.DEBUGEVT:
        return Cause(
            "BKPT without a debugger",
            [
                "The cause is semihosting (--specs=rdimon.specs), an assertion, or a breakpoint left in the program."
            ],
        )
    return Cause("the vector table cannot be read", ["VTOR was set to an address without memory."])


_OTHERS = {
    exceptions.INVPC: Cause(
        "the return from an interrupt failed",
        [
            "The handler's stack was overwritten: an array in it, or in a function that it calls, is too small."
        ],
    ),
    exceptions.NOCP: Cause(
        "floating-point unit is off",
        ["SystemInit() switches it on (SCB->CPACR |= 0xF << 20); it was not called."],
    ),
    exceptions.UNALIGNED: Cause(
        "unaligned access",
        [
            "A pointer to bytes was cast to a pointer to a larger type.",
            "LDM, STM, LDRD and STRD need multiples of 4; with CCR.UNALIGN_TRP all loads and stores do.",
        ],
    ),
    exceptions.DIVBYZERO: Cause(
        "division by zero",
        ["CCR.DIV_0_TRP is set; without it the result would be 0."],
    ),
}

# -- the report ---------------------------------------------------------------------------------------------

_NAMES = {
    HARD_FAULT: "HardFault",
    MEM_MANAGE: "MemManage fault",
    BUS_FAULT: "BusFault",
    USAGE_FAULT: "UsageFault",
}
_XPSR = 16
_FAULTS_OF_A_LOOP, _JUST_NOW_PS = 10, PS_PER_MS
_REGISTERS = (*(f"R{number}" for number in range(13)), "SP", "LR", "PC", "xPSR")


def fault_report(core: Core, log: FaultLog, places: Places, transfers: list[str]) -> Diagnosis | None:
    """Return the fault that ended the firmware; None if the firmware recovered."""
    record, latest = log.origin, log.latest
    if record is None or latest is None:
        return None
    if core.locked_up:
        return _report(core, record, places, transfers, _locked_up(latest, places))
    if log.times >= _FAULTS_OF_A_LOOP and core.now_ps - log.last_ps < _JUST_NOW_PS:
        ending = (
            "The fault's handler returns to the same instruction, which faults again: "
            f"{log.times} times so far."
        )
        return _report(core, record, places, transfers, [ending])
    if core.active & FAULT_HANDLERS:
        return _report(core, record, places, transfers, _handler(core, places))
    return None


def fault_before_reset(
    core: Core, record: FaultRecord | None, places: Places, transfers: list[str]
) -> Diagnosis | None:
    """Return the fault whose handler has reset the chip."""
    if record is None or not core.resets or record.t_ps > core.resets[-1][0]:
        return None
    state, _ = core.before_reset
    handled = CORE.unpack(state)[_XPSR] & 0x1FF
    if handled not in _NAMES or core.resets[-1][1] != "SYSRESETREQ":
        return None
    count = len(core.resets)
    times = f", {count} times so far" if count > 1 else ""
    ending = [f"The fault's handler has reset the chip{times}, last at {at(core.resets[-1][0])}."]
    report = _report(core, record, places, transfers, ending)
    return replace(report, fatal=is_reset_endlessly(core))


_RESETS_OF_A_LOOP = 10


def is_reset_endlessly(core: Core) -> bool:
    """Return whether the latest resets are at most a second apart, and the next reset is not overdue."""
    times_ps = [t_ps for t_ps, _ in core.resets][-_RESETS_OF_A_LOOP:]
    if len(times_ps) < _RESETS_OF_A_LOOP:
        return False
    longest_ps = max(later - earlier for earlier, later in itertools.pairwise(times_ps))
    return longest_ps <= PS_PER_S and core.now_ps - times_ps[-1] <= 2 * longest_ps


def _report(
    core: Core, record: FaultRecord, places: Places, transfers: list[str], ending: list[str]
) -> Diagnosis:
    code = core.memory
    cause = cause_of(record, places, code)
    trace = Backtrace(places, record.word, code)
    calls = trace.calls(record.pc, record.lr, record.sp)
    callers = [trace.line(call) for call in calls[1:]]
    where = places.place(record.pc) + _from_program(calls, callers, places)
    if record.fault.cfsr & exceptions.INVSTATE or not FLASH_MEMORY.holds(record.pc, record.pc):
        where = f"0x{record.pc:08X}, {callers[0] if callers else 'called from an unknown place'}"
    details = [
        *cause.sentences,
        *section("fault status", list(_status(record))),
        *section("registers", list(_registers(record))),
        *section(f"callers ({NOTE})", callers),
        *ending,
        *section("last transfers", transfers),
        *places.help(),
    ]
    name = _name(core, record)
    return Diagnosis(
        "fault", f"{name} at {at(record.t_ps)} in {where}: {cause.short}", tuple(details), at_ps=record.t_ps
    )


def _from_program(calls: Sequence[Call], callers: Sequence[str], places: Places) -> str:
    start = places.address_of("main")
    own = places.file(start) if start is not None else ""
    if not own or places.file(calls[0].address) == own:
        return ""
    outer = zip(calls[1:], callers, strict=True)
    return next((f", {text}" for call, text in outer if places.file(call.address) == own), "")


def _name(core: Core, record: FaultRecord) -> str:
    number = record.fault.exception
    own = core.active >> number & 1
    return _NAMES[number if own else HARD_FAULT]


def _status(record: FaultRecord) -> Iterator[str]:
    yield from decoded(scb.CFSR, record.cfsr, CFSR)
    yield from decoded(scb.HFSR, record.hfsr, HFSR)
    if record.fault.address is not None:
        yield f"BFAR 0x{record.fault.address:08X}"


def _registers(record: FaultRecord) -> Iterator[str]:
    named = [f"{name:4} {value:08X}" for name, value in zip(_REGISTERS, record.registers, strict=True)]
    for first in range(0, len(named), 4):
        yield "  ".join(named[first : first + 4])


def _handler(core: Core, places: Places) -> list[str]:
    return [f"Since then the fault's handler is running: {places.place(core.pc)}."]


def _locked_up(record: FaultRecord, places: Places) -> list[str]:
    if record.handled == NMI and not record.active & FAULT_HANDLERS:
        how = "The fault came during the handling of an NMI; a fault handler cannot preempt an NMI."
    else:
        how = f"The fault's handler faulted as well, in {places.place(record.pc)} at {at(record.t_ps)}."
    return [how, "The core is locked up: only a reset helps."]
