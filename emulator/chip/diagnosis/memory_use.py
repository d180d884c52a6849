"""Warnings of nearly full flash and RAM."""

from __future__ import annotations

from fcu_emulator.emulator.chip.cpu.core import Core
from fcu_emulator.emulator.chip.diagnosis.backtrace import Places
from fcu_emulator.emulator.chip.diagnosis.report import Diagnosis
from fcu_emulator.emulator.chip.image import FirmwareImage
from fcu_emulator.emulator.chip.memory_map import FLASH_MEMORY, FLASH_SIZE, RAM_MEMORY, RAM_SIZE

_FULL = 0.9  # share of the flash
_LEFT = 10 * 1024  # bytes for heap and stack; printf of floats uses both


def flash_nearly_full(image: FirmwareImage) -> Diagnosis | None:
    """Report a flash that is more than nine tenths full."""
    used = sum(len(one.data) for one in image.segments if FLASH_MEMORY.holds(one.address, one.address))
    if used < _FULL * FLASH_SIZE:
        return None
    return Diagnosis(
        "memory",
        f"the flash is {100 * used / FLASH_SIZE:.0f} % full: {used} of {FLASH_SIZE} bytes",
        (
            'Further code may not fit; the linker then reports "region FLASH overflowed".',
            "Large const tables, printf of floats and -O0 need the most space; see arm-none-eabi-size.",
        ),
        fatal=False,
    )


def ram_nearly_full(core: Core, places: Places) -> Diagnosis | None:
    """Report too little space for heap and stack."""
    end = places.end_of_variables()
    if end is None or not RAM_MEMORY.start < end < places.stack_top or places.stack_top - end >= _LEFT:
        return None
    if RAM_MEMORY.end - places.stack_top >= _LEFT:
        return None  # between the stack and the end of RAM, there is enough space for a heap
    left = places.stack_top - end
    deepest = (
        places.stack_top - core.lowest_stack if RAM_MEMORY.holds(core.lowest_stack, core.lowest_stack) else 0
    )
    details = (
        [f"The stack has taken {deepest} of these bytes so far, measured at interrupts."] if deepest else []
    )
    largest = places.largest_variables(3)
    if largest:
        named = ", ".join(f"{name} ({size})" for name, size in largest)
        details.append(f"The largest variables, in bytes: {named}.")
    details.append("A stack that grows into the variables overwrites them without an error.")
    return Diagnosis(
        "memory",
        f"the RAM is {100 * (end - RAM_MEMORY.start) / RAM_SIZE:.0f} % full: {left} bytes remain for heap and stack",
        tuple(details),
        fatal=False,
    )
