"""Warnings about nearly full RAM."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest

from fcu_emulator.emulator.chip.diagnosis.memory_use import ram_nearly_full

RAM, RAM_END = 0x2000_0000, 0x2001_0000


@pytest.mark.parametrize(
    ("end", "stack_top", "reported"),
    [
        (RAM_END - 0x1000, RAM_END, True),
        (RAM + 0x3000, RAM_END, False),
        (RAM + 0x3000, RAM + 0x3400, False),  # the heap lies behind the stack, as in ChibiOS
    ],
)
def test_ram_warning_appears_only_without_free_space(end: int, stack_top: int, reported: bool) -> None:
    core: Any = SimpleNamespace(lowest_stack=stack_top)
    places: Any = SimpleNamespace(
        end_of_variables=lambda: end, stack_top=stack_top, largest_variables=lambda _count: []
    )
    assert (ram_nearly_full(core, places) is not None) is reported
