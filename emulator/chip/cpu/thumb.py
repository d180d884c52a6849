"""A decoder of those properties of Thumb instructions that a diagnosis needs (ARMv7-M ARM A5)."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum, auto


class Flow(Enum):
    """Ways to continue after an instruction."""

    NEXT = auto()
    JUMP = auto()  # to ``target``
    BRANCH = auto()  # to ``target`` or to the next instruction
    CALL = auto()  # to ``target``, and back after the call
    RETURN = auto()  # to the address in LR
    POP_RETURN = auto()  # to an address on the stack
    IT = auto()  # the next ``in_block`` instructions are conditional
    UNKNOWN = auto()  # not followed


@dataclass(frozen=True, slots=True)
class Instruction:
    """An instruction. ``stores``: it changes something besides R0 to R12, SP, LR, PC and xPSR."""

    size: int
    flow: Flow = Flow.NEXT
    target: int = 0
    in_block: int = 0
    stores: bool = False


def decode(address: int, first: int, second: int) -> Instruction:
    """Return an instruction. ``second`` is needed only for instructions of 32 bits."""
    if first >> 11 in (0b11101, 0b11110, 0b11111):
        return _decode_32(address, first, second)
    return _decode_16(address, first)


def _signed(value: int, bits: int) -> int:
    return value - (1 << bits) if value >> bits - 1 else value


# -- 16 bits (A5.2) -------------------------------------------------------------------------------------


def _decode_16(address: int, code: int) -> Instruction:
    top4 = code >> 12
    if top4 == 0b1101:
        if code >> 8 & 0xF >= 14:  # UDF, SVC
            return Instruction(2, Flow.UNKNOWN)
        return Instruction(2, Flow.BRANCH, address + 4 + 2 * _signed(code & 0xFF, 8))
    if code >> 11 == 0b11100:
        return Instruction(2, Flow.JUMP, address + 4 + 2 * _signed(code & 0x7FF, 11))
    if code >> 10 == 0b010001:
        return _special_data_16(code)
    if top4 == 0b1011:
        return _miscellaneous_16(address, code)
    return Instruction(2, stores=_stores_16(code))


def _special_data_16(code: int) -> Instruction:
    if code >> 7 & 7 == 0b110:
        return Instruction(2, Flow.RETURN if code >> 3 & 0xF == 14 else Flow.UNKNOWN)
    to_pc = code & 0x87 == 0x87 and code >> 8 & 3 != 1
    return Instruction(2, Flow.UNKNOWN if to_pc or code >> 7 & 7 == 0b111 else Flow.NEXT)


def _miscellaneous_16(address: int, code: int) -> Instruction:
    if code & 0x0500 == 0x0100:  # CBZ, CBNZ
        return Instruction(2, Flow.BRANCH, address + 4 + (code >> 3 & 0x1F) * 2 + (code >> 9 & 1) * 64)
    if code & 0x0E00 == 0x0400:  # PUSH
        return Instruction(2, stores=True)
    if code & 0x0E00 == 0x0C00:  # POP
        return Instruction(2, Flow.POP_RETURN if code & 0x100 else Flow.NEXT)
    if code & 0x0F00 == 0x0F00:
        return _hint_16(code)
    changes_masks_or_stops = code & 0x0FE0 == 0x0660 or code & 0x0F00 == 0x0E00  # CPS, BKPT
    return Instruction(2, Flow.UNKNOWN if changes_masks_or_stops else Flow.NEXT)


def _hint_16(code: int) -> Instruction:
    mask = code & 0xF
    if mask:
        return Instruction(2, Flow.IT, in_block=4 - ((mask & -mask).bit_length() - 1))
    return Instruction(2, Flow.UNKNOWN if code & 0xF0 in (0x20, 0x30, 0x40) else Flow.NEXT)  # WFE, WFI, SEV


def _stores_16(code: int) -> bool:
    if code >> 12 == 0b0101:
        return code >> 9 & 7 < 3
    if code >> 12 in (0b0110, 0b0111, 0b1000, 0b1001, 0b1100):
        return not code >> 11 & 1
    return False


# -- 32 bits (A5.3) -------------------------------------------------------------------------------------


def _decode_32(address: int, first: int, second: int) -> Instruction:
    if first >> 11 == 0b11110 and second >> 15:
        return _branch_or_system_32(address, first, second)
    if first >> 10 & 7 in (0b011, 0b111) and first >> 11 != 0b11110:
        return Instruction(4, stores=True)  # coprocessors: the floating-point unit
    if first >> 9 == 0b1110100:
        return _multiple_or_dual_32(first, second)
    if first >> 9 == 0b1111100:
        return _single_32(first, second)
    return Instruction(4)


def _multiple_or_dual_32(first: int, second: int) -> Instruction:
    loads = bool(first >> 4 & 1)
    if first >> 6 & 1:
        exclusive_or_table = not (first >> 8 & 1 or first >> 5 & 1)
        return Instruction(4, Flow.UNKNOWN if exclusive_or_table else Flow.NEXT, stores=not loads)
    if loads and second >> 15:
        return Instruction(4, Flow.POP_RETURN)
    return Instruction(4, stores=not loads)


def _single_32(first: int, second: int) -> Instruction:
    loads = bool(first >> 4 & 1)
    word_to_pc = loads and first >> 5 & 3 == 2 and second >> 12 == 15
    return Instruction(4, Flow.UNKNOWN if word_to_pc else Flow.NEXT, stores=not loads)


def _branch_or_system_32(address: int, first: int, second: int) -> Instruction:
    if second & 0x5000 == 0:
        return _conditional_or_system_32(address, first, second)
    sign = first >> 10 & 1
    i1, i2 = 1 ^ (second >> 13 & 1) ^ sign, 1 ^ (second >> 11 & 1) ^ sign
    offset = sign << 24 | i1 << 23 | i2 << 22 | (first & 0x3FF) << 12 | (second & 0x7FF) << 1
    target = address + 4 + _signed(offset, 25)
    if second & 0x5000 == 0x5000:
        return Instruction(4, Flow.CALL, target)
    return Instruction(4, Flow.JUMP if second & 0x1000 else Flow.UNKNOWN, target)


def _conditional_or_system_32(address: int, first: int, second: int) -> Instruction:
    if first >> 6 & 0xF < 14:
        offset = (first >> 10 & 1) << 20 | (second >> 11 & 1) << 19 | (second >> 13 & 1) << 18
        offset |= (first & 0x3F) << 12 | (second & 0x7FF) << 1
        return Instruction(4, Flow.BRANCH, address + 4 + _signed(offset, 21))
    harmless = first & 0xFFF0 in (0xF3B0, 0xF3E0) and second & 0x00F0 != 0x20  # barriers, MRS; not CLREX
    return Instruction(4, Flow.NEXT if harmless else Flow.UNKNOWN)
