"""What of a board its chip's pins lead to."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from emulator.boards.description import BoardDescription, Profile
from emulator.buses.gpio import Gpio
from emulator.buses.i2c import I2CBus
from emulator.buses.spi import SpiBus
from emulator.buses.uart import Uart
from emulator.time.clock import Clock
from emulator.trace import Trace


@dataclass(frozen=True)
class BoardSignals:
    """What of the board the chip's pins lead to, as ``board`` lists it; ``profile``: where its sensors are.

    ``uart`` is at the block of ``board.serial``; ``i2c`` and ``spi`` are the buses by their blocks' names.
    ``number``: of this board in its class, for the chip's unique id.
    """

    board: BoardDescription
    profile: Profile
    clock: Clock
    trace: Trace
    gpio: Gpio
    uart: Uart
    i2c: Mapping[str, I2CBus]
    spi: Mapping[str, SpiBus]
    number: int = 0
