"""Which pins a block's signals come out at: a block whose pins were not switched over is heard by nobody.

A GPIO pin belongs to a block when its mode is "alternate function" and its AFR field has the block's number
(RM0368 section 8.3.2). On the board a forgotten pin is the usual reason for a silent bus or terminal.
"""

from __future__ import annotations

from typing import TypeAlias

from emulator.gpio import Gpio

PinFunction: TypeAlias = tuple[str, int, int]
"""Port letter, pin number, alternate function: ``("B", 10, 4)`` is PB10 as AF4."""


def unconnected(gpio: Gpio, pins: tuple[PinFunction, ...]) -> str:
    """The pins not switched to their function, as text ("PB10 to AF4, PB3 to AF9"); "" if all are."""
    missing = ""
    for port, pin, function in pins:  # a plain loop, because every address on a bus asks
        if gpio.alternate(port, pin) != function:
            missing += f", P{port}{pin} to AF{function}"
    return missing.removeprefix(", ")
