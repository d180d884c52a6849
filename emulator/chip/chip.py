"""The STM32F401 on the board: all its blocks, the core, and the firmware in flash.

A list and no behaviour: what is connected to what. The blocks' addresses are theirs; what the pins lead to
is the board's.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from emulator.buses.gpio import Gpio
from emulator.buses.i2c import I2CBus
from emulator.buses.spi import SpiBus
from emulator.buses.uart import Uart
from emulator.chip.cpu.core import Core, CoreSettings
from emulator.chip.peripherals.dbgmcu import SYSTEM_MEMORY, system_memory
from emulator.chip.peripherals.dma import DmaLines
from emulator.chip.peripherals.gpio import ConnectedPins
from emulator.chip.peripherals.i2c import ConnectedI2c
from emulator.chip.peripherals.peripheral import Soc
from emulator.chip.peripherals.spi import SpiWire, connect_absent_radio
from emulator.chip.peripherals.system_blocks import SystemBlocks
from emulator.chip.peripherals.tim import connect_timers
from emulator.chip.peripherals.usart import ConnectedUsarts, wire_terminal
from emulator.time.clock import Clock
from emulator.trace import Trace

_USART1_TX = ("A", 9, 7)
_I2C2_PINS = ("B", 10, 4), ("B", 3, 9)
"""The terminal's line, and SCL and SDA, as the board has them (board facts, section 2)."""


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
    """The chip with its firmware, at power-on: ``core``, which has the blocks in C, and those in Python."""

    def __init__(
        self,
        surroundings: Surroundings,
        segments: Iterable[tuple[int, bytes]],
        settings: CoreSettings,
    ) -> None:
        around = surroundings
        memory = [(SYSTEM_MEMORY, system_memory(around.board))]
        self.core = Core(around.clock, around.trace, segments, settings, memory)
        ConnectedPins(self.core, around.gpio)
        self.soc = soc = Soc(around.clock, around.trace, around.gpio, self._reset)
        self.system = SystemBlocks(soc)
        soc.dma = DmaLines(self.core)
        self.timers = connect_timers(self.core)
        """By name, "TIM1" to "TIM11"."""
        ConnectedUsarts(self.core, {"USART1": around.uart})
        wire_terminal(self.core, "USART1", _USART1_TX)
        SpiWire(self.core, around.spi2, around.gpio)
        connect_absent_radio(self.core, around.gpio)
        ConnectedI2c(self.core, "I2C2", around.i2c2, _I2C2_PINS)
        for name in ("I2C1", "I2C3"):  # to which nothing is connected
            ConnectedI2c(self.core, name, I2CBus(name, around.clock, around.trace))
        self.core.power_on(soc, self.system, self.system.rcc.reset_because)
        self.system.rcc.control(self.core.all_blocks)

    def _reset(self, reason: str) -> None:
        self.core.request_reset(reason)
