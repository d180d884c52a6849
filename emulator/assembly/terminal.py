"""The Python interface of the serial terminal, in virtual time."""

from __future__ import annotations

import codecs
import re
from collections.abc import Callable

from fcu_emulator.emulator.buses.uart import NOT_UTF_8, Uart, decoded
from fcu_emulator.emulator.clock import PS_PER_S, Clock, to_ps
from fcu_emulator.emulator.errors import ExpectationError, InputError

_LOOK_EVERY_PS = PS_PER_S // 100  # virtual time between two checks in expect()
_TAIL, _LINES = 2_000, 8  # bytes and lines of output that an error shows


def _bytes_of(data: bytes, characters: int) -> int:
    """Return the number of bytes of the first characters."""
    decoder = codecs.getincrementaldecoder("utf-8")(NOT_UTF_8)
    count = 0
    for number, value in enumerate(data):
        if count >= characters:
            return number
        count += len(decoder.decode(bytes((value,))))
    return len(data)


class Terminal:
    """The board's output, decoded as UTF-8 or Latin-1, and a keyboard."""

    def __init__(self, uart: Uart, clock: Clock, run_until_ps: Callable[[int], None]) -> None:
        self.uart = uart
        """The serial line, with the time of every frame."""
        self._clock = clock
        self._run_until = run_until_ps
        self._read = 0  # number of bytes since power-on that read() has returned
        self._matched = -1, 0  # time and end of the latest match of expect()
        self.diagnosis: Callable[[], str] = lambda: ""
        """Function that returns the firmware's problems, for error messages."""

    @property
    def text(self) -> str:
        """All text since power-on, or at least the latest 8 MiB."""
        return decoded(self.uart.received())

    def read(self) -> bytes:
        """Return the bytes printed since the previous ``read()``."""
        data, self._read = self.since(self._read)
        return data

    def since(self, position: int) -> tuple[bytes, int]:
        """Return the bytes after ``position``, and the position after these bytes.

        If the board has returned to its past, a reader receives no byte for a second time.
        """
        received = self.uart.received()
        return bytes(received[self.uart.index_of(position) :]), max(position, self.uart.received_count())

    def write(self, data: bytes | str) -> None:
        """Type text or bytes. Raises InputError if the text is not Latin-1."""
        try:
            self.uart.type(data.encode("latin-1") if isinstance(data, str) else bytes(data))
        except UnicodeEncodeError as error:
            raise InputError(
                f"{error.object[error.start]!r} is not a Latin-1 character; give bytes, as a serial line does",
                kind="not_latin_1",
            ) from error

    @property
    def typing_left(self) -> int:
        """Number of typed bytes that have not arrived."""
        return self.uart.typing_left

    @property
    def position(self) -> int:
        """Number of bytes printed since power-on."""
        return self.uart.received_count()

    @property
    def match_end(self) -> int:
        """Number of bytes printed from power-on to the end of the latest match of :meth:`expect`; 0 before a match."""
        return self._matched[1]

    def expect(
        self, pattern: str | re.Pattern[str], timeout_s: float = 10.0, *, since: int | None = None
    ) -> re.Match[str]:
        """Run until ``pattern`` (a regular expression) is printed, and return the match.

        The search starts at byte position ``since`` (0: power-on), by default at the end of the
        output. If no time has passed since the previous match, the search starts at that match's end.
        Raises ExpectationError after ``timeout_s`` of virtual time.
        """
        try:
            compiled = re.compile(pattern)
        except re.error as error:
            raise InputError(
                f"pattern must be a regular expression, not {pattern!r}: {error}", kind="pattern"
            ) from error
        deadline_ps = self._clock.now_ps + to_ps(timeout_s)
        start = self._start() if since is None else since
        while True:
            data, end = self.since(start)
            match = compiled.search(decoded(data))
            if match:
                self._matched = self._clock.now_ps, end - len(data) + _bytes_of(data, match.end())
                return match
            if self._clock.now_ps >= deadline_ps:
                raise self._missing(compiled.pattern, timeout_s, data)
            self._run_until(min(deadline_ps, self._clock.now_ps + _LOOK_EVERY_PS))

    def _start(self) -> int:
        at_ps, position = self._matched
        return position if at_ps == self._clock.now_ps else self.position

    def _missing(self, pattern: str, timeout_s: float, data: bytes) -> ExpectationError:
        text = decoded(self.uart.received()[-_TAIL:])
        lines = [line for line in (one.strip("\r ") for one in text.split("\n")) if line][-_LINES:]
        problem = (
            f"{pattern!r} was not printed within {timeout_s:g} s (virtual time, now "
            f"{self._clock.now_s:.3f} s); the last output is {decoded(data[-200:])!r}"
        )
        return ExpectationError(problem, tuple(lines), self.diagnosis())
