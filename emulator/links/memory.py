"""The shipped test double of a byte link: both directions are plain bytes in memory."""

from __future__ import annotations


class MemoryLink:
    """A link whose reader is a test: ``sent`` is what the board sent, ``feed`` is what it will receive.

    It keeps everything, so its memory is bounded by the length of the test only.
    """

    def __init__(self) -> None:
        self.sent = bytearray()
        self.closed = False
        self._inbox = bytearray()

    def feed(self, data: bytes) -> None:
        """Let ``data`` arrive at the board with its next ``receive``."""
        self._inbox += data

    def send(self, data: bytes) -> None:
        """Append ``data`` to ``sent``."""
        if not self.closed:
            self.sent += data

    def receive(self) -> bytes:
        """Return and forget everything fed since the last call."""
        if self.closed:
            return b""
        data = bytes(self._inbox)
        self._inbox.clear()
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
