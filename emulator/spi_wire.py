"""An SPI bus one byte at a time: what an SPI block of the chip is wired to, chip selects being GPIO pins.

A message is what lies between two edges of a chip select. A byte belongs to whoever is selected when it ends;
a chip select that rises earlier cuts the byte off, and the part never sees it. The parts pull their chip
selects up (LSM6DSL datasheet 2, LIS2MDL 2, LPS22HB 2), so a pin that firmware has not set up selects nobody.

With two chip selects low both parts hear every byte and drive the line against each other; the host reads the
AND of both here, and a note tells.
"""

from __future__ import annotations

from functools import partial
from typing import Protocol

from emulator.clock import Clock
from emulator.gpio import Gpio
from emulator.spi import SpiBus
from emulator.trace import DeviceNote, Trace
from sensors.spi import READ, UNDRIVEN, Mode, SpiTarget

_FASTEST_HZ = 10_000_000  # SPI clock frequency in the three datasheets


class SpiLine(Protocol):
    """The pins of an SPI block: it calls at the end of each byte, with the clock at that moment."""

    def configure(self, speed_hz: int, mode: Mode) -> None:
        """The host's clock rate, polarity and phase from the next byte on."""
        ...

    def exchange(self, value: int) -> int:
        """Full duplex: a byte out on MOSI while one comes in on MISO."""
        ...

    def send(self, value: int) -> None:
        """Three wires, host to part."""
        ...

    def receive(self) -> int:
        """Three wires, part to host."""
        ...


class _Message:
    """What has passed since a chip select fell."""

    __slots__ = ("chip_select", "received", "start_ps", "target", "written")

    def __init__(self, chip_select: str, target: SpiTarget, start_ps: int) -> None:
        self.chip_select = chip_select
        self.target = target
        self.start_ps = start_ps
        self.written = bytearray()
        self.received = bytearray()


class SpiWire:
    """The sensors' bus as its wires; ``gpio`` has the chip selects."""

    def __init__(self, bus: SpiBus, gpio: Gpio, clock: Clock, trace: Trace) -> None:
        self._bus = bus
        self._clock = clock
        self._trace = trace
        self._selected: list[_Message] = []
        for name in bus.chip_selects:
            port, pin = name[1], int(name[2:])
            gpio.frequent(port, pin)
            gpio.drive(port, pin, 1, by="pull-up of the part")
            gpio.listen(port, pin, partial(self._chip_select, name))

    def configure(self, speed_hz: int, mode: Mode) -> None:
        """The host's clock rate, polarity and phase from the next byte on."""
        self._bus.speed_hz, self._bus.mode = speed_hz, mode
        if speed_hz > _FASTEST_HZ:
            self._note(f"SCK runs at {speed_hz / 1e6:g} MHz; the parts' limit is 10 MHz")

    def exchange(self, value: int) -> int:
        """A byte each way. A part set to four wires answers a read; otherwise MISO is undriven."""
        answer = UNDRIVEN
        if not self._selected:
            self._bus.unheard.append((self._clock.now_ps, value))
        for message in self._selected:
            if message.written and message.written[0] & READ:
                answer &= self._read(message, 4)
            else:
                self._write(message, value)
        return answer

    def send(self, value: int) -> None:
        """A byte to the selected part."""
        if not self._selected:
            self._bus.unheard.append((self._clock.now_ps, value))
        for message in self._selected:
            self._write(message, value)

    def receive(self) -> int:
        """A byte from the selected part, which drives the one data line."""
        answer = UNDRIVEN
        if not self._selected:
            self._bus.unheard.append((self._clock.now_ps, None))
        for message in self._selected:
            answer &= self._read(message, 3)
        return answer

    def _write(self, message: _Message, value: int) -> None:
        message.written.append(value)
        message.target.write(bytes((value,)), self._bus.mode)

    def _read(self, message: _Message, wires: int) -> int:
        value = message.target.read(1, self._bus.mode, 3 if wires == 3 else 4)[0]
        message.received.append(value)
        return value

    def _chip_select(self, name: str, level: int) -> None:
        self._clock.settle()  # a byte that has ended by now still belongs to what was selected
        if level:
            self._deselect(name)
        else:
            self._select(name)

    def _select(self, name: str) -> None:
        target = self._bus.target(name)
        target.select()
        self._selected.append(_Message(name, target, self._clock.now_ps))
        if len(self._selected) > 1:
            names = " and ".join(message.chip_select for message in self._selected)
            self._note(f"chip selects {names} are low at once: the parts drive the line against each other")

    def _deselect(self, name: str) -> None:
        for message in self._selected:
            if message.chip_select == name:
                self._selected.remove(message)
                self._bus.end_ps = self._clock.now_ps
                if message.written or message.received:
                    now_ps = self._clock.now_ps
                    self._bus.recent.append(
                        (message.start_ps, now_ps, name, message.written, message.received)
                    )
                    self._bus.record(name, message.start_ps, bytes(message.written), bytes(message.received))
                return

    def _note(self, text: str) -> None:
        self._trace.add(DeviceNote(self._clock.now_ps, self._bus.name, "forbidden", text))
