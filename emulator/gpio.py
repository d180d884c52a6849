"""GPIO output pins and what hangs on them (reference manual RM0368 section 8)."""

from __future__ import annotations

from emulator.clock import Clock
from emulator.trace import GpioEdge, Trace


class Gpio:
    """The output latches of all ports; pins are named by port letter and number, ``("B", 5)``."""

    def __init__(self, clock: Clock, trace: Trace) -> None:
        self._clock = clock
        self._trace = trace
        self._levels: dict[tuple[str, int], int] = {}

    def init_output(self, port: str, pin: int) -> None:
        """Make a pin a push-pull output; its latch resets to 0."""
        self.write(port, pin, self._levels.get((port, pin), 0))

    def write(self, port: str, pin: int, level: int) -> None:
        """Drive a pin; a change is an edge in the trace."""
        key = (port, pin)
        if self._levels.get(key) != level:
            self._levels[key] = level
            self._trace.add(GpioEdge(self._clock.now_ps, f"P{port}{pin}", level))

    def level(self, port: str, pin: int) -> int | None:
        """The level a pin is driven to; None while it is not an output."""
        return self._levels.get((port, pin))


class Led:
    """A LED on an output pin, lit while the pin is low (board facts, section 2)."""

    def __init__(self, name: str, gpio: Gpio, port: str, pin: int) -> None:
        self.name = name
        self.pin = f"P{port}{pin}"
        self._gpio = gpio
        self._where = port, pin

    @property
    def on(self) -> bool:
        """Whether it is lit; an unconfigured pin leaves it dark."""
        return self._gpio.level(*self._where) == 0
