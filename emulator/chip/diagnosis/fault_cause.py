"""What a fault means for whoever wrote the program."""

from __future__ import annotations

import struct

from emulator.chip.cpu import faults
from emulator.chip.cpu.fault_log import FaultRecord
from emulator.chip.cpu.thumb import decode
from emulator.chip.diagnosis.backtrace import ReadCode
from emulator.chip.diagnosis.places import Places
from emulator.chip.diagnosis.report import Cause
from emulator.chip.image.memory_map import FLASH, RAM

_NULL_OBJECT = 0x1000  # bytes; what lies below is a member of something at address 0
_NEAR = 0x1000  # bytes from the stack pointer that a store to the stack may be away
_ERASED = 0xFFFF


def cause_of(record: FaultRecord, places: Places, code: ReadCode) -> Cause:
    """The likely cause of a fault."""
    status = record.fault.status
    if status & faults.PRECISERR and record.fault.address is not None:
        return _of_access(record, record.fault.address, places, code)
    if status & (faults.STKERR | faults.UNSTKERR):
        return _of_stack(record, places)
    if status & faults.INVSTATE:
        return _of_even_address(record)
    if status & (faults.IBUSERR | faults.IACCVIOL):
        return Cause(
            f"execution went to 0x{record.pc:08X}, where no program is",
            ["A function pointer or a return address on the stack was overwritten, or never set."],
        )
    if status & faults.UNDEFINSTR:
        return _of_undefined(record, code)
    return _OTHERS.get(status) or _of_hard_fault(record)


# -- loads and stores -----------------------------------------------------------------------------------


def _of_access(record: FaultRecord, address: int, places: Places, code: ReadCode) -> Cause:
    stores = _stores(record.pc, code)
    on_stack = record.sp <= address < RAM.start or abs(address - record.sp) <= _NEAR
    if on_stack and stack_overflows(record, places):
        return _of_stack(record, places)
    if stores and address < FLASH.end - FLASH.start:
        return _of_null(address)
    if stores and FLASH.holds(address, address):
        return Cause(
            f"write to flash, address 0x{address:08X}",
            [
                "Constants (const) and texts in quotes lie in flash, which a program cannot simply write.",
                "A cast away from const, or a char * to a text, leads here.",
            ],
        )
    verb = "write to" if stores else "read of"
    where = "behind the end of RAM" if RAM.end <= address < RAM.end + 0x1_0000 else "where nothing is"
    return Cause(
        f"{verb} address 0x{address:08X}, {where}",
        ["The pointer was never set or was overwritten, or an index is far too large."],
    )


def _stores(pc: int, code: ReadCode) -> bool:
    content = code(pc, 4)
    return (
        content is not None and decode(pc, content[0] | content[1] << 8, content[2] | content[3] << 8).stores
    )


def _of_null(address: int) -> Cause:
    if address >= _NULL_OBJECT:
        what = f"address 0x{address:08X}: far behind a NULL pointer, as with a large index into it."
    elif address:
        what = f"address 0x{address:08X}: a member of a NULL pointer, {address} bytes behind its start."
    else:
        what = "address 0x00000000: what a NULL pointer points to."
    return Cause(
        "write through a NULL pointer",
        [
            what,
            "A read through a NULL pointer does not fault on this chip: flash is at 0, too, and is read.",
        ],
    )


# -- the stack ------------------------------------------------------------------------------------------


def stack_overflows(record: FaultRecord, places: Places) -> bool:
    """Whether the stack pointer has left the room for the stack."""
    end = places.end_of_variables()
    return record.sp < (RAM.start if end is None else end)


def _of_stack(record: FaultRecord, places: Places) -> Cause:
    end = places.end_of_variables()
    sp = f"SP is 0x{record.sp:08X}"
    if record.sp < RAM.start:
        where = f"{sp}, below the RAM, which begins at 0x{RAM.start:08X}."
    elif end is not None and record.sp < end:
        where = f"{sp}, in the variables, which end at 0x{end:08X}."
    else:
        return Cause("the stack cannot be used", [f"{sp}; RAM is {RAM}. The stack pointer was overwritten."])
    return Cause(
        "stack overflow",
        [where, "A recursion without end, or arrays in functions that are too large for the stack."],
    )


# -- where execution went -------------------------------------------------------------------------------


def _of_even_address(record: FaultRecord) -> Cause:
    if not record.pc:
        return Cause(
            "call through a NULL function pointer",
            ["A function was called by a pointer that is 0: a callback that was never registered?"],
        )
    return Cause(
        f"jump to the even address 0x{record.pc:08X}",
        [
            "Addresses of functions have bit 0 set on a Cortex-M (Thumb).",
            "Take them from the function's name, not from a number or a listing.",
        ],
    )


def _of_undefined(record: FaultRecord, code: ReadCode) -> Cause:
    content = code(record.pc, 4)
    word, second = struct.unpack("<2H", content) if content is not None else (0, 0)
    if word == _ERASED and FLASH.holds(record.pc, record.pc):
        return Cause(
            f"execution went to erased flash, 0x{record.pc:08X}",
            ["A function pointer or a return address on the stack was overwritten, or never set."],
        )
    shown = f"{word:04X}{second:04X}" if decode(record.pc, word, second).size == 4 else f"{word:04X}"
    return Cause(
        f"0x{shown} at 0x{record.pc:08X} is no instruction",
        ["Data was executed, or the program was compiled for another core (-mcpu=cortex-m4)."],
    )


def _of_hard_fault(record: FaultRecord) -> Cause:
    if record.fault.hard & faults.DEBUGEVT:
        return Cause(
            "BKPT without a debugger",
            ["Semihosting (--specs=rdimon.specs), an assertion, or a breakpoint left in the program."],
        )
    return Cause("the vector table cannot be read", ["VTOR was set to an address where no memory is."])


_OTHERS = {
    faults.INVPC: Cause(
        "the return from an interrupt went wrong",
        ["The handler's stack was overwritten: an array in it, or in what it calls, is too small."],
    ),
    faults.NOCP: Cause(
        "floating-point unit is off",
        ["SystemInit() switches it on (SCB->CPACR |= 0xF << 20); it was not called."],
    ),
    faults.UNALIGNED: Cause(
        "unaligned access",
        [
            "A pointer to a larger type was made of one to bytes.",
            "LDM, STM, LDRD and STRD need multiples of 4; with CCR.UNALIGN_TRP all loads and stores do.",
        ],
    ),
    faults.DIVBYZERO: Cause(
        "division by zero",
        ["CCR.DIV_0_TRP is set; without it the result would be 0."],
    ),
}
