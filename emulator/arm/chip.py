"""The STM32F401 on the board: all its blocks, the core, and the firmware in flash.

A list and no behaviour: what is connected to what. The blocks' addresses are theirs; what the pins lead to
is the board's.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from emulator.arm.cpu.core import Core, CoreSettings
from emulator.arm.peripherals.comm_blocks import CommBlocks
from emulator.arm.peripherals.dbgmcu import SYSTEM_MEMORY, system_memory
from emulator.arm.peripherals.system_blocks import SystemBlocks
from emulator.arm.soc import Soc
from emulator.clock import Clock
from emulator.gpio import Gpio
from emulator.i2c import I2CBus
from emulator.spi import SpiBus
from emulator.trace import Trace
from emulator.uart import Uart


@dataclass(frozen=True)
class Surroundings:
    """What of the board the chip's pins lead to. ``board`` is the number of this board, for the unique id."""

    clock: Clock
    trace: Trace
    gpio: Gpio
    uart: Uart
    i2c2: I2CBus
    spi2: SpiBus
    board: int = 0


class Chip:
    """The chip with its firmware, at power-on. ``core`` runs it; ``system`` and ``comm`` are its blocks."""

    def __init__(
        self,
        surroundings: Surroundings,
        segments: Iterable[tuple[int, bytes]],
        settings: CoreSettings,
    ) -> None:
        around = surroundings
        self.soc = soc = Soc(around.clock, around.trace, around.gpio, self._reset)
        self.system = SystemBlocks(soc)
        self.comm = CommBlocks(soc, around.uart, around.i2c2, around.spi2)
        self.system.rcc.control((*self.system, *self.comm))
        self.core = Core(
            soc,
            segments,
            (*self.system, *self.comm),
            settings,
            system_memory=[(SYSTEM_MEMORY, system_memory(around.board))],
            on_reset=self.system.rcc.reset_because,
        )
        if self.core.native is not None:
            self.comm.i2c2.go_native(self.core.native, self.core.run)  # nothing is connected to the others

    def _reset(self, reason: str) -> None:
        self.core.request_reset(reason)
