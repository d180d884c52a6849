"""Virtual time: drivers wait on the board's clock.

Decision: only named modules get virtual time, because pytest, other threads and serial links need
real time.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import ModuleType
from typing import TYPE_CHECKING, Any

from fcu_emulator.emulator.errors import InputError

if TYPE_CHECKING:
    from fcu_emulator.emulator.assembly.board import Board

_PS_PER_NS = 1000
_in_use: set[str] = set()  # modules that now run on a board's time


@contextmanager
def virtual_time(board: Board, *modules: ModuleType) -> Iterator[None]:
    """Make ``modules`` and their imported submodules use the board's clock.

    Until the block ends, references of these modules to the module ``time``, to its functions
    ``sleep``, ``monotonic``, ``perf_counter`` and ``time``, and to their ``_ns`` variants are
    replaced. The clocks count from power-on. Raises InputError if a module already uses a board's
    time.
    """
    found = _with_submodules(modules)
    taken = _in_use.intersection(found)
    if taken:
        raise InputError(
            f"cannot use the board's time for {min(taken)}: another with statement uses it; leave that statement first",
            kind="time_in_use",
        )
    replacements = _replacements(board)
    replaced: list[tuple[dict[str, Any], str, Any]] = []
    _in_use.update(found)
    try:
        for module in found.values():
            for name, value in list(vars(module).items()):
                if id(value) in replacements:
                    replaced.append((vars(module), name, value))
                    vars(module)[name] = replacements[id(value)]
        yield
    finally:
        for names, name, value in replaced:
            names[name] = value
        _in_use.difference_update(found)


def _with_submodules(modules: tuple[ModuleType, ...]) -> dict[str, ModuleType]:
    own = tuple(module.__name__ for module in modules)
    inside = tuple(f"{name}." for name in own)
    return {
        name: module for name, module in list(sys.modules.items()) if name in own or name.startswith(inside)
    }


def _replacements(board: Board) -> dict[int, object]:
    """Return replacements, keyed by id() because values of globals may not be hashable."""
    clock = board.clock

    def sleep(seconds: float) -> None:
        if seconds < 0:
            raise ValueError("sleep length must be non-negative")  # the message of time.sleep()
        board.run_for(seconds)

    def now_s() -> float:
        return clock.now_s

    def now_ns() -> int:
        return clock.now_ps // _PS_PER_NS

    functions: dict[str, Callable[..., Any]] = {
        "sleep": sleep,
        **dict.fromkeys(("monotonic", "perf_counter", "time"), now_s),
        **dict.fromkeys(("monotonic_ns", "perf_counter_ns", "time_ns"), now_ns),
    }
    module = ModuleType("time", "The virtual board's time.")
    vars(module).update({**vars(time), **functions})
    return {id(time): module, **{id(getattr(time, name)): virtual for name, virtual in functions.items()}}
