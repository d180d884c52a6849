"""Packets and their parts ("Overview", "Packet Acknowledgment", "Interrupts").

The input may be any sequence of bytes.
"""

from __future__ import annotations

import re
from enum import Enum, auto
from typing import Final, TypeAlias

from fcu_emulator.emulator.chip.gdb.target import Point, PointKind

LONGEST: Final = 0x4000
"""The maximum size of a payload, announced as PacketSize."""

ACK, NACK = b"+", b"-"

_BEGIN, _END, _ESCAPE = b"$#}"
_INTERRUPT = 0x03
_FLIPPED = 0x20
_TO_ESCAPE = re.compile(rb"[#$}*]")
_ESCAPED = re.compile(rb"\}(.?)", re.DOTALL)


class Arrival(Enum):
    """Events in the received bytes other than valid packets."""

    INTERRUPT = auto()  # Ctrl-C at the debugger
    RESEND = auto()  # the debugger requests the latest packet again
    CORRUPT = auto()  # a packet with a wrong checksum
    OVERLONG = auto()  # a packet longer than PacketSize, which is dropped


Received: TypeAlias = bytes | Arrival
"""A packet's payload without escapes, or another event."""


def frame(payload: bytes) -> bytes:
    """Return a payload framed as a packet."""
    escaped = _TO_ESCAPE.sub(lambda found: bytes((_ESCAPE, found[0][0] ^ _FLIPPED)), payload)
    return b"$%s#%02x" % (escaped, sum(escaped) & 0xFF)


def unescape(data: bytes) -> bytes:
    """Return a payload without escapes."""
    return _ESCAPED.sub(lambda found: bytes(byte ^ _FLIPPED for byte in found[1]), data)


class Framer:
    """Splits the received bytes into packets and other events."""

    def __init__(self) -> None:
        self._packet: bytearray | None = None
        self._overlong = False
        self._checksum = b""
        self._in_checksum = False

    def feed(self, data: bytes) -> list[Received]:
        found: list[Received] = []
        for byte in data:
            arrived = self._outside(byte) if self._packet is None else self._inside(byte, self._packet)
            if arrived is not None:
                found.append(arrived)
        return found

    def _outside(self, byte: int) -> Received | None:
        if byte == _BEGIN:
            self._begin()
        elif byte == _INTERRUPT:
            return Arrival.INTERRUPT
        elif byte == NACK[0]:
            return Arrival.RESEND
        return None

    def _inside(self, byte: int, packet: bytearray) -> Received | None:
        if self._in_checksum:
            self._checksum += bytes((byte,))
            return self._complete(packet) if len(self._checksum) == 2 else None
        if byte == _BEGIN:  # the sender has aborted the previous packet
            self._begin()
        elif byte == _END:
            self._in_checksum = True
        elif len(packet) < LONGEST:
            packet.append(byte)
        else:
            self._overlong = True
        return None

    def _begin(self) -> None:
        self._packet = bytearray()
        self._overlong = self._in_checksum = False
        self._checksum = b""

    def _complete(self, packet: bytearray) -> Received:
        self._packet = None
        if self._overlong:
            return Arrival.OVERLONG
        if self._checksum.lower() != b"%02x" % (sum(packet) & 0xFF):
            return Arrival.CORRUPT
        return unescape(bytes(packet))


# -- parts of a payload -------------------------------------------------------------------------------------

MOST_BYTES: Final = 0x1000
"""Maximum size of the memory in one packet; GDB requests the rest in further packets."""

_NUMBER = re.compile(rb"[0-9a-fA-F]{1,8}")
_LARGEST_NUMBER = 0xFFFF_FFFF
_WIDEST_WATCHPOINT = 0x100


class MalformedError(Exception):
    """A violation of the protocol. The answer to it is E01."""


def number(text: bytes) -> int:
    """Parse a hexadecimal number of 32 bits."""
    if not _NUMBER.fullmatch(text):
        raise MalformedError
    return int(text, 16)


def pair(text: bytes, separator: bytes = b",") -> tuple[int, int]:
    """Parse ``address,length`` as two numbers."""
    first, found, second = text.partition(separator)
    if not found:
        raise MalformedError
    address, length = number(first), number(second)
    if address + length > _LARGEST_NUMBER + 1:
        raise MalformedError
    return address, length


def from_hex(text: bytes) -> bytes:
    """Parse bytes of two hexadecimal digits each."""
    try:
        return bytes.fromhex(text.decode("ascii"))
    except ValueError:
        raise MalformedError from None


def data_at(text: bytes, binary: bool = False) -> tuple[int, bytes]:
    """Parse ``address,length:data``; the length must be correct."""
    place, found, content = text.partition(b":")
    address, length = pair(place)
    data = content if binary else from_hex(content)
    if not found or len(data) != length:
        raise MalformedError
    return address, data


def word(text: bytes, size: int) -> int:
    """Parse a register's little-endian value."""
    data = from_hex(text)
    if len(data) != size:
        raise MalformedError
    return int.from_bytes(data, "little")


def point(text: bytes) -> Point | None:
    """Parse ``type,address,kind``; return None for an unknown type. Raises MalformedError for conditions."""
    kind, _, place = text.partition(b",")
    if kind not in (b"0", b"1", b"2", b"3", b"4"):
        return None
    address, size = pair(place)
    chosen = PointKind(int(kind))
    if chosen.is_break:
        return Point(chosen, address & ~1, 2)
    if not 0 < size <= _WIDEST_WATCHPOINT:
        raise MalformedError
    return Point(chosen, address, size)


def continues(text: bytes) -> bytes:
    """Return the action of ``vCont``: b"c" or b"s"."""
    for action in text.split(b";"):
        verb, _, thread = action.partition(b":")
        if thread in (b"", b"1", b"0", b"-1", b"01") and verb[:1] in (b"c", b"C", b"s", b"S"):
            return verb[:1].lower()
    raise MalformedError


# -- short answers ("Packets") ------------------------------------------------------------------------------

OK: Final = b"OK"
MALFORMED, REFUSED = b"E01", b"E02"
