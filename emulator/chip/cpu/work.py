"""The costliest part of a run (``work.h``)."""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from typing import Final

from fcu_emulator.emulator.chip.diagnosis.hang import exception_name
from fcu_emulator.emulator.chip.library import Costliest, FcuChip
from fcu_emulator.emulator.chip.memory_map import ADDRESSES, PAGE_SHIFT, PERIPHERALS

_PAGE_OTG, _PAGE_PRIVATE = 512, 513
_NAMES: Final = {
    (base + offset - PERIPHERALS) >> PAGE_SHIFT: name
    for name, (base, size) in ADDRESSES.items()
    for offset in range(0, max(size, 1), 1 << PAGE_SHIFT)
    if 0 <= base - PERIPHERALS < _PAGE_OTG << PAGE_SHIFT
} | {_PAGE_OTG: "OTG_FS", _PAGE_PRIVATE: "the core's registers"}


def _accesses(_chip: FcuChip, page: int) -> str:
    address = PERIPHERALS + (page << PAGE_SHIFT)
    return f"accesses to {_NAMES.get(page, f'reserved addresses at 0x{address:08X}')}"


def _events(chip: FcuChip, peripheral: int) -> str:
    return f"events of {chip.peripheral_by_index(peripheral).name}"


_KINDS: Final[tuple[Callable[[FcuChip, int], str], ...]] = (
    lambda _chip, _index: "instructions",
    _accesses,
    _events,
    lambda _chip, _index: "events of sensors and watchdogs",
    lambda _chip, number: f"exceptions {exception_name(number)}",
    lambda _chip, _index: "resets",
)
"""Descriptions in the order of enum CostKind in work.h."""


def costliest(chip: FcuChip) -> str:
    """Return the costliest kind of work, such as "2,000,000 accesses to RCC"."""
    found = Costliest()
    chip.library.fcu_costliest(chip.handle, ctypes.byref(found))
    return f"{found.times:,} {_KINDS[found.kind](chip, found.index)}"
