"""A virtual STEVAL-FCU001V1: sensors, timer, UART and one physical world, in exact virtual time.

``from emulator import Board`` is all that course material needs; see :class:`emulator.board.board.Board`.

Names are loaded when they are first used: the board needs numpy, and ``fcu --help`` does not.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from emulator.board.board import Board
    from emulator.errors import (
        CallError,
        ExpectationError,
        FcuError,
        FirmwareError,
        I2CBusError,
        I2CError,
        I2CNackError,
        I2CStuckError,
        InputError,
        LinkError,
        RecordingError,
        ScenarioError,
    )

__all__ = [
    "Board",
    "CallError",
    "ExpectationError",
    "FcuError",
    "FirmwareError",
    "I2CBusError",
    "I2CError",
    "I2CNackError",
    "I2CStuckError",
    "InputError",
    "LinkError",
    "RecordingError",
    "ScenarioError",
]


def __getattr__(name: str) -> Any:
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module("emulator.board.board" if name == "Board" else "emulator.errors"), name)
