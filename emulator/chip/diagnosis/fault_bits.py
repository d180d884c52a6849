"""The fault status registers bit by bit (ARMv7-M ARM B3.2.15, B3.2.16; PM0214 4.4.10, 4.4.11)."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Final

CFSR: Final[Mapping[int, tuple[str, str]]] = {
    0: ("IACCVIOL", "an instruction was fetched from where none may be executed"),
    1: ("DACCVIOL", "a load or store that the memory protection forbids"),
    3: ("MUNSTKERR", "the registers could not be taken back from the stack (memory protection)"),
    4: ("MSTKERR", "the registers could not be saved on the stack (memory protection)"),
    5: ("MLSPERR", "floating-point registers could not be saved (memory protection)"),
    7: ("MMARVALID", "MMFAR holds the address"),
    8: ("IBUSERR", "an instruction was fetched from where there is no memory"),
    9: ("PRECISERR", "a load or store was refused; the instruction is known exactly"),
    10: ("IMPRECISERR", "a store was refused some instructions ago"),
    11: ("UNSTKERR", "the registers could not be taken back from the stack"),
    12: ("STKERR", "the registers could not be saved on the stack"),
    13: ("LSPERR", "floating-point registers could not be saved on the stack"),
    15: ("BFARVALID", "BFAR holds the address"),
    16: ("UNDEFINSTR", "the bytes there are no instruction"),
    17: ("INVSTATE", "execution went to an even address: a Cortex-M knows Thumb code only, bit 0 must be 1"),
    18: ("INVPC", "the return from an exception was told a wrong value"),
    19: ("NOCP", "a floating-point instruction while the floating-point unit is off (CPACR)"),
    24: ("UNALIGNED", "an address that is no multiple of the access' size"),
    25: ("DIVBYZERO", "a division by zero, with CCR.DIV_0_TRP set"),
}
HFSR: Final[Mapping[int, tuple[str, str]]] = {
    1: ("VECTTBL", "the handler's address could not be read from the vector table"),
    30: ("FORCED", "the fault above became a HardFault: its own handler is not enabled, or may not preempt"),
    31: ("DEBUGEVT", "BKPT without a debugger"),
}


def decoded(register: str, value: int, bits: Mapping[int, tuple[str, str]]) -> Iterator[str]:
    """``CFSR 0x00008200`` and a line for each bit that is set."""
    yield f"{register} 0x{value:08X}"
    for number, (name, meaning) in bits.items():
        if value >> number & 1:
            yield f"  {name}: {meaning}"
