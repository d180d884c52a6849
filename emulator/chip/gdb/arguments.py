"""The parts of a packet: hexadecimal numbers and bytes, points, threads; checked and bounded."""

from __future__ import annotations

import re
from typing import Final

from emulator.chip.gdb.target import Point, PointKind

MOST_BYTES: Final = 0x1000
"""Of memory in one packet; GDB asks again for the rest."""

_NUMBER = re.compile(rb"[0-9a-fA-F]{1,8}")
_LARGEST = 0xFFFF_FFFF
_LONGEST_WATCH = 0x100


class MalformedError(Exception):
    """The packet is not what the protocol says; the debugger is told E01."""


def number(text: bytes) -> int:
    """A hexadecimal number of 32 bits."""
    if not _NUMBER.fullmatch(text):
        raise MalformedError
    return int(text, 16)


def pair(text: bytes, separator: bytes = b",") -> tuple[int, int]:
    """``address,length``: a range of the address space."""
    first, found, second = text.partition(separator)
    if not found:
        raise MalformedError
    address, length = number(first), number(second)
    if address + length > _LARGEST + 1:
        raise MalformedError
    return address, length


def from_hex(text: bytes) -> bytes:
    """Bytes, two digits each."""
    try:
        return bytes.fromhex(text.decode("ascii"))
    except ValueError:
        raise MalformedError from None


def data_at(text: bytes, binary: bool = False) -> tuple[int, bytes]:
    """``address,length:data`` with as much data as it says."""
    place, found, content = text.partition(b":")
    address, length = pair(place)
    data = content if binary else from_hex(content)
    if not found or len(data) != length:
        raise MalformedError
    return address, data


def word(text: bytes, size: int) -> int:
    """A register's value in the target's byte order."""
    data = from_hex(text)
    if len(data) != size:
        raise MalformedError
    return int.from_bytes(data, "little")


def point(text: bytes) -> Point | None:
    """``type,address,kind``; None for a type that is not known. Conditions and commands are refused."""
    kind, _, place = text.partition(b",")
    if kind not in (b"0", b"1", b"2", b"3", b"4"):
        return None
    address, size = pair(place)
    chosen = PointKind(int(kind))
    if chosen.is_break:
        return Point(chosen, address & ~1, 2)
    if not 0 < size <= _LONGEST_WATCH:
        raise MalformedError
    return Point(chosen, address, size)


def continues(text: bytes) -> bytes:
    """What ``vCont`` asks of the only thread: b"c" or b"s". Signals are not delivered to a chip."""
    for action in text.split(b";"):
        verb, _, thread = action.partition(b":")
        if thread in (b"", b"1", b"0", b"-1", b"01") and verb[:1] in (b"c", b"C", b"s", b"S"):
            return verb[:1].lower()
    raise MalformedError
