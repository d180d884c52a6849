"""Detection of C's ``^`` that was meant as a power, in the lab's arithmetic (ARMv7-M ARM A7.7.35, A7.7.36)."""

from __future__ import annotations

from collections.abc import Iterator

from fcu_emulator.emulator.chip.cpu.thumb import decode
from fcu_emulator.emulator.chip.diagnosis.backtrace import Places, ReadCode
from fcu_emulator.emulator.chip.image.symbols import FunctionAt

_ARITHMETIC = ("eCompass", "getAltitude")
_CALLERS = ("HAL_TIM_PeriodElapsedCallback", "main")
_SIGN_BIT = 0x400
"""EOR's encoding of the constant 0x80000000. Compilers change the sign of a double with this EOR."""


def exclusive_or(places: Places, code: ReadCode) -> str:
    """Return the place of the first EOR in the slides' functions or, if the program has none of them, in
    their usual callers."""
    for names in (_ARITHMETIC, _CALLERS):
        starts = [start for name in names if (start := places.address_of(name)) is not None]
        functions = (places.function(start) for start in starts)
        found = (at for one in functions if one for at in _found_in(one, code))
        address = next(found, None)
        if address is not None:
            return places.place(address)
        if starts and names is _ARITHMETIC:
            return ""
    return ""


def _found_in(function: FunctionAt, code: ReadCode) -> Iterator[int]:
    address, end = function.start, function.start + function.size
    constants: set[int] = set()
    while address < end:
        content = code(address, 4)
        if content is None:
            return
        if address & ~3 in constants:
            address += 2
            continue
        first, second = content[0] | content[1] << 8, content[2] | content[3] << 8
        constants.update(_constants(address, first, second))
        if _is_exclusive_or(first, second):
            yield address
        address += decode(address, first, second).size


def _constants(address: int, first: int, second: int) -> Iterator[int]:
    """Return the addresses of words loaded relative to the PC (A7.7.7, A7.7.44, A7.7.51, A7.7.236)."""
    base = address + 4 & ~3
    if first >> 11 == 0b01001:
        yield base + 4 * (first & 0xFF)
    elif first == 0xF8DF:
        yield base + (second & 0xFFC)
    elif (
        first >> 11 == 0b10100 or first == 0xF20F
    ):  # ADR gives the address of a double that is loaded afterwards
        offset = 4 * (first & 0xFF) if first >> 11 == 0b10100 else second & 0xFF
        yield from (base + offset, base + offset + 4)
    elif first == 0xE9DF or (first & 0xFFBF == 0xED9F and second & 0xE00 == 0xA00):
        yield from (base + 4 * (second & 0xFF), base + 4 * (second & 0xFF) + 4)


def _is_exclusive_or(first: int, second: int) -> bool:
    if first & 0xFFC0 == 0x4040:  # EORS Rdn, Rm
        return True
    if first & 0xFFE0 == 0xEA80:  # EOR Rd, Rn, Rm; with Rd = 15 it is TEQ
        return second >> 8 & 0xF != 0xF
    immediate = (first >> 10 & 1) << 11 | (second >> 12 & 7) << 8 | second & 0xFF
    is_immediate = first & 0xFBE0 == 0xF080 and second >> 15 == 0 and second >> 8 & 0xF != 0xF
    return is_immediate and immediate != _SIGN_BIT
