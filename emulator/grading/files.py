"""Writing files that are whole or not there: who reads them, or is interrupted, never sees half of one."""

from __future__ import annotations

import os
import tempfile
from contextlib import suppress
from pathlib import Path

from emulator.errors import OutputError


def write_atomically(path: Path, data: bytes | str) -> None:
    """Put ``data`` into the file ``path``, folders made as needed. Raises OutputError."""
    contents = data.encode("utf-8") if isinstance(data, str) else data
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        handle, name = tempfile.mkstemp(prefix=".", suffix=".tmp", dir=path.parent)
        try:
            with os.fdopen(handle, "wb") as file:
                file.write(contents)
            Path(name).chmod(0o644)  # mkstemp makes files for the owner alone
            Path(name).replace(path)
        except BaseException:
            with suppress(OSError):
                Path(name).unlink()
            raise
    except OSError as error:
        raise OutputError(f"{path}: cannot be written: {error.strerror or error}") from error
