"""Packets on the wire: ``$payload#checksum``, acknowledgements, escapes, Ctrl-C ("Overview", "Packet
Acknowledgment", "Interrupts").

The sender is not trusted: a packet that is longer than announced is thrown away while it arrives, and every
sequence of bytes is some sequence of arrivals. Replies are never compressed by run lengths, which is
optional.
"""

from __future__ import annotations

import re
from enum import Enum, auto
from typing import Final, TypeAlias

LONGEST: Final = 0x4000
"""Bytes of a payload as it is sent, announced as PacketSize."""

ACK, NACK = b"+", b"-"

_BEGIN, _END, _ESCAPE = b"$#}"
_INTERRUPT = 0x03
_FLIPPED = 0x20
_TO_ESCAPE = re.compile(rb"[#$}*]")
_ESCAPED = re.compile(rb"\}(.?)", re.DOTALL)


class Arrival(Enum):
    """What can arrive besides packets."""

    INTERRUPT = auto()  # Ctrl-C at the debugger
    RESEND = auto()  # the debugger did not understand the last packet
    CORRUPT = auto()  # a packet with a wrong checksum
    OVERLONG = auto()  # a packet longer than announced, thrown away


Received: TypeAlias = bytes | Arrival
"""A packet's payload with escapes undone, or one of the others."""


def frame(payload: bytes) -> bytes:
    """A payload as it is sent."""
    escaped = _TO_ESCAPE.sub(lambda found: bytes((_ESCAPE, found[0][0] ^ _FLIPPED)), payload)
    return b"$%s#%02x" % (escaped, sum(escaped) & 0xFF)


def unescape(data: bytes) -> bytes:
    """A payload as it was meant; an escape at the very end stands for nothing."""
    return _ESCAPED.sub(lambda found: bytes(byte ^ _FLIPPED for byte in found[1]), data)


class Framer:
    """Takes bytes as they come and gives what they amount to."""

    def __init__(self) -> None:
        self._packet: bytearray | None = None
        self._overlong = False
        self._checksum = b""
        self._in_checksum = False

    def feed(self, data: bytes) -> list[Received]:
        """What is complete with ``data``, in order."""
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
        if byte == _BEGIN:  # the sender has given up the packet before
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
