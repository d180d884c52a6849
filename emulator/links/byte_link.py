"""What every byte link offers, and what links share: the far end of the virtual UART, seen from the board.

Decision: the seam is a pair of calls that never block, polled by the runner every 10 to 20 ms of wall time.
The road not taken is a callback per received byte from the link's own thread: the board would then need
locks, and a run would depend on when a thread was scheduled. A link may use threads inside; nobody outside
sees them.

The law every link keeps: a reader that is absent, slow or goes away neither stops nor slows the board, and
loses nothing that a real UART would not lose; all 256 byte values pass unchanged both ways; memory is
bounded.

Decision: when a queue is full its oldest bytes go, not the newest. Somebody who looks again after a pause
wants to see what the board says now; the road not taken (refuse the new) would show minutes-old text and then
a gap of unknown length.
"""

from __future__ import annotations

import time
from typing import Protocol, runtime_checkable

# -- The protocol -------------------------------------------------------------------------------------------


class ByteLink(Protocol):
    """The other end of the virtual UART: a terminal, a pipe, a pseudo-terminal, a test.

    Used from one thread. After ``close`` a link takes nothing more and has nothing more to give, without an
    error.
    """

    def send(self, data: bytes) -> None:
        """Take all of ``data`` (board to reader) without blocking; what cannot be kept is counted."""

    def receive(self, most: int) -> bytes:
        """Return up to ``most`` bytes that have arrived for the board, ``b""`` if none; never blocks.

        The rest waits: in the link as far as its bound allows, then where it comes from, whose writer waits.
        """
        ...

    def flush(self, timeout_s: float) -> None:
        """Give an attached reader up to ``timeout_s`` seconds of wall time to take what is queued.

        Returns earlier when all is taken, when nobody reads, or when the reader takes nothing for two
        seconds.
        """

    def close(self) -> None:
        """Give up the link and everything it made outside; a second call does nothing."""

    def announce(self) -> list[str]:
        """Return the lines that tell the user, at the start, how to reach this link."""
        ...

    def report(self) -> list[str]:
        """Return one line saying how many bytes were lost and why; no line if none was."""
        ...

    def undelivered(self) -> int:
        """Return how many bytes an attached reader, or a file, should have had and did not get."""
        ...


@runtime_checkable
class Addressed(Protocol):
    """A link that a terminal program opens."""

    @property
    def address(self) -> str:
        """Where: a device's path, or such as ``tcp:4001``."""
        ...


# -- The link of tests --------------------------------------------------------------------------------------


class MemoryLink:
    """A link whose reader is a test: ``sent`` is what the board sent, ``feed`` is what it will receive.

    It keeps everything, so its memory is bounded by the length of the test only.
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
        """Return and forget the oldest bytes that were fed."""
        if self.closed:
            return b""
        data = bytes(self._inbox[:most])
        del self._inbox[:most]
        return data

    def flush(self, timeout_s: float) -> None:
        """Return at once: ``sent`` is always up to date."""

    def close(self) -> None:
        """Take and give nothing more; ``sent`` stays readable."""
        self.closed = True

    def announce(self) -> list[str]:
        """Return no line: nobody outside can reach this link."""
        return []

    def report(self) -> list[str]:
        """Return no line: nothing is ever lost."""
        return []

    def undelivered(self) -> int:
        """Return 0: nothing is ever lost."""
        return 0


# -- A bounded queue ----------------------------------------------------------------------------------------


class Backlog:
    """Bytes waiting for a reader, at most ``limit`` of them; a changed ``limit`` holds from the next put.

    Not thread-safe: who shares one holds a lock.
    """

    def __init__(self, limit: int) -> None:
        self.limit = limit
        self._bytes = bytearray()

    def __len__(self) -> int:
        return len(self._bytes)

    def put(self, data: bytes) -> int:
        """Append ``data`` and return how many of the oldest bytes had to go for it."""
        self._bytes += data
        excess = max(0, len(self._bytes) - self.limit)
        self.drop(excess)
        return excess

    def peek(self, count: int) -> bytes:
        """Return up to ``count`` of the oldest bytes, which stay queued."""
        return bytes(self._bytes[:count])

    def drop(self, count: int) -> None:
        """Forget the ``count`` oldest bytes; a bytearray does this without moving the rest."""
        del self._bytes[:count]

    def take(self, count: int | None = None) -> bytes:
        """Remove and return up to ``count`` of the oldest bytes, all of them by default."""
        taken = self.peek(len(self._bytes) if count is None else count)
        self.drop(len(taken))
        return taken


# -- Waiting for a reader at the end of a run ---------------------------------------------------------------


STALL_S = 2.0
"""Seconds without progress after which a reader is taken to have stopped, such as a paused ``less``."""


class Patience:
    """Waiting for a reader is over after ``timeout_s`` seconds, or ``STALL_S`` after its last progress."""

    def __init__(self, timeout_s: float) -> None:
        now_s = time.monotonic()
        self._deadline_s = now_s + timeout_s
        self._progress_s = now_s
        self._left: int | None = None

    def wait_s(self, left: int) -> float:
        """Return how many more seconds ``left`` untaken bytes may be waited for; 0.0 when it is over."""
        now_s = time.monotonic()
        if left != self._left:
            self._left = left
            self._progress_s = now_s
        return max(0.0, min(self._deadline_s, self._progress_s + STALL_S) - now_s)


def losses(name: object, *counts: tuple[int, str]) -> list[str]:
    """The line of :meth:`ByteLink.report` about bytes lost on ``name``, each a number and why."""
    reasons = [f"{count} {why}" for count, why in counts if count]
    lost = sum(count for count, _ in counts)
    return [f"serial: {lost} bytes lost on {name}: {', '.join(reasons)}"] if lost else []
