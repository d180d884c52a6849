"""Declarations and values of sensor and peripheral registers, read without side effects."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

from fcu_emulator.emulator.assembly.board import Board
from fcu_emulator.sensors.part import Sensor
from fcu_emulator.sensors.register import RegisterMap

if TYPE_CHECKING:
    from fcu_emulator.emulator.chip.peripherals.peripheral import Peripheral
    from fcu_emulator.emulator.chip.registers.declaration import DeclaredPeripheral


def peripheral_names(board: Board) -> list[str]:
    """Return the names of the chip's viewable peripherals."""
    if board.chip is None:
        return []
    from fcu_emulator.emulator.chip.registers import DECLARED

    return [name for name in DECLARED if _peripheral(board, name) is not None]


def known(board: Board, name: str) -> bool:
    """Return whether a sensor or peripheral has this name."""
    return _part(board, name) is not None or name in peripheral_names(board)


def declaration(board: Board, name: str) -> dict[str, Any]:
    """Return registers and fields of a known sensor or peripheral.

    Keys: ``name``, ``doc``, ``place``, and ``registers`` with ``name``, ``address``, ``size``,
    ``reset``, ``access``, ``doc``, ``modelled`` and ``fields``.
    """
    part = _part(board, name)
    if part is not None:
        return {
            "name": name,
            "doc": ", ".join(quantity.doc for quantity in part.SIGNALS),
            "place": _place(board, part),
            "registers": list(_of_part(part.MAP)),
        }
    from fcu_emulator.emulator.chip.registers import DECLARED

    peripheral = DECLARED[name]
    return {
        "name": name,
        "doc": peripheral.title,
        "place": peripheral.title,
        "registers": list(_of_peripheral(peripheral)),
    }


def values(board: Board, name: str) -> dict[str, str]:
    """Return a known sensor's or peripheral's register values in hexadecimal, by name."""
    part = _part(board, name)
    if part is not None:
        memory = part.registers.mem
        return {
            one.__name__: bytes(memory[one.addr : one.addr + one.size])[::-1].hex().upper()
            for one in part.MAP.registers
        }
    from fcu_emulator.emulator.chip.registers import DECLARED

    peripheral = _peripheral(board, name)
    if peripheral is None:
        return {}
    return {one.name: f"{peripheral.peek(one.offset):08X}" for one in DECLARED[name].registers}


def note(board: Board, name: str) -> str:
    """Return a remark on a peripheral's state, or ""."""
    peripheral = _peripheral(board, name) if _part(board, name) is None else None
    if peripheral is None or peripheral.clocked:
        return ""
    return f"{name} has no clock: its enable bit in RCC is not set"


def _part(board: Board, name: str) -> Sensor | None:
    return next((one for one in board.sensors if name == one.NAME), None)


def _peripheral(board: Board, name: str) -> Peripheral | None:
    if board.chip is None:
        return None
    from fcu_emulator.emulator.chip.registers import SYSTEM_CONTROL_SPACE

    place = "SCS" if name in SYSTEM_CONTROL_SPACE else name
    return next((one for one in board.chip.core.all_peripherals if one.name == place), None)


def _place(board: Board, part: Sensor) -> str:
    wiring = board.booted.wiring
    place = wiring.places.get(part.NAME)
    return f"{wiring.bus}, {f'0x{place:02X}' if isinstance(place, int) else place}"


def _of_part(registers: RegisterMap) -> Iterator[dict[str, Any]]:
    for one in registers.registers:
        yield {
            "name": one.__name__,
            "address": one.addr,
            "size": one.size,
            "reset": one.reset,
            "access": one.access,
            "doc": one.meaning(),
            "modelled": one.modelled,
            "fields": [
                {"name": bits.name, "msb": bits.msb, "lsb": bits.lsb, "doc": bits.doc}
                for bits in one.fields
                if not bits.overlay
            ],
        }


def _of_peripheral(peripheral: DeclaredPeripheral) -> Iterator[dict[str, Any]]:
    for one in peripheral.registers:
        kind = one.declared
        yield {
            "name": one.name,
            "address": one.offset,
            "size": kind.size,
            "reset": one.reset,
            "access": kind.access,
            "doc": kind.meaning(),
            "modelled": kind.modelled,
            "fields": [
                {"name": field.name, "msb": field.msb, "lsb": field.lsb, "doc": field.bits.doc}
                for field in one.fields()
                if not field.bits.overlay
            ],
        }
