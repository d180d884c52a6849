"""Output of the board in a file; the board receives no input."""

from __future__ import annotations

import stat
from pathlib import Path

from fcu_emulator.emulator.errors import LinkError
from fcu_emulator.emulator.links.writer import BackgroundWriter


class FileLink:
    """A link that writes to the file ``path``, which is created or emptied first.

    Raises LinkError if it cannot be opened, or if opening would block until a reader comes (a named pipe).
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        try:
            if path.exists() and not _takes_bytes(path):
                raise LinkError(
                    f"--serial file:PATH must be a regular or a new file, not {path}",
                    kind="no_file",
                )
            self._file = path.open("wb", buffering=0)
        except (OSError, ValueError) as error:  # ValueError: a null character
            problem = getattr(error, "strerror", None) or error
            text = f"--serial file:{path}: {problem}; give a writable path"
            raise LinkError(text, kind="not_writable") from error
        self._writer = BackgroundWriter(self._file, "serial-file")
        self._closed = False

    def send(self, data: bytes) -> None:
        """Queue ``data`` for the writing thread."""
        self._writer.put(data)

    def receive(self, most: int) -> bytes:
        """Return no bytes: a file has no keyboard."""
        del most
        return b""

    def flush(self, timeout_s: float) -> None:
        """Wait until all is written, at most ``timeout_s`` seconds."""
        self._writer.flush(timeout_s)

    def close(self) -> None:
        """Close the file; bytes not yet written are lost."""
        if self._closed:
            return
        self._closed = True
        if self._writer.close():
            self._file.close()

    def announce(self) -> list[str]:
        """Return a line with the destination of the text."""
        return [f"serial: to the file {self._path}"]

    def report(self) -> list[str]:
        """Return one line if bytes were lost."""
        lost = self._writer.lost
        reason = self._writer.failure or "it was too slow"
        return [f"serial: {lost} bytes lost on the file {self._path}: {reason}"] if lost else []

    def undelivered(self) -> int:
        """Return how many bytes were lost, for any reason."""
        return self._writer.lost


def _takes_bytes(path: Path) -> bool:
    """Return whether writing never blocks: a file, or a device such as /dev/null."""
    mode = path.stat().st_mode
    return stat.S_ISREG(mode) or stat.S_ISCHR(mode)
