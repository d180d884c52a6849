"""Bus transfers and their samples in readable form."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from functools import cache
from typing import Any, NamedTuple

from fcu_emulator.emulator.assembly.board import Board
from fcu_emulator.emulator.clock import PS_PER_S
from fcu_emulator.emulator.trace import BusTransfer
from fcu_emulator.sensors.declaration import Quantity
from fcu_emulator.sensors.part import Sensor
from fcu_emulator.sensors.register import ADDRESSES, RegisterMap

_REMEMBERED = 16  # number of transfers of Python firmware that are kept, enough for a few ticks
_SHOWN_UNITS = {
    "g": ("mg", 1000.0),
    "dps": ("mdps", 1000.0),
    "mgauss": ("mG", 1.0),
    "degC": ("°C", 1.0),
    "percent": ("%", 1.0),
}
"""Units that the lab prints, with factors from the sensors' units."""


class Sample(NamedTuple):
    """A measured quantity of a sensor. Its values for all axes are in ``unit``."""

    id: str
    values: list[float]
    unit: str


def outputs(board: Board) -> list[dict[str, Any]]:
    """Return the sensors' measured quantities, for the page's labels."""
    return [
        {
            "id": _id(part, quantity),
            "part": part.NAME,
            "quantity": quantity.name,
            "doc": quantity.doc,
            "unit": _shown(quantity)[0],
            "axes": quantity.axes,
        }
        for part in board.sensors
        for quantity in part.SIGNALS
    ]


def _id(part: Sensor, quantity: Quantity) -> str:
    return f"{part.NAME}.{quantity.name}"


def _shown(quantity: Quantity) -> tuple[str, float]:
    return _SHOWN_UNITS.get(quantity.unit, (quantity.unit, 1.0))


# -- The latest transfers -----------------------------------------------------------------------------------


class Transfers:
    """The latest transfers. Transfers of Python firmware are kept until :meth:`close`."""

    def __init__(self, board: Board) -> None:
        self._board = board
        if board.chip is None:
            self._remember(_REMEMBERED)

    def latest(self) -> list[BusTransfer]:
        return self._board.recent_transfers()

    def close(self) -> None:
        self._remember(0)

    def _remember(self, count: int) -> None:
        for bus in self._board.signals.i2c.values():
            bus.remember(count)


def transfers(board: Board, latest: Sequence[BusTransfer]) -> list[dict[str, Any]]:
    """Return the latest transfers of all buses in readable form."""
    return [_transfer(board, one) for one in latest]


def _transfer(board: Board, transfer: BusTransfer) -> dict[str, Any]:
    meanings = (
        " ".join(f"{value:g}" for value in sample.values) + f" {sample.unit}"
        for sample in decoded(board, transfer)
    )
    data = transfer.read or transfer.written[1:]
    return {
        "t_s": transfer.t_ps / PS_PER_S,
        "bus": transfer.bus,
        "device": transfer.device or f"0x{transfer.address:02X}",
        "register": transfer.register,
        "way": "read" if transfer.read else "write",
        "bytes": data[:32].hex(" "),
        "count": len(data),
        "meaning": ", ".join(meanings),
        "result": transfer.result,
    }


# -- The samples in the transfers ---------------------------------------------------------------------------


def samples(board: Board, latest: Sequence[BusTransfer]) -> dict[str, list[float]]:
    """Return the values of the latest reads, in sensor axes, keyed by the ids of :func:`outputs`."""
    found: dict[str, list[float]] = {}
    seen = set()
    for transfer in reversed(latest):
        kind = transfer.device, transfer.register, len(transfer.read)
        if kind not in seen:  # the latest of several transfers with the same id
            seen.add(kind)
            for sample in decoded(board, transfer):
                found.setdefault(sample.id, sample.values)
    return found


def decoded(board: Board, transfer: BusTransfer) -> Iterator[Sample]:
    """Yield the samples in a read of output registers."""
    part = next((part for part in board.sensors if transfer.device == part.NAME), None)
    first = _addresses(part.MAP).get(transfer.register) if part is not None else None
    if part is None or first is None or not transfer.read:
        return
    read: dict[int, int] = {}
    for address, value in zip(_passed(board, part, transfer, first), transfer.read, strict=False):
        read.setdefault(address, value)
    for quantity in part.SIGNALS:
        output = quantity.output
        places = range(output.address, output.address + output.size * quantity.axes)
        if all(place in read for place in places):
            raw = bytes(read[place] for place in places)
            lsb = part.sample_range(quantity.name)[2]
            unit, scale = _shown(quantity)
            values = [round((output.zero + count * lsb) * scale, 3) for count in _counts(raw, output.size)]
            yield Sample(_id(part, quantity), values, unit)


def _passed(board: Board, part: Sensor, transfer: BusTransfer, first: int) -> Iterable[int]:
    bit = part.BUS.i2c_increment_bit if transfer.bus in board.description.i2c else part.BUS.spi_increment_bit
    stays = bit and not (transfer.written and transfer.written[0] & bit)
    while True:
        yield first
        first = first if stays else part.active.advance(first, 1)


def _counts(raw: bytes, size: int) -> Iterator[int]:
    for start in range(0, len(raw), size):
        yield int.from_bytes(raw[start : start + size], "little", signed=True)


@cache
def _addresses(registers: RegisterMap) -> dict[str, int]:
    return {registers.name(address): address for address in range(ADDRESSES)}
