"""The STM32F401's peripherals at their addresses (RM0368 table 1) and interrupt inputs (table 38)."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from fcu_emulator.emulator.boards.description import BoardSignals
from fcu_emulator.emulator.buses.i2c import I2CBus
from fcu_emulator.emulator.chip.cpu.core import Core, CoreSettings
from fcu_emulator.emulator.chip.cpu.python_peripherals import unmodelled_peripherals
from fcu_emulator.emulator.chip.low_power import LowPower
from fcu_emulator.emulator.chip.memory_map import ADDRESSES
from fcu_emulator.emulator.chip.peripherals.adc import Adc
from fcu_emulator.emulator.chip.peripherals.dbgmcu import SYSTEM_MEMORY, Dbgmcu, system_memory
from fcu_emulator.emulator.chip.peripherals.flash import Flash
from fcu_emulator.emulator.chip.peripherals.gpio import ConnectedPins
from fcu_emulator.emulator.chip.peripherals.i2c import I2C_NAMES, ConnectedI2c
from fcu_emulator.emulator.chip.peripherals.otg import OtgFs
from fcu_emulator.emulator.chip.peripherals.peripheral import InterruptInput, Peripheral, Soc
from fcu_emulator.emulator.chip.peripherals.pwr import Pwr
from fcu_emulator.emulator.chip.peripherals.rcc import NOMINAL, Oscillators, Rcc
from fcu_emulator.emulator.chip.peripherals.rtc import Rtc
from fcu_emulator.emulator.chip.peripherals.spi import SpiWire, connect_absent_part
from fcu_emulator.emulator.chip.peripherals.tim import connect_timers
from fcu_emulator.emulator.chip.peripherals.usart import ConnectedUsarts, wire_terminal
from fcu_emulator.emulator.chip.peripherals.watchdogs import Iwdg, Wwdg


def _place(name: str) -> tuple[str, int]:
    return name, ADDRESSES[name][0]


class SystemPeripherals:
    """The peripherals in Python, without connections to pins and buses. The constructor sets ``soc.clocks``."""

    def __init__(self, soc: Soc, oscillators: Oscillators = NOMINAL) -> None:
        lines = {number: InterruptInput(soc, number) for number in (0, 4, 5)}
        self.pwr = Pwr(soc, *_place("PWR"))
        self.rcc = Rcc(soc, *_place("RCC"), self.pwr, lines[5], oscillators)
        soc.clocks = self.rcc
        self.flash = Flash(soc, *_place("FLASH"), lines[4])
        self.rtc = Rtc(soc, *_place("RTC"), self.pwr, self.rcc)
        self.iwdg = Iwdg(soc, *_place("IWDG"))
        self.wwdg = Wwdg(soc, *_place("WWDG"), lines[0])
        self.dbgmcu = Dbgmcu(soc, *_place("DBGMCU"))
        self.otg = OtgFs(soc, "OTG_FS", *ADDRESSES["OTG_FS"])
        self.named = unmodelled_peripherals(soc)

    def __iter__(self) -> Iterator[Peripheral]:
        yield from (self.rcc, self.pwr, self.flash)
        yield from (self.rtc, self.iwdg, self.wwdg, self.dbgmcu, self.otg, *self.named)


class Chip:
    """The chip at power-on, with all peripherals."""

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
        self.system = SystemPeripherals(soc, oscillators=Oscillators.of(signals.errors, signals.crystal_hz))
        self.timers = connect_timers(self.core)
        """The timers by name, "TIM1" to "TIM11"."""
        adc = self.core.peripherals["ADC1"]
        assert isinstance(adc, Adc)
        self.adc = adc
        self.usarts = ConnectedUsarts(self.core, {board.serial.peripheral: signals.uart})
        wire_terminal(self.core, board.serial.peripheral, board.serial.tx)
        for name, spi in signals.spi.items():
            SpiWire(self.core, name, spi, gpio)
        for part in board.absent:
            connect_absent_part(self.core, part, gpio)
        for name in I2C_NAMES:
            if name in signals.i2c:
                pins = board.i2c[name]
                ConnectedI2c(self.core, name, signals.i2c[name], (pins.scl, pins.sda))
            else:  # no device is connected to this bus
                ConnectedI2c(self.core, name, I2CBus(name, signals.clock, signals.trace))
        self.core.power_on(soc, self.system, self._before_reset)
        self.system.flash.connect(self.core.flash, self.core.flash_programmed, self.core.code_changed)
        self.system.rtc.connect(self.core.set_exti_line)
        self.low_power = LowPower(
            self.core, self.system.pwr, self.system.rcc, self.system.rtc, self.system.dbgmcu, self.system.wwdg
        )
        self.core.store_to_flash = self.system.flash.store
        self.system.rcc.control(self.core.all_peripherals, self.core)

    def _before_reset(self, reason: str) -> None:
        self.low_power.reset()
        self.system.rcc.reset_because(reason)

    def _reset(self, reason: str) -> None:
        self.core.request_reset(reason)
