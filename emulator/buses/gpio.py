"""The pins: drivers, resulting levels, listeners (reference manual RM0368 section 8).

A pin has three kinds of drivers: the chip's output stage, any number of outside drivers (a sensor's interrupt
pin, a button, a receiver), and the chip's weak pull resistor. The lowest strong driver wins, as on an
open-drain wire; without a strong driver the pull resistor decides; without one the pin floats. A floating
input reads as 0 here, on the board as noise.

Decision: two conflicting outputs on a pin are not an error but resolve to 0. Distinguishing a short circuit
from an open-drain wire would need the output type of every driver, and no exercise can short two outputs on
this board.

The trace shows the chip's actions: an edge when its output stage changes, also to open drain high (1). A pin
that stops being an output shows 1, because it does not pull low any more.

This module keeps the outside drivers. It also keeps the chip's side (output stages, pull resistors, alternate
functions) for firmware in Python; a chip keeps its own pins (:class:`ChipPins`), which are queried instead.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Protocol, TypeAlias

from fcu_emulator.emulator.time.clock import Clock
from fcu_emulator.emulator.trace import GpioEdge, Trace

LevelCallback: TypeAlias = Callable[[int], None]
"""``changed(level)``: the new input level of the chip on this pin, 0 or 1."""

_PORTS = "ABCDEH"  # RM0368 section 2.3: the STM32F401 has no port F and G


class ChipPins(Protocol):
    """The chip's side of the pins, kept by a chip. It reports edges by :meth:`Gpio.show_edge`."""

    def side(self, port: str, pin: int) -> tuple[int | None, int | None, int | None]:
        """Return the level of the output stage, of the pull resistor, and the alternate function; None for none."""
        ...

    def drive(self, port: str, pin: int, level: int | None) -> None:
        """Set the level of all outside drivers together; None: released."""
        ...

    def watch(self, port: str, pin: int) -> None:
        """Call :meth:`Gpio.tell` after every change of this pin's input level."""
        ...

    def frequent(self, port: str, pin: int) -> None:
        """Report edges of this pin only while the trace is detailed."""
        ...


class _Pin:
    """One pin. Plain attributes: chip selects change tens of thousands of times per second."""

    __slots__ = ("alternate", "frequent", "listeners", "name", "output", "outside", "pull", "reads", "shown")

    def __init__(self, name: str) -> None:
        self.name = name
        self.output: int | None = None  # the chip's output stage; None is high impedance
        self.pull: int | None = None
        self.outside: dict[str, int] = {}
        self.alternate: int | None = None
        self.reads = 0
        self.shown: int | None = None  # the level in the trace; None before the pin's first use as an output
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
        """Call the listeners if the resulting level has changed."""
        reads = self.level() or 0
        if reads != self.reads:
            self.reads = reads
            for changed in self.listeners:
                changed(reads)


class Gpio:
    """The pins of all ports, named by port letter and number, ``("B", 5)``."""

    def __init__(self, clock: Clock, trace: Trace) -> None:
        self._clock = clock
        self._trace = trace
        self._pins = {(port, pin): _Pin(f"P{port}{pin}") for port in _PORTS for pin in range(16)}
        self._chip: ChipPins | None = None

    # -- with a chip ------------------------------------------------------------------------------------

    def attach(self, chip: ChipPins) -> None:
        """Use the pins of ``chip`` from now on; it keeps its side of them itself."""
        self._chip = chip
        for (port, pin), one in self._pins.items():
            if one.frequent:
                chip.frequent(port, pin)
            if one.outside:
                chip.drive(port, pin, min(one.outside.values()))
            if one.listeners:
                chip.watch(port, pin)

    def show_edge(self, port: str, pin: int, level: int) -> None:
        """Record an edge of the chip's output."""
        self._trace_edge(self._pins[port, pin], level)

    def tell(self, port: str, pin: int, level: int) -> None:
        """Report a new input level of a watched pin."""
        for changed in self._pins[port, pin].listeners:
            changed(level)

    def _pin(self, port: str, pin: int) -> _Pin:
        one = self._pins[port, pin]
        if self._chip is not None:
            one.output, one.pull, one.alternate = self._chip.side(port, pin)
        return one

    # -- the chip's side, for firmware in Python --------------------------------------------------------

    def init_output(self, port: str, pin: int) -> None:
        """Make a pin a push-pull output; its latch resets to 0."""
        self.write(port, pin, self._pins[port, pin].output or 0)

    def write(self, port: str, pin: int, level: int, *, open_drain: bool = False) -> None:
        """Drive a pin; a change is an edge in the trace. An open drain at 1 releases the pin."""
        one = self._pins[port, pin]
        one.output = None if open_drain and level else level
        self._show(one, level)
        one.settle()

    def release(self, port: str, pin: int) -> None:
        """Make a pin high impedance: an input, or the output of a peripheral that is not modelled on pins."""
        one = self._pins[port, pin]
        one.output = None
        if one.shown == 0:
            self._show(one, 1)
        one.settle()

    def set_pull(self, port: str, pin: int, pull: int | None) -> None:
        """Connect the pull-up (1), the pull-down (0) or no resistor (None)."""
        one = self._pins[port, pin]
        one.pull = pull
        one.settle()

    def set_alternate(self, port: str, pin: int, function: int | None) -> None:
        """Set the alternate function (AF number) of a pin; None for another mode."""
        self._pins[port, pin].alternate = function

    # -- common to both sides ---------------------------------------------------------------------------

    def level(self, port: str, pin: int) -> int | None:
        """Return the resulting level; None while the pin floats."""
        return self._pin(port, pin).level()

    def pins(self) -> Iterable[tuple[str, int]]:
        return self._pins.keys()

    def output(self, port: str, pin: int) -> int | None:
        """Return the level of the chip's output stage; None while it drives nothing."""
        return self._pin(port, pin).output

    def driven(self, port: str, pin: int) -> int | None:
        """Return the level without the weak pull resistors, which can light a LED; None without a driver."""
        return self._pin(port, pin).driven()

    def reads(self, port: str, pin: int) -> int:
        """Return the input level of the chip: the pin's level, 0 for a floating pin."""
        return self.level(port, pin) or 0

    def alternate(self, port: str, pin: int) -> int | None:
        """Return the alternate function (AF number) of a pin, or None."""
        return self._pin(port, pin).alternate

    def drive(self, port: str, pin: int, level: int | None, by: str = "outside") -> None:
        """Drive a pin from outside the chip, or release it (None). ``by`` identifies the driver."""
        one = self._pins[port, pin]
        if level is None:
            one.outside.pop(by, None)
        else:
            one.outside[by] = level
        if self._chip is None:
            one.settle()
        else:
            self._chip.drive(port, pin, min(one.outside.values(), default=None))

    def listen(self, port: str, pin: int, changed: LevelCallback) -> None:
        """Call ``changed(level)`` after every change of the input level, in the order of registration."""
        self._pins[port, pin].listeners.append(changed)
        if self._chip is not None:
            self._chip.watch(port, pin)

    def frequent(self, port: str, pin: int) -> None:
        """Show this pin's edges in a detailed trace only: a chip select would crowd out all other events."""
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
    """A LED on an output pin, lit while the pin is low."""

    def __init__(self, name: str, gpio: Gpio, port: str, pin: int) -> None:
        self.name = name
        self.pin = f"P{port}{pin}"
        self._gpio = gpio
        self._where = port, pin

    @property
    def on(self) -> bool:
        """Whether the LED is lit; it is dark on an unconfigured pin and with a weak pull-down."""
        return self._gpio.driven(*self._where) == 0
