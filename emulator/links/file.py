"""Link that writes the board's output to a file. The link has no input."""

from __future__ import annotations

import stat
from pathlib import Path

from fcu_emulator.emulator.errors import LinkError
from fcu_emulator.emulator.links.writer import BackgroundWriter


class FileLink:
    """A link to the file ``path``, which is created or emptied.

    Raises LinkError if the file cannot be opened or a write could block.
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
        self._writer.put(data)

    def receive(self, most: int) -> bytes:
        del most
        return b""

    def flush(self, timeout_s: float) -> None:
        self._writer.flush(timeout_s)

    def close(self) -> None:
        if self._closed:
            return
        self._closed = True
        if self._writer.close():
            self._file.close()

    def announce(self) -> list[str]:
        return [f"serial: to the file {self._path}"]

    def report(self) -> list[str]:
        lost = self._writer.lost
        reason = self._writer.failure or "it was too slow"
        return [f"serial: {lost} bytes lost on the file {self._path}: {reason}"] if lost else []

    def undelivered(self) -> int:
        return self._writer.lost


def _takes_bytes(path: Path) -> bool:
    mode = path.stat().st_mode
    return stat.S_ISREG(mode) or stat.S_ISCHR(mode)
