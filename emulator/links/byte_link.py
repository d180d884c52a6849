"""Interface and common parts of byte links. A byte link is the other end of the virtual UART.

Decision: a link has a call to send and a call to receive, which never block. Links are polled every
10 to 20 ms of wall time, so that a run does not depend on thread scheduling.

Decision: a full queue of a link drops its oldest bytes, not the newest, because a user who returns
wants the current output.
"""

from __future__ import annotations

import time
from typing import Protocol, runtime_checkable

# -- The protocol -------------------------------------------------------------------------------------------


class ByteLink(Protocol):
    """The other end of the virtual UART, for use by one thread. It passes no bytes after ``close``."""

    def send(self, data: bytes) -> None:
        """Take ``data`` for the reader without blocking. If bytes do not fit, they are counted as lost."""

    def receive(self, most: int) -> bytes:
        """Return up to ``most`` bytes for the board without blocking. Keep the rest."""
        ...

    def flush(self, timeout_s: float) -> None:
        """Wait until an attached reader has all bytes or has stalled for 2 s, at most for ``timeout_s``."""

    def close(self) -> None:
        """Close the link and remove its files. A second call does nothing."""

    def announce(self) -> list[str]:
        """Return lines that tell the user how to connect."""
        ...

    def report(self) -> list[str]:
        """Return one line with the number of lost bytes and the reasons; [] without lost bytes."""
        ...

    def undelivered(self) -> int:
        """Return the number of bytes that did not reach an attached reader or file."""
        ...


@runtime_checkable
class Addressed(Protocol):
    """A link that terminal programs open by address."""

    @property
    def address(self) -> str:
        """A device path, or a port such as ``tcp:4001``."""
        ...


# -- The link of tests --------------------------------------------------------------------------------------


class MemoryLink:
    """A link for tests. ``sent`` has the board's bytes, and ``feed`` adds bytes for the board."""

    def __init__(self) -> None:
        self.sent = bytearray()
        self.closed = False
        self._inbox = bytearray()

    def feed(self, data: bytes) -> None:
        self._inbox += data

    def send(self, data: bytes) -> None:
        if not self.closed:
            self.sent += data

    def receive(self, most: int) -> bytes:
        if self.closed:
            return b""
        data = bytes(self._inbox[:most])
        del self._inbox[:most]
        return data

    def flush(self, timeout_s: float) -> None:
        """Return immediately: ``sent`` is complete."""

    def close(self) -> None:
        self.closed = True

    def announce(self) -> list[str]:
        return []

    def report(self) -> list[str]:
        return []

    def undelivered(self) -> int:
        return 0


# -- A bounded queue ----------------------------------------------------------------------------------------


class Backlog:
    """A queue of at most ``limit`` bytes for a reader. It is not thread-safe."""

    def __init__(self, limit: int) -> None:
        self.limit = limit
        self._bytes = bytearray()

    def __len__(self) -> int:
        return len(self._bytes)

    def put(self, data: bytes) -> int:
        """Append ``data``, and return the number of dropped bytes."""
        self._bytes += data
        excess = max(0, len(self._bytes) - self.limit)
        self.drop(excess)
        return excess

    def peek(self, count: int) -> bytes:
        """Return up to ``count`` of the oldest bytes, which stay in the queue."""
        return bytes(self._bytes[:count])

    def drop(self, count: int) -> None:
        del self._bytes[:count]

    def take(self, count: int | None = None) -> bytes:
        taken = self.peek(len(self._bytes) if count is None else count)
        self.drop(len(taken))
        return taken


# -- Waiting for a reader at the end of a run ---------------------------------------------------------------


STALL_S = 2.0
"""Seconds without progress after which a reader counts as stopped."""


class Patience:
    """Time limit of a reader: ``timeout_s``, or ``STALL_S`` after its latest progress, in seconds."""

    def __init__(self, timeout_s: float) -> None:
        now_s = time.monotonic()
        self._deadline_s = now_s + timeout_s
        self._progress_s = now_s
        self._left: int | None = None

    def wait_s(self, left: int) -> float:
        """Return the seconds to wait for ``left`` unread bytes."""
        now_s = time.monotonic()
        if left != self._left:
            self._left = left
            self._progress_s = now_s
        return max(0.0, min(self._deadline_s, self._progress_s + STALL_S) - now_s)


def losses(name: object, *counts: tuple[int, str]) -> list[str]:
    """Return the line of :meth:`ByteLink.report`; ``counts`` has numbers of lost bytes and reasons."""
    reasons = [(count, why) for count, why in counts if count]
    if len(reasons) == 1:
        return [f"serial: {reasons[0][0]} bytes lost on {name} {reasons[0][1]}"]
    lost = sum(count for count, _ in reasons)
    each = ", ".join(f"{count} {why}" for count, why in reasons)
    return [f"serial: {lost} bytes lost on {name}: {each}"] if lost else []
