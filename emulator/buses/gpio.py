"""The board's pins (RM0368 section 8).

A pin is low if any output drives it low. Without outputs, the pull resistor sets the level. A
floating input reads 0; on the real board it reads noise. The trace shows the edges of the chip's
outputs; it shows a released pin as 1.

Decision: two conflicting outputs on a pin are not an error but give 0, because no exercise can
short outputs on this board.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable
from functools import partial
from typing import Final, Protocol, TypeAlias

from fcu_emulator.emulator.clock import Clock
from fcu_emulator.emulator.text import shown
from fcu_emulator.emulator.trace import GpioEdge, Trace

LevelCallback: TypeAlias = Callable[[int], None]
"""``changed(level)`` is called with the chip's new input level, 0 or 1."""

_PORTS = "ABCDEH"  # the STM32F401 has no port F and G (RM0368 section 2.3)
_PIN_NAME = re.compile(rf"P([{_PORTS}])(1[0-5]|[0-9])")
BUTTON_S: Final = 0.1
"""Default duration of a press."""


def parse_pin(name: str) -> tuple[str, int]:
    """Return port and number of a pin such as "PA0". Raises ValueError."""
    found = _PIN_NAME.fullmatch(name)
    if found is None:
        raise ValueError(f'must be a pin of the chip, such as "PA0", not {shown(name)}')
    return found[1], int(found[2])


class ChipPins(Protocol):
    """The chip's pins, which report edges by :meth:`Gpio.show_edge`."""

    def side(self, port: str, pin: int) -> tuple[int | None, int | None, int | None]:
        """Return a pin's output level, pull level and alternate function."""
        ...

    def drive(self, port: str, pin: int, level: int | None) -> None:
        """Set the level of all outside drivers; None releases the pin."""
        ...

    def watch(self, port: str, pin: int) -> None:
        """Call :meth:`Gpio.tell` after every change."""
        ...

    def frequent(self, port: str, pin: int) -> None: ...


class _Pin:
    """The state of one pin."""

    __slots__ = ("alternate", "frequent", "listeners", "name", "output", "outside", "pull", "reads", "shown")

    def __init__(self, name: str) -> None:
        self.name = name
        self.output: int | None = None  # the chip's output stage; None is high impedance
        self.pull: int | None = None
        self.outside: dict[str, int] = {}
        self.alternate: int | None = None
        self.reads = 0
        self.shown: int | None = None  # the level in the trace; None before the first output
        self.frequent = False
        self.listeners: list[LevelCallback] = []

    def driven(self) -> int | None:
        level = self.output
        if self.outside:
            lowest = min(self.outside.values())
            level = lowest if level is None else min(lowest, level)
        return level

    def level(self) -> int | None:
        driven = self.driven()
        return self.pull if driven is None else driven

    def settle(self) -> None:
        reads = self.level() or 0
        if reads != self.reads:
            self.reads = reads
            for changed in self.listeners:
                changed(reads)


class Gpio:
    """The pins of all ports, such as ``("B", 5)``."""

    def __init__(self, clock: Clock, trace: Trace) -> None:
        self._clock = clock
        self._trace = trace
        self._pins = {(port, pin): _Pin(f"P{port}{pin}") for port in _PORTS for pin in range(16)}
        self._chip: ChipPins | None = None

    # -- with a chip ------------------------------------------------------------------------------------

    def attach(self, chip: ChipPins) -> None:
        self._chip = chip
        for (port, pin), one in self._pins.items():
            if one.frequent:
                chip.frequent(port, pin)
            if one.outside:
                chip.drive(port, pin, min(one.outside.values()))
            if one.listeners:
                chip.watch(port, pin)

    def show_edge(self, port: str, pin: int, level: int) -> None:
        self._trace_edge(self._pins[port, pin], level)

    def tell(self, port: str, pin: int, level: int) -> None:
        for changed in self._pins[port, pin].listeners:
            changed(level)

    def _pin(self, port: str, pin: int) -> _Pin:
        one = self._pins[port, pin]
        if self._chip is not None:
            one.output, one.pull, one.alternate = self._chip.side(port, pin)
        return one

    # -- the chip's side --------------------------------------------------------------------------------

    def init_output(self, port: str, pin: int) -> None:
        """Make a pin a push-pull output. The pin's level is 0, unless the pin was an output before."""
        self.write(port, pin, self._pins[port, pin].output or 0)

    def write(self, port: str, pin: int, level: int, *, open_drain: bool = False) -> None:
        """Drive a pin. Level 1 with ``open_drain`` releases the pin."""
        one = self._pins[port, pin]
        one.output = None if open_drain and level else level
        self._show(one, level)
        one.settle()

    def release(self, port: str, pin: int) -> None:
        one = self._pins[port, pin]
        one.output = None
        if one.shown == 0:
            self._show(one, 1)
        one.settle()

    def set_pull(self, port: str, pin: int, pull: int | None) -> None:
        one = self._pins[port, pin]
        one.pull = pull
        one.settle()

    def set_alternate(self, port: str, pin: int, function: int | None) -> None:
        self._pins[port, pin].alternate = function

    # -- common to both sides ---------------------------------------------------------------------------

    def level(self, port: str, pin: int) -> int | None:
        """Return the level; None while floating."""
        return self._pin(port, pin).level()

    def pins(self) -> Iterable[tuple[str, int]]:
        return self._pins.keys()

    def output(self, port: str, pin: int) -> int | None:
        """Return the output stage's level, or None."""
        return self._pin(port, pin).output

    def driven(self, port: str, pin: int) -> int | None:
        """Return the level that outputs drive. Pull resistors cannot light a LED."""
        return self._pin(port, pin).driven()

    def reads(self, port: str, pin: int) -> int:
        """Return the input level, 0 for a floating pin."""
        return self.level(port, pin) or 0

    def alternate(self, port: str, pin: int) -> int | None:
        return self._pin(port, pin).alternate

    def drive(self, port: str, pin: int, level: int | None, by: str = "outside") -> None:
        """Drive a pin from outside; None releases it."""
        self._clock.inputs += 1
        one = self._pins[port, pin]
        if level is None:
            one.outside.pop(by, None)
        else:
            one.outside[by] = level
        if self._chip is None:
            one.settle()
        else:
            self._chip.drive(port, pin, min(one.outside.values(), default=None))

    def press(self, port: str, pin: int, level: int, until_ps: int) -> None:
        """Let a button connect a pin to ground (0) or to the supply (1) from now until the time ``until_ps``.

        Presses of one pin may overlap; ground has priority over the supply.
        """
        button = f"button to {level} until {until_ps}"
        self.drive(port, pin, level, by=button)
        self._clock.schedule(until_ps, partial(self.drive, port, pin, None, by=button))

    def pull(self, port: str, pin: int) -> int | None:
        """Return the level of the pull resistor, or None."""
        return self._pin(port, pin).pull

    def listen(self, port: str, pin: int, changed: LevelCallback) -> None:
        """Call ``changed(level)`` after changes, in the order of registration."""
        self._pins[port, pin].listeners.append(changed)
        if self._chip is not None:
            self._chip.watch(port, pin)

    def frequent(self, port: str, pin: int) -> None:
        """Record the pin's edges only in a detailed trace."""
        self._pins[port, pin].frequent = True
        if self._chip is not None:
            self._chip.frequent(port, pin)

    def _show(self, pin: _Pin, level: int) -> None:
        if pin.shown != level:
            pin.shown = level
            self._trace_edge(pin, level)

    def _trace_edge(self, pin: _Pin, level: int) -> None:
        if not pin.frequent:
            self._trace.add(GpioEdge(self._clock.now_ps, pin.name, level))
        elif self._trace.detailed:
            self._trace.add_detail(GpioEdge(self._clock.now_ps, pin.name, level))


class Led:
    """A LED, lit while its pin is low."""

    def __init__(self, name: str, gpio: Gpio, port: str, pin: int) -> None:
        self.name = name
        self.pin = f"P{port}{pin}"
        self._gpio = gpio
        self._where = port, pin

    @property
    def on(self) -> bool:
        """Whether the LED is lit; a pull-down cannot light it."""
        return self._gpio.driven(*self._where) == 0
