"""The board's serial port as a TCP port that speaks Telnet with RFC 2217: a serial port at a distance.

A client sets rate and format of the line as it would a real port's. pyserial's own ``PortManager`` speaks the
protocol; here are the port that it manages, and what keeps a client from harming the board.

Decision: a rate other than the firmware's is accepted, as a real adapter accepts it, and said. A real
terminal would show garbage then; here the text stays readable (as in :mod:`fcu_emulator.emulator.buses.uart`, and for the
same reason), and whoever wonders is told both rates. The road not taken, refusing it, fails in pyserial as
"remote rejected value for option 'baudrate'", without either.

Decision about a client's first moments: it opens the port, negotiates, and then throws away what has come.
Text is therefore held until it has done so and nothing more of that kind came for ``SETTLE_S``, or, for a
client that negotiates nothing, for ``HOLD_S``.
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
"""Different rates that are told: a client may set any of four thousand million."""
LONGEST_OPTION = 64
"""Bytes of one Telnet subnegotiation; those of RFC 2217 have up to 6, a signature may be longer."""
TOLERANCE = 0.0333
"""How far the terminal's rate may be from the firmware's: what the chip's own receiver stands, 8 bits, with a
fractional divider (RM0368 section 19.3.5)."""


class _Line:
    """What ``PortManager`` takes for a serial port: settings that are kept, and lines that are ready."""

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
        """The client forgets what the board has printed and it has not got."""
        self._on_purge()

    def reset_output_buffer(self) -> None:
        """What the client has typed is on the wire already."""


class Negotiated(Coding):
    """One client's Telnet.

    ``firmware_baud()`` is the rate that the firmware sends at now; ``say`` is told of a mismatch, repeatedly.
    """

    def __init__(self, firmware_baud: Callable[[], float], say: Callable[[str], None]) -> None:
        self._firmware_baud = firmware_baud
        self._say = say
        self._answers = bytearray()
        self._line = _Line(self._purged)
        self._hold_until_s = time.monotonic() + HOLD_S
        self._ready = self._takes_back = False
        self._manager = PortManager(self._line, self)

    def write(self, data: bytes) -> None:
        """For ``PortManager``: an answer to the client."""
        self._answers += data

    def encode(self, data: bytes) -> bytes:
        """Double each byte that is Telnet's escape."""
        self._compare_rates()
        return data.replace(b"\xff", b"\xff\xff")

    def decode(self, data: bytes) -> tuple[bytes, bytes]:
        """Take the negotiation out of ``data``."""
        try:
            typed = b"".join(self._manager.filter(data))
        except (TypeError, KeyError, struct.error) as error:  # what it raises at an option cut short
            raise ValueError("not RFC 2217") from error
        if len(self._manager.suboption or b"") > LONGEST_OPTION:
            raise ValueError("an option without an end")
        if typed:
            self._compare_rates()
        answers = bytes(self._answers)
        self._answers.clear()
        return typed, answers

    def ready(self) -> bool:
        """Return whether the client has set itself up."""
        self._ready = self._ready or time.monotonic() >= self._hold_until_s
        return self._ready

    def takes_back(self) -> bool:
        """Return whether a client that had set itself up has asked to forget what it was not sent."""
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
        told = (
            f"the terminal is set to {asked} baud and the firmware to {sends:.0f}; on a wire, that is garbage"
        )
        self._say(told)


class Rfc2217Link(TcpLink):
    """Clients connect to ``port`` of 127.0.0.1; None for the usual one, 0 for any that is free.

    ``firmware_baud()`` is the rate that the firmware's USART sends at; ``say(line)`` is told at once when a
    client's differs. Raises LinkError if the port cannot be had.
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
        """Return the Telnet of a client that has just come."""
        return Negotiated(self._firmware_baud, self._mismatch)

    def announce(self) -> list[str]:
        """Return the port and, for each usual terminal program, the command to paste."""
        return [
            f"serial: TCP port {self.port} of {HOST}, Telnet with RFC 2217; open it with one of",
            *(f"  {command}" for command in programs.for_rfc2217(self.port)),
        ]

    def report(self) -> list[str]:
        """Return what was lost, and the rates that did not fit."""
        return [*super().report(), *(f"serial: {self.address}: {one}" for one in self._mismatches)]

    def _mismatch(self, text: str) -> None:
        if text not in self._mismatches and len(self._mismatches) < _MOST_MISMATCHES:
            self._mismatches[text] = None
            self._say(f"serial: {self.address}: {text}")
