"""Bus transfers and serial frames as bits on wires.

Bits are evenly spaced, because pauses between bytes are not recorded.
"""

from __future__ import annotations

from collections.abc import Iterator
from fractions import Fraction
from typing import TypeAlias

from fcu_emulator.emulator.errors import I2CNackError
from fcu_emulator.emulator.trace import BusTransfer

Edge: TypeAlias = tuple[int, str, int]
"""Time in ps, the wire's name, and its level from this time."""

_READ = 1


def i2c(transfer: BusTransfer, scl: str, sda: str) -> Iterator[Edge] | None:
    """Return an I2C message from start to stop (UM10204 section 3.1), or None if incomplete."""
    parts = _i2c_parts(transfer)
    if parts is None or transfer.end_ps <= transfer.t_ps:
        return None
    return _i2c_edges(transfer, parts, scl, sda)


def _i2c_parts(transfer: BusTransfer) -> list[list[tuple[int, int]]] | None:
    address, written, result = transfer.address << 1, transfer.written, transfer.result
    if result == "ok":
        parts = []
        if written or not transfer.read:
            parts.append([(address, 0), *((byte, 0) for byte in written)])
        if transfer.read:
            read = [(byte, 0) for byte in transfer.read]
            parts.append([(address | _READ, 0), *read[:-1], (read[-1][0], 1)])
        return parts
    for index in range(len(written) + 1):
        if result == str(I2CNackError(transfer.address, index)):
            *heard, refused = (address if written else address | _READ, *written)[: index + 1]
            return [[*((byte, 0) for byte in heard), (refused, 1)]]
    return None


def _i2c_edges(
    transfer: BusTransfer, parts: list[list[tuple[int, int]]], scl: str, sda: str
) -> Iterator[Edge]:
    periods = 1 + sum(1 + 9 * len(part) for part in parts)
    period = Fraction(transfer.end_ps - transfer.t_ps, periods)
    slot = 0

    def at(part: float) -> int:
        return transfer.t_ps + int((slot + Fraction(part)) * period)

    for number, part in enumerate(parts):
        if number:  # a repeated start: both lines high first
            yield at(0.125), sda, 1
            yield at(0.25), scl, 1
        yield at(0.5), sda, 0
        yield at(1), scl, 0
        slot += 1
        for byte, acknowledge in part:
            for bit in (*((byte >> shift) & 1 for shift in range(7, -1, -1)), acknowledge):
                yield at(0.25), sda, bit
                yield at(0.5), scl, 1
                yield at(1), scl, 0
                slot += 1
    yield at(0.25), sda, 0
    yield at(0.5), scl, 1
    yield at(0.75), sda, 1


def spi(transfer: BusTransfer, mode: int, sck: str, data: str, select: str) -> Iterator[Edge]:
    """Yield an SPI message, most significant bit first. ``mode``: CPOL and CPHA."""
    idle, late = mode >> 1, mode & 1
    message = transfer.written + transfer.read
    yield transfer.t_ps, sck, idle
    yield transfer.t_ps, select, 0
    if message:
        half = Fraction(transfer.end_ps - transfer.t_ps, 16 * len(message) + 1)
        bits = ((byte >> shift) & 1 for byte in message for shift in range(7, -1, -1))
        for number, bit in enumerate(bits):
            begin = 2 * number + (1 if late else Fraction(1, 2))
            yield transfer.t_ps + int(begin * half), data, bit
            leading = transfer.t_ps + int((2 * number + 1) * half)
            yield leading, sck, 1 - idle
            yield transfer.t_ps + int((2 * number + 2) * half), sck, idle
    yield transfer.end_ps, select, 1


def frames(start_ps: int, data: bytes, frame_ps: Fraction, bit_ps: Fraction, wire: str) -> Iterator[Edge]:
    """Yield serial bytes: start bit, eight bits with the lowest first, stop bit."""
    for number, byte in enumerate(data):
        begin = start_ps + number * frame_ps
        yield int(begin), wire, 0
        for bit in range(8):
            yield int(begin + (1 + bit) * bit_ps), wire, byte >> bit & 1
        yield int(begin + 9 * bit_ps), wire, 1
