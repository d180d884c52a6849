"""The terminal at the other end of USART1, for Python.

Everything is in virtual time: ``expect`` runs the board until a pattern has been printed, and gives up after
a given virtual time, so a result does not depend on how fast the machine is.
"""

from __future__ import annotations

import re
from collections.abc import Callable

from emulator.buses.uart import Uart
from emulator.errors import ExpectationError, InputError
from emulator.time.clock import PS_PER_S, Clock, to_ps

_LOOK_EVERY_PS = PS_PER_S // 100  # how far expect() runs between two looks


class Terminal:
    """What the board has printed, and a keyboard.

    Text is Latin-1: one character for each byte, so that all 256 values survive.
    """

    def __init__(self, uart: Uart, clock: Clock, run_until_ps: Callable[[int], None]) -> None:
        self.uart = uart
        """The serial line itself, with the time of every frame."""
        self._clock = clock
        self._run_until = run_until_ps
        self._read = 0  # bytes handed out by read(), counted from power-on
        self._expected = 0  # bytes already matched by expect()

    @property
    def text(self) -> str:
        """Everything printed since power-on (of very long runs, the last 8 MiB at least)."""
        return self.uart.received().decode("latin-1")

    def read(self) -> bytes:
        """The bytes printed since the last ``read()``."""
        data, self._read = self.since(self._read)
        return data

    def since(self, position: int) -> tuple[bytes, int]:
        """The bytes printed after ``position`` (counted from power-on), and the position after them."""
        received = self.uart.received()
        start = max(position - self.uart.dropped, 0)
        return bytes(received[start:]), self.uart.dropped + len(received)

    def write(self, data: bytes | str) -> None:
        """Type on the keyboard; the bytes arrive at USART1 one after the other at the line's speed."""
        try:
            self.uart.type(data.encode("latin-1") if isinstance(data, str) else bytes(data))
        except UnicodeEncodeError as error:
            raise InputError(
                f"{error.object[error.start]!r} is no Latin-1 character; give bytes, as a serial line does"
            ) from error

    def expect(self, pattern: str | re.Pattern[str], timeout_s: float = 10.0) -> re.Match[str]:
        """Run the board until ``pattern`` (a regular expression) appears after the last match.

        Returns the match. Raises ExpectationError when it has not appeared after ``timeout_s`` of virtual
        time.
        """
        try:
            compiled = re.compile(pattern)
        except re.error as error:
            raise InputError(f"{pattern!r} is no regular expression: {error}") from error
        deadline_ps = self._clock.now_ps + to_ps(timeout_s)
        while True:
            data, end = self.since(self._expected)
            match = compiled.search(data.decode("latin-1"))
            if match:
                self._expected = end - len(data) + match.end()
                return match
            if self._clock.now_ps >= deadline_ps:
                tail = data[-200:].decode("latin-1")
                raise ExpectationError(
                    f"{compiled.pattern!r} was not printed within {timeout_s:g} s (virtual time, now "
                    f"{self._clock.now_s:.3f} s); the last output is {tail!r}"
                )
            self._run_until(min(deadline_ps, self._clock.now_ps + _LOOK_EVERY_PS))
