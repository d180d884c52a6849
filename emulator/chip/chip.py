"""The STM32F401 on the board: all its blocks, the core, and the firmware in flash.

A list and no behaviour: what is connected to what. The blocks' addresses are theirs; what the pins lead to
is the board's.
"""

from __future__ import annotations

from collections.abc import Iterable

from emulator.boards.signals import BoardSignals
from emulator.buses.i2c import I2CBus
from emulator.chip.cpu.core import Core, CoreSettings
from emulator.chip.peripherals.dbgmcu import SYSTEM_MEMORY, system_memory
from emulator.chip.peripherals.dma import DmaLines
from emulator.chip.peripherals.gpio import ConnectedPins
from emulator.chip.peripherals.i2c import I2C_BLOCKS, ConnectedI2c
from emulator.chip.peripherals.peripheral import Soc
from emulator.chip.peripherals.spi import SpiWire, connect_absent_part
from emulator.chip.peripherals.system_blocks import SystemBlocks
from emulator.chip.peripherals.tim import connect_timers
from emulator.chip.peripherals.usart import ConnectedUsarts, wire_terminal


class Chip:
    """The chip with its firmware, at power-on: ``core``, which has the blocks in C, and those in Python."""

    def __init__(
        self,
        signals: BoardSignals,
        segments: Iterable[tuple[int, bytes]],
        settings: CoreSettings,
    ) -> None:
        board, gpio = signals.board, signals.gpio
        memory = [(SYSTEM_MEMORY, system_memory(signals.number))]
        self.core = Core(signals.clock, signals.trace, segments, settings, memory)
        ConnectedPins(self.core, signals.gpio)
        self.soc = soc = Soc(signals.clock, signals.trace, signals.gpio, self._reset)
        self.system = SystemBlocks(soc)
        soc.dma = DmaLines(self.core)
        self.timers = connect_timers(self.core)
        """By name, "TIM1" to "TIM11"."""
        ConnectedUsarts(self.core, {board.serial.block: signals.uart})
        wire_terminal(self.core, board.serial.block, board.serial.tx)
        for name, spi in signals.spi.items():
            SpiWire(self.core, name, spi, gpio)
        for part in board.absent:
            connect_absent_part(self.core, part, gpio)
        for name in I2C_BLOCKS:
            if name in signals.i2c:
                pins = board.i2c[name]
                ConnectedI2c(self.core, name, signals.i2c[name], (pins.scl, pins.sda))
            else:  # nothing is connected to it
                ConnectedI2c(self.core, name, I2CBus(name, signals.clock, signals.trace))
        self.core.power_on(soc, self.system, self.system.rcc.reset_because)
        self.system.rcc.control(self.core.all_blocks)

    def _reset(self, reason: str) -> None:
        self.core.request_reset(reason)
