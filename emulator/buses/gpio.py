"""The pins: who drives them, what level results, who hears of it (reference manual RM0368 section 8).

A pin has three kinds of drivers: the chip's output stage, any number of parties outside (a sensor's
interrupt pin, a button, a receiver), and the chip's weak pull resistor. The lowest strong driver wins, as
on an open-drain wire; the pull decides when nobody drives; without one the pin floats. A floating input
reads as 0 here, on the board as noise.

Decision: two outputs that fight are not an error but resolve to 0. Telling a short circuit from an
open-drain wire would need every party's kind of output, and no exercise can short two outputs on this
board.

The trace shows what the chip does: an edge when its output stage changes, also to open drain high (1); a
pin that stops being an output shows 1, because it does not pull low any more.

Who drives from outside is kept here. The chip's side (output stages, pull resistors, alternate functions) is
kept here for firmware in Python; where there is a chip, its own pins (:class:`ChipPins`) are asked instead.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Protocol, TypeAlias

from fcu_emulator.emulator.time.clock import Clock
from fcu_emulator.emulator.trace import GpioEdge, Trace

LevelCallback: TypeAlias = Callable[[int], None]
"""``changed(level)``: what an input of the chip on this pin reads from now on, 0 or 1."""

_PORTS = "ABCDEH"  # RM0368 section 2.3: the STM32F401 has no port F and G


class ChipPins(Protocol):
    """The chip's side of the pins, kept by a chip. Edges come by :meth:`Gpio.show_edge`."""

    def side(self, port: str, pin: int) -> tuple[int | None, int | None, int | None]:
        """Level of the output stage, of the pull resistor, and alternate function; None for none."""
        ...

    def drive(self, port: str, pin: int, level: int | None) -> None:
        """All parties outside together drive the pin to a level, or let go of it."""
        ...

    def watch(self, port: str, pin: int) -> None:
        """Call :meth:`Gpio.tell` after every change of what this pin reads."""
        ...

    def frequent(self, port: str, pin: int) -> None:
        """Edges of this pin are of interest while the trace is detailed only."""
        ...


class _Pin:
    """One pin. Plain attributes: chip selects move tens of thousands of times a second."""

    __slots__ = ("alternate", "frequent", "listeners", "name", "output", "outside", "pull", "reads", "shown")

    def __init__(self, name: str) -> None:
        self.name = name
        self.output: int | None = None  # the chip's output stage; None is high impedance
        self.pull: int | None = None
        self.outside: dict[str, int] = {}
        self.alternate: int | None = None
        self.reads = 0
        self.shown: int | None = None  # the level in the trace; None before the pin was first an output
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
        """Tell the listeners when the resulting level has become another one."""
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
        """The pins are those of ``chip`` from now on, which keeps its side of them itself."""
        self._chip = chip
        for (port, pin), one in self._pins.items():
            if one.frequent:
                chip.frequent(port, pin)
            if one.outside:
                chip.drive(port, pin, min(one.outside.values()))
            if one.listeners:
                chip.watch(port, pin)

    def show_edge(self, port: str, pin: int, level: int) -> None:
        """The chip's output has changed."""
        self._trace_edge(self._pins[port, pin], level)

    def tell(self, port: str, pin: int, level: int) -> None:
        """What a watched pin reads has changed."""
        for changed in self._pins[port, pin].listeners:
            changed(level)

    def _pin(self, port: str, pin: int) -> _Pin:
        """A pin as it is now."""
        one = self._pins[port, pin]
        if self._chip is not None:
            one.output, one.pull, one.alternate = self._chip.side(port, pin)
        return one

    # -- the chip's side, for firmware in Python --------------------------------------------------------

    def init_output(self, port: str, pin: int) -> None:
        """Make a pin a push-pull output; its latch resets to 0."""
        self.write(port, pin, self._pins[port, pin].output or 0)

    def write(self, port: str, pin: int, level: int, *, open_drain: bool = False) -> None:
        """Drive a pin; a change is an edge in the trace. An open drain at 1 lets go of the pin."""
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
        """Which alternate function (AF number) a pin is switched to; None while it is no such pin."""
        self._pins[port, pin].alternate = function

    # -- everybody's side -------------------------------------------------------------------------------

    def level(self, port: str, pin: int) -> int | None:
        """The level that results; None while the pin floats."""
        return self._pin(port, pin).level()

    def pins(self) -> Iterable[tuple[str, int]]:
        """Port letter and number of every pin."""
        return self._pins.keys()

    def output(self, port: str, pin: int) -> int | None:
        """What the chip's output stage drives; None while it drives nothing."""
        return self._pin(port, pin).output

    def driven(self, port: str, pin: int) -> int | None:
        """The level without the weak pull resistors: what can light a LED; None when nobody drives."""
        return self._pin(port, pin).driven()

    def reads(self, port: str, pin: int) -> int:
        """What an input of the chip reads: the level, 0 for a floating pin."""
        return self.level(port, pin) or 0

    def alternate(self, port: str, pin: int) -> int | None:
        """The alternate function (AF number) a pin is switched to, or None."""
        return self._pin(port, pin).alternate

    def drive(self, port: str, pin: int, level: int | None, by: str = "outside") -> None:
        """Drive a pin from outside the chip, or let go of it (None). ``by`` tells parties apart."""
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
        """Call ``changed(level)`` after every change of what the pin reads, in the order of listening."""
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
        """Whether it is lit; an unconfigured pin leaves it dark, and so does a weak pull-down."""
        return self._gpio.driven(*self._where) == 0
