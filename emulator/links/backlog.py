"""A bounded queue of bytes that gives up its oldest first.

Decision: the oldest bytes go, not the newest. Somebody who looks again after a pause wants to see what the
board says now; the road not taken (refuse the new) would show minutes-old text and then a gap of unknown
length.
"""

from __future__ import annotations


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
