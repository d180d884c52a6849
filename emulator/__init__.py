"""A virtual STEVAL-FCU001V1: sensors on a bus, a timer, a UART, and one physical world, in exact virtual time.

``from emulator import Board`` is all that course material needs; see :class:`emulator.board.Board`.
"""

from emulator.board import Board
from emulator.errors import (
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
