"""The interface of all byte links, and their common parts: the other end of the virtual UART, as the board sees it.

Decision: a link is a pair of calls that never block, which the runner polls every 10 to 20 ms of wall time. A
callback per received byte from the link's thread was rejected: the board would need locks, and a run would
depend on the scheduling of threads. A link may use threads internally; they are invisible outside.

All links guarantee this: a reader that is absent, slow or leaves neither stops nor slows the board, and loses
no bytes that a real UART would not lose. All 256 byte values pass unchanged both ways. Memory is bounded.

Decision: the full queue of a link drops its oldest bytes, not the newest. A user who returns after a pause
wants to see the board's current output. Refusing new bytes was rejected: it would show minutes-old text and
then a gap of unknown length.
"""

from __future__ import annotations

import time
from typing import Protocol, runtime_checkable

# -- The protocol -------------------------------------------------------------------------------------------


class ByteLink(Protocol):
    """The other end of the virtual UART: a terminal, a pipe, a pseudo-terminal, a test.

    Used from one thread. After ``close`` a link accepts and returns no more bytes, without an error.
    """

    def send(self, data: bytes) -> None:
        """Take all of ``data`` (board to reader) without blocking; bytes that do not fit are counted."""

    def receive(self, most: int) -> bytes:
        """Return up to ``most`` bytes that have arrived for the board, ``b""`` if none; never blocks.

        The rest waits: in the link up to its limit, then at its source, whose writer waits.
        """
        ...

    def flush(self, timeout_s: float) -> None:
        """Give an attached reader up to ``timeout_s`` seconds of wall time to read the queued bytes.

        Returns earlier when all bytes are read, without a reader, or when the reader reads nothing for two
        seconds.
        """

    def close(self) -> None:
        """Close the link and remove everything it created outside; a second call does nothing."""

    def announce(self) -> list[str]:
        """Return the lines that tell the user, at the start, how to reach this link."""
        ...

    def report(self) -> list[str]:
        """Return one line with the number of lost bytes and the reasons; no line if none was lost."""
        ...

    def undelivered(self) -> int:
        """Return how many bytes an attached reader, or a file, should have received and did not."""
        ...


@runtime_checkable
class Addressed(Protocol):
    """A link that a terminal program opens."""

    @property
    def address(self) -> str:
        """The address: a device's path, or for example ``tcp:4001``."""
        ...


# -- The link of tests --------------------------------------------------------------------------------------


class MemoryLink:
    """A link whose reader is a test: ``sent`` contains the board's bytes, ``feed`` adds bytes for the board.

    It keeps everything, so its memory is bounded only by the length of the test.
    """

    def __init__(self) -> None:
        self.sent = bytearray()
        self.closed = False
        self._inbox = bytearray()

    def feed(self, data: bytes) -> None:
        """Let ``data`` arrive at the board with its next calls of ``receive``."""
        self._inbox += data

    def send(self, data: bytes) -> None:
        """Append ``data`` to ``sent``."""
        if not self.closed:
            self.sent += data

    def receive(self, most: int) -> bytes:
        """Remove and return the oldest bytes that were fed."""
        if self.closed:
            return b""
        data = bytes(self._inbox[:most])
        del self._inbox[:most]
        return data

    def flush(self, timeout_s: float) -> None:
        """Return at once: ``sent`` is always up to date."""

    def close(self) -> None:
        """Accept and return no more bytes; ``sent`` stays readable."""
        self.closed = True

    def announce(self) -> list[str]:
        """Return no line: this link cannot be reached from outside."""
        return []

    def report(self) -> list[str]:
        """Return no line: this link never loses bytes."""
        return []

    def undelivered(self) -> int:
        """Return 0: this link never loses bytes."""
        return 0


# -- A bounded queue ----------------------------------------------------------------------------------------


class Backlog:
    """Bytes waiting for a reader, at most ``limit`` of them; a changed ``limit`` applies from the next put.

    Not thread-safe: threads that share one must hold a lock.
    """

    def __init__(self, limit: int) -> None:
        self.limit = limit
        self._bytes = bytearray()

    def __len__(self) -> int:
        return len(self._bytes)

    def put(self, data: bytes) -> int:
        """Append ``data`` and return how many of the oldest bytes were dropped for it."""
        self._bytes += data
        excess = max(0, len(self._bytes) - self.limit)
        self.drop(excess)
        return excess

    def peek(self, count: int) -> bytes:
        """Return up to ``count`` of the oldest bytes, which stay queued."""
        return bytes(self._bytes[:count])

    def drop(self, count: int) -> None:
        """Remove the ``count`` oldest bytes; a bytearray does this without moving the rest."""
        del self._bytes[:count]

    def take(self, count: int | None = None) -> bytes:
        """Remove and return up to ``count`` of the oldest bytes, all of them by default."""
        taken = self.peek(len(self._bytes) if count is None else count)
        self.drop(len(taken))
        return taken


# -- Waiting for a reader at the end of a run ---------------------------------------------------------------


STALL_S = 2.0
"""Seconds without progress after which a reader counts as stopped, such as a paused ``less``."""


class Patience:
    """The time limit for a reader: ``timeout_s`` seconds, or ``STALL_S`` after its last progress."""

    def __init__(self, timeout_s: float) -> None:
        now_s = time.monotonic()
        self._deadline_s = now_s + timeout_s
        self._progress_s = now_s
        self._left: int | None = None

    def wait_s(self, left: int) -> float:
        """Return how many more seconds to wait for ``left`` unread bytes; 0.0 at the limit."""
        now_s = time.monotonic()
        if left != self._left:
            self._left = left
            self._progress_s = now_s
        return max(0.0, min(self._deadline_s, self._progress_s + STALL_S) - now_s)


def losses(name: object, *counts: tuple[int, str]) -> list[str]:
    """Return the line of :meth:`ByteLink.report` about bytes lost on ``name``; each count has a reason."""
    reasons = [f"{count} {why}" for count, why in counts if count]
    lost = sum(count for count, _ in counts)
    return [f"serial: {lost} bytes lost on {name}: {', '.join(reasons)}"] if lost else []
