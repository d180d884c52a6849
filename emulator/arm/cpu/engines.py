"""Which engine executes the firmware; its imports are late, so that a command can ask at no cost."""

from __future__ import annotations

import os
from collections.abc import Iterable
from typing import TYPE_CHECKING, Final

from emulator.errors import InputError

if TYPE_CHECKING:
    from emulator.arm.cpu.engine import Engine

NATIVE, UNICORN = "native", "unicorn"
CHOICES: Final = (NATIVE, UNICORN)
VARIABLE: Final = "FCU_ENGINE"
"""The environment variable that decides where nothing else does."""
HOW_TO_BUILD: Final = "install gcc or clang and Python's headers (python3-dev), then fcu-emulator again"


def why_not_native() -> str:
    """Why the native engine is not there, in words that follow "the native engine"; "" if it is."""
    from emulator.arm.cpu import native_engine

    return native_engine.missing()


def wanted() -> str:
    """What the environment asks for; "" if nothing. InputError if it cannot be had."""
    name = os.environ.get(VARIABLE, "")
    if name and name not in CHOICES:
        raise InputError(f"{VARIABLE}={name}: no such engine; known: {', '.join(CHOICES)}")
    if name == NATIVE and (missing := why_not_native()):
        raise InputError(f"{VARIABLE}={name}: the native engine {missing}; {HOW_TO_BUILD}")
    return name


def default() -> str:
    """The native engine where it was built, unless the environment asks for another (see :func:`wanted`)."""
    return wanted() or (UNICORN if why_not_native() else NATIVE)


def make(name: str, system_memory: Iterable[tuple[int, bytes]] = (), native_counter: bool = True) -> Engine:
    """An engine by its name; "" is the default, or Unicorn where its own way of counting is asked for.

    ValueError for another name; RuntimeError if it was not built.
    """
    chosen = name or (default() if native_counter else UNICORN)
    if chosen not in CHOICES:
        raise ValueError(f"{chosen}: no such engine; known: {', '.join(CHOICES)}")
    if chosen == NATIVE:
        from emulator.arm.cpu.native_engine import NativeEngine

        return NativeEngine(system_memory)
    from emulator.arm.cpu.unicorn_engine import UnicornEngine  # loads a library of 20 MB

    return UnicornEngine(system_memory, native_counter)
