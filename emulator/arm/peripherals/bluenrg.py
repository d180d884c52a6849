"""The board's Bluetooth module, absent: SPI1 (PA5 to PA7), chip select PB0, reset PB2, interrupt PA4.

The virtual board has no radio. Nobody drives MISO, so ST's stock firmware reads a header that is not 0x02,
gives up each of its requests after its own time-outs (0.2 s a request) and reaches its main loop (board
facts, section 9). The interrupt line is low, as of a module that has nothing to say: high would keep HCI_Isr
in its loop for ever.
"""

from __future__ import annotations

from emulator.clock import Clock
from emulator.gpio import Gpio
from emulator.trace import DeviceNote, Trace
from sensors.spi import UNDRIVEN, Mode

_CHIP_SELECT = ("B", 0)
_INTERRUPT = ("A", 4)


class BlueNrgAbsent:
    """An SPI line with nobody at its end; the first attempt to talk to the module is told in the trace."""

    def __init__(self, gpio: Gpio, clock: Clock, trace: Trace) -> None:
        self._gpio = gpio
        self._clock = clock
        self._trace = trace
        self._told = False
        gpio.frequent(*_CHIP_SELECT)
        gpio.drive(*_INTERRUPT, 0, by="BlueNRG")

    def configure(self, speed_hz: int, mode: Mode) -> None:
        """Nobody listens to the clock."""
        del speed_hz, mode

    def exchange(self, value: int) -> int:
        """A byte nobody hears, and an undriven MISO."""
        self.send(value)
        return UNDRIVEN

    def send(self, value: int) -> None:
        """A byte nobody hears."""
        del value
        if not self._told and self._gpio.level(*_CHIP_SELECT) == 0:
            self._told = True
            text = "the Bluetooth module is absent on the virtual board; firmware goes on after its time-outs"
            self._trace.add(DeviceNote(self._clock.now_ps, "BlueNRG", "not modelled", text))

    def receive(self) -> int:
        """An undriven line."""
        return UNDRIVEN
