"""Polled levels of the board's pins. ``fcu run --vcd`` records all edges."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from fcu_emulator.emulator.assembly.board import Board
from fcu_emulator.emulator.boards.description import Pin
from fcu_emulator.emulator.buses.gpio import parse_pin


def pins(board: Board) -> list[dict[str, Any]]:
    """Return ``name``, ``use``, ``mode``, ``level`` (0, 1, or null if floating) and ``pull`` of each pin.

    ``mode``: ``output``, ``input``, ``AF4`` (an alternate function), or ``sensor``. ``pull``: for an
    unconnected input, which a button can drive, the level of its pull resistor; otherwise null.
    """
    return [*_of_chip(board), *_of_sensors(board)]


def _of_chip(board: Board) -> Iterator[dict[str, Any]]:
    gpio, uses = board.gpio, dict(_uses(board))
    for where in gpio.pins():
        driven = gpio.output(*where) is not None
        function = gpio.alternate(*where)
        mode = f"AF{function}" if function is not None else "output" if driven else "input"
        pull = gpio.pull(*where) if mode == "input" and where not in uses else None
        if where not in uses and not driven and pull is None:
            continue
        yield {
            "name": _name(where),
            "use": uses.get(where, "not connected"),
            "mode": mode,
            "level": gpio.level(*where),
            "pull": pull,
        }


def _of_sensors(board: Board) -> Iterator[dict[str, Any]]:
    for part in board.sensors:
        part.catch_up(board.clock.now_ps)
        for pin in part.pins():
            yield {
                "name": f"{part.NAME} {pin.name}",
                "use": "",
                "mode": "sensor",
                "level": pin.level,
                "pull": None,
            }


def _uses(board: Board) -> Iterator[tuple[Pin, str]]:
    description, wiring = board.description, board.booted.wiring
    for led, where in description.leds.items():
        yield where, f"{led}, lit while low"
    for part, place in wiring.chip_selects.items():
        yield parse_pin(place), f"{part} chip select"
    for bus, wires in description.i2c.items():
        for wire, name in ((wires.scl, "SCL"), (wires.sda, "SDA")):
            yield wire[:2], f"{bus} {name}, AF{wire[2]}"
    serial = description.serial
    yield serial.tx[:2], f"{serial.peripheral} TX, AF{serial.tx[2]}"
    for absent in description.absent:
        yield absent.chip_select, f"{absent.name} chip select; it is absent"
        for where in absent.held:
            yield where, f"held by {absent.name}"


def _name(where: Pin) -> str:
    return f"P{where[0]}{where[1]}"
