"""Firmware files of a session, watched on disk or uploaded from the page."""

from __future__ import annotations

import tempfile
from contextlib import suppress
from itertools import islice
from pathlib import Path
from typing import Final

from fcu_emulator.emulator.assembly.board import Board
from fcu_emulator.emulator.explain.source_text import SOURCE_SUFFIXES
from fcu_emulator.emulator.text import one_line

_MOST_FILES: Final = 1000


class FileWatch:
    """Poller of a file, which reports a change when the new file is complete."""

    def __init__(self, path: str | Path) -> None:
        self.path = Path(path)
        self._loaded = self._seen = self._stamp()

    @property
    def exists(self) -> bool:
        return self._loaded is not None or self._stamp() is not None

    def sources(self) -> dict[str, str]:
        """Return the paths of the source files in the file's folder, keyed by name; {} if the folder cannot be read."""
        folder = self.path.resolve().parent
        try:
            found = [one for one in islice(folder.iterdir(), _MOST_FILES) if one.suffix in SOURCE_SUFFIXES]
        except OSError:
            return {}
        return {one.name: one.as_posix() for one in sorted(found)}

    def changed(self) -> bool:
        """Return True one time per change, as soon as two successive calls find the same file."""
        stamp = self._stamp()
        settled = stamp == self._seen
        self._seen = stamp
        if stamp is None or stamp == self._loaded or not settled or stamp[1] == 0:
            return False
        self._loaded = stamp
        return True

    def _stamp(self) -> tuple[int, int] | None:
        try:
            status = self.path.stat()
        except OSError:
            return None
        return status.st_mtime_ns, status.st_size


class UploadedFile:
    """A temporary copy of uploaded firmware. Raises OSError if it cannot be written."""

    def __init__(self, name: str, content: bytes) -> None:
        self.name = one_line(name)
        self._folder = tempfile.TemporaryDirectory(prefix="fcu-web-")
        self.path = Path(self._folder.name) / f"uploaded{Path(name).suffix.lower()}"
        try:
            self.path.write_bytes(content)
        except BaseException:
            self.remove()
            raise

    def shown(self, board: Board) -> str:
        return self.name if board.booted.name == str(self.path) else board.booted.name

    def remove(self) -> None:
        with suppress(OSError):
            self._folder.cleanup()
