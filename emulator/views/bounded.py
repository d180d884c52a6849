"""A text file that grows up to a bound; what cannot be written ends the run, as with the trace's own."""

from __future__ import annotations

from contextlib import suppress
from pathlib import Path

from emulator.errors import LinkError, OutputError

_BUFFER = 1 << 18


class BoundedFile:
    """``path``, made or emptied; ``option`` is what the user typed. Raises LinkError."""

    def __init__(self, path: Path, option: str, most_bytes: int) -> None:
        self._what = f"{option} {path}"
        self._most = self._left = most_bytes
        try:
            self._file = path.open("w", buffering=_BUFFER, encoding="ascii", newline="\n")
        except (OSError, ValueError) as error:  # ValueError: a null character
            problem = getattr(error, "strerror", None) or error
            raise LinkError(f"{self._what}: {problem}; give a path that can be written") from error

    def write(self, text: str) -> int:
        """Append ASCII text and return its length. Raises OutputError."""
        self._left -= len(text)
        if self._left < 0:
            raise OutputError(
                f"{self._what}: it has reached {self._most} bytes; the run was stopped; "
                "to allow more: --limit trace_bytes=NUMBER"
            )
        try:
            return self._file.write(text)
        except OSError as error:
            raise self._failed(error) from error

    def flush(self) -> None:
        """Hand the system what is buffered. Raises OutputError."""
        try:
            self._file.flush()
        except OSError as error:
            raise self._failed(error) from error

    def close(self) -> None:
        """Write what is left. Raises OutputError; a second call does nothing."""
        try:
            self._file.close()
        except OSError as error:
            with suppress(OSError):  # which would be this one again
                self._file.close()
            raise self._failed(error) from error

    def _failed(self, error: OSError) -> OutputError:
        return OutputError(f"{self._what}: {error.strerror or error}; the run was stopped")
