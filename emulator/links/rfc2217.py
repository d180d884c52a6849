"""The serial port as a TCP port with Telnet and RFC 2217, by pyserial.

Decision: a client may set a rate other than the firmware's, as with a real adapter. The mismatch is
reported.

Decision: the RFC 2217 port sends no text to a new client while this client negotiates, because clients discard
their input during the negotiation.
"""

from __future__ import annotations

import struct
import time
from collections.abc import Callable

import serial
from serial.rfc2217 import PortManager

from fcu_emulator.emulator.host.loopback import HOST
from fcu_emulator.emulator.links import programs
from fcu_emulator.emulator.links.limited_lines import LimitedLines
from fcu_emulator.emulator.links.tcp import Coding, TcpLink

FIRST_PORT = 2217
HOLD_S = 0.4
SETTLE_S = 0.05
_MOST_MISMATCHES = 16
"""Maximum number of reported mismatches."""
LONGEST_OPTION = 64
"""Maximum bytes of a Telnet subnegotiation. RFC 2217 needs up to 6 bytes; a signature may be longer."""
TOLERANCE = 0.0333
"""Largest allowed difference of the rates: the receiver's tolerance for 8 bits (RM0368 section 19.3.5)."""


class _Line:
    """Settings of the port that ``PortManager`` manages. The port's input lines are always active."""

    cts = dsr = cd = True
    ri = False

    def __init__(self, on_purge: Callable[[], None]) -> None:
        self.baudrate = 115_200
        self.bytesize = 8
        self.parity = serial.PARITY_NONE
        self.stopbits = 1
        self.xonxoff = self.rtscts = False
        self.dtr = self.rts = True
        self.break_condition = False
        self._on_purge = on_purge

    def reset_input_buffer(self) -> None:
        self._on_purge()

    def reset_output_buffer(self) -> None:
        """Do nothing, because bytes are already on the wire."""


class Negotiated(Coding):
    """A client's Telnet protocol. ``say`` gets a message if the client's rate differs from ``firmware_baud()``."""

    def __init__(self, firmware_baud: Callable[[], float], say: Callable[[str], None]) -> None:
        self._firmware_baud = firmware_baud
        self._say = say
        self._answers = bytearray()
        self._line = _Line(self._purged)
        self._hold_until_s = time.monotonic() + HOLD_S
        self._ready = self._takes_back = False
        self._manager = PortManager(self._line, self)

    def write(self, data: bytes) -> None:
        """Send an answer of ``PortManager`` to the client."""
        self._answers += data

    def encode(self, data: bytes) -> bytes:
        self._compare_rates()
        return data.replace(b"\xff", b"\xff\xff")

    def decode(self, data: bytes) -> tuple[bytes, bytes]:
        try:
            typed = b"".join(self._manager.filter(data))
        except (TypeError, KeyError, struct.error) as error:  # raised for an incomplete option
            raise ValueError("not RFC 2217") from error
        if len(self._manager.suboption or b"") > LONGEST_OPTION:
            raise ValueError("an option without an end")
        if typed:
            self._compare_rates()
        answers = bytes(self._answers)
        self._answers.clear()
        return typed, answers

    def ready(self) -> bool:
        self._ready = self._ready or time.monotonic() >= self._hold_until_s
        return self._ready

    def takes_back(self) -> bool:
        asked, self._takes_back = self._takes_back, False
        return asked

    def _purged(self) -> None:
        if self._ready:
            self._takes_back = True
        else:
            self._hold_until_s = time.monotonic() + SETTLE_S

    def _compare_rates(self) -> None:
        asked, sends = self._line.baudrate, self._firmware_baud()
        if abs(asked / sends - 1) <= TOLERANCE:
            return
        told = f"the terminal is set to {asked} baud and the firmware to {sends:.0f}; a real line would show garbage"
        self._say(told)


class Rfc2217Link(TcpLink):
    """A link on ``port`` of 127.0.0.1 (None: the default port, 0: any free port). Raises LinkError.

    ``say(line)`` is called if the rates of client and firmware differ.
    """

    kind = "rfc2217"
    first_port = FIRST_PORT

    def __init__(
        self, port: int | None, firmware_baud: Callable[[], float], say: Callable[[str], None]
    ) -> None:
        super().__init__(port)
        self._firmware_baud = firmware_baud
        self._say = LimitedLines(say)
        self._mismatches: dict[str, None] = {}

    def coding(self) -> Coding:
        return Negotiated(self._firmware_baud, self._mismatch)

    def announce(self) -> list[str]:
        return [
            f"serial: TCP port {self.port} of {HOST}, Telnet with RFC 2217; open it with one of",
            *(f"  {command}" for command in programs.for_rfc2217(self.port)),
        ]

    def report(self) -> list[str]:
        return [*super().report(), *(f"serial: {self.address}: {one}" for one in self._mismatches)]

    def _mismatch(self, text: str) -> None:
        if text not in self._mismatches and len(self._mismatches) < _MOST_MISMATCHES:
            self._mismatches[text] = None
            self._say(f"serial: {self.address}: {text}")
