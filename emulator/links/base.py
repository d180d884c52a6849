"""What every byte link offers: the virtual UART's far end, seen from the board.

Decision: the seam is a pair of calls that never block, polled by the board's loop every 10 to 20 ms of wall
time. The road not taken is a callback per received byte from the link's own thread: the board would then need
locks, and a run would depend on when a thread was scheduled. A link may use threads inside; nobody outside
sees them.

The law every link keeps: a reader that is absent, slow or goes away neither stops nor slows the board, and
loses nothing that a real UART would not lose; all 256 byte values pass unchanged both ways; memory is
bounded.
"""

from __future__ import annotations

from typing import Protocol


class ByteLink(Protocol):
    """The other end of the virtual UART: a terminal, a pipe, a pseudo-terminal, a test.

    Used from one thread. After ``close`` a link takes nothing more and has nothing more to give, without an
    error.
    """

    def send(self, data: bytes) -> None:
        """Take all of ``data`` (board to reader) without blocking; what cannot be kept is counted."""

    def receive(self) -> bytes:
        """Return what has arrived for the board since the last call, ``b""`` if nothing; never blocks."""
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
