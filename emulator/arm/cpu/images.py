"""Ports that are polled all the time are read straight from memory.

A GPIO port changes only by an event of the clock or by a write to a register, so its registers can lie in
memory that the engine reads by itself, as fast as RAM. That begins when a port has been read ``_MANY`` times
without being written to, and ends with the next write to it, which reaches the block at its exact instruction
as ever. The results are the same; a loop that polls only such ports is one without accesses
(:mod:`emulator.arm.cpu.idle_loops`).
"""

from __future__ import annotations

from collections.abc import Iterable

from emulator.arm.cpu.engine import Engine
from emulator.arm.peripherals.gpio import GpioPort
from emulator.arm.peripherals.peripheral import Peripheral

_MANY = 3_000


class Images:
    """``shown`` are the ports that are read from memory now."""

    def __init__(self, engine: Engine, blocks: Iterable[Peripheral]) -> None:
        self._engine = engine
        self.ports = [block for block in blocks if isinstance(block, GpioPort)]
        self.shown: list[GpioPort] = []

    def between_runs(self) -> None:
        """Begin and end; behind each run that has written to a register the images are made anew."""
        for port in self.ports:
            if port in self.shown:
                if port.looks == 0:
                    self._engine.hide_image(port.base)
                    self.shown.remove(port)
                else:
                    port.draw()
            elif port.looks > _MANY and port.clocked:
                port.draw()
                self._engine.show_image(port.base, port.image)
                self.shown.append(port)
