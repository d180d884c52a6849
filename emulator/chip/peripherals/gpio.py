"""Connection of the chip's pins in C to the board's pins."""

from __future__ import annotations

import ctypes
from typing import Final, TypeAlias

import numpy as np

from fcu_emulator.emulator.buses.gpio import Gpio
from fcu_emulator.emulator.chip.library import PIN_CHANGED, FcuChip, PinTable
from fcu_emulator.emulator.trace import GpioEdge

PORTS: Final = "ABCDEH"
"""The ports in the order of ``port_index`` in chip.c."""
_NAMES: Final = tuple(tuple(f"P{port}{pin}" for pin in range(16)) for port in PORTS)
_EDGE: Final = np.dtype(
    {
        "names": ("at_ps", "port", "pin", "level"),
        "formats": ("i8", "u1", "u1", "u1"),
        "offsets": (0, 8, 9, 10),
        "itemsize": 16,
    }
)
"""struct Edge of gpio.h."""
PinFunction: TypeAlias = tuple[str, int, int]
"""Port letter, pin number, alternate function: ``("B", 10, 4)`` is PB10 as AF4."""


class ConnectedPins:
    """The chip's side of the pins in ``gpio``."""

    def __init__(self, chip: FcuChip, gpio: Gpio) -> None:
        self._chip = chip
        self._library, self._handle = chip.library, chip.handle
        calls = PinTable(
            chip.callback(PIN_CHANGED, lambda port, pin, level: gpio.show_edge(PORTS[port], pin, level)),
            chip.callback(PIN_CHANGED, lambda port, pin, level: gpio.tell(PORTS[port], pin, level)),
        )
        self._library.fcu_connect_pins(self._handle, calls)
        gpio.attach(self)
        chip.trace.draw_from(self._add_edges)

    def _add_edges(self) -> None:
        if self._chip.closed:
            return
        waiting = self._library.fcu_pending_edges(self._handle)
        if not waiting:
            return
        trace, lost = self._chip.trace, ctypes.c_int64()
        edges = np.empty(min(waiting, trace.kept_at_most), _EDGE)
        place = ctypes.c_void_p(edges.ctypes.data)
        count = self._library.fcu_take_edges(self._handle, place, len(edges), ctypes.byref(lost))
        kept = [
            GpioEdge(at_ps, _NAMES[port][pin], level) for at_ps, port, pin, level in edges[:count].tolist()
        ]
        trace.add_kept(kept, lost.value)

    def side(self, port: str, pin: int) -> tuple[int | None, int | None, int | None]:
        where = self._handle, PORTS.index(port), pin
        library = self._library
        return (
            _none(library.fcu_pin_output(*where)),
            _none(library.fcu_pin_pull(*where)),
            _none(library.fcu_pin_alternate(*where)),
        )

    def drive(self, port: str, pin: int, level: int | None) -> None:
        number = -1 if level is None else level
        self._library.fcu_drive_pin(self._handle, PORTS.index(port), pin, number)
        self._chip.raise_error()

    def watch(self, port: str, pin: int) -> None:
        self._library.fcu_watch_pin(self._handle, PORTS.index(port), pin)

    def frequent(self, port: str, pin: int) -> None:
        self._library.fcu_frequent_pin(self._handle, PORTS.index(port), pin)


def _none(number: int) -> int | None:
    return None if number < 0 else number
