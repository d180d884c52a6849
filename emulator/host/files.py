"""Files that are written atomically, and files with a size limit."""

from __future__ import annotations

import errno
import os
import secrets
import stat
import tempfile
from contextlib import suppress
from functools import partial
from pathlib import Path

from fcu_emulator.emulator.errors import InputError, LinkError, OutputError
from fcu_emulator.emulator.host.cleanup import before_exit, done

_BUFFER = 1 << 18
_SHORTEST_SECRET, _LONGEST_SECRET = 16, 4096  # bytes
_OF_A_NAME = frozenset(
    (errno.ENAMETOOLONG, errno.EINVAL, errno.EILSEQ, errno.ELOOP, errno.EISDIR, errno.ENOTDIR, errno.EEXIST)
)


def is_about_the_name(error: OSError) -> bool:
    """Return whether a file's name or kind causes ``error``."""
    return error.errno in _OF_A_NAME


def write_atomically(path: Path, data: bytes | str, *, private: bool = False) -> None:
    """Write ``data`` in one step, and create missing folders. Raises OutputError.

    ``private``: only this user may read the file. Devices such as ``/dev/null`` are not replaced.
    """
    contents = data.encode("utf-8") if isinstance(data, str) else data
    try:
        if _is_device(path):
            with path.open("wb", buffering=0) as device:
                device.write(contents)
            return
        path.parent.mkdir(parents=True, exist_ok=True)
        handle, name = tempfile.mkstemp(prefix=".", suffix=".tmp", dir=path.parent)
        remove = partial(_remove, Path(name))
        before_exit(remove)
        try:
            with os.fdopen(handle, "wb") as file:
                file.write(contents)
            if not private:  # mkstemp creates files that only the owner can access
                Path(name).chmod(0o644)
            Path(name).replace(path)
        except BaseException:
            remove()
            raise
        finally:
            done(remove)
    except OSError as error:
        raise OutputError(f"cannot write {path}: {error.strerror or error}") from error


def _remove(path: Path) -> None:
    with suppress(OSError):
        path.unlink()


def secret(path: Path) -> bytes:
    """Return a file's secret. A missing file is created with 32 random bytes.

    Raises InputError if the file cannot be a secret, OutputError if it cannot be created.
    """
    try:
        if path.exists() and not path.is_file():
            raise InputError(f"{path}: a secret must be a regular file")
        with path.open("rb") as file:
            contents = file.read(_LONGEST_SECRET)
    except FileNotFoundError:
        contents = secrets.token_bytes(32)
        write_atomically(path, contents, private=True)
    except OSError as error:
        raise InputError(f"cannot read {path}: {error.strerror or error}") from error
    if len(contents) < _SHORTEST_SECRET:
        problem = f"must have at least {_SHORTEST_SECRET} bytes, not {len(contents)}"
        raise InputError(f"{path}: a secret {problem}; delete the file to create a new one")
    return contents


def _is_device(path: Path) -> bool:
    """Return whether the path is a device. Raises OutputError unless it is a device or file."""
    try:
        mode = path.stat().st_mode
    except OSError:  # the following write reports the error
        return False
    if stat.S_ISCHR(mode):
        return True
    if not stat.S_ISREG(mode):
        raise OutputError(f"cannot write {path}: it is not a file")
    return False


class BoundedFile:
    """An ASCII file of at most ``most_bytes``. An existing file is emptied. Raises LinkError.

    ``what`` describes the file in messages.
    """

    def __init__(self, path: str | Path, what: str, most_bytes: int) -> None:
        self._what = what
        self._most = self._left = most_bytes
        try:
            self._file = Path(path).open("w", buffering=_BUFFER, encoding="ascii", newline="\n")
        except (OSError, ValueError) as error:  # ValueError: a null character
            problem = getattr(error, "strerror", None) or error
            raise LinkError(f"{what}: {problem}; give a writable path") from error

    def write(self, text: str) -> int:
        """Append the whole text or nothing. Raises OutputError."""
        self._left -= len(text)
        if self._left < 0:
            self.close()
            raise OutputError(
                f"{self._what}: it has reached {self._most} bytes; the run was stopped; "
                "to allow more: --limit trace_bytes=NUMBER"
            )
        try:
            return self._file.write(text)
        except OSError as error:
            raise self._failed(error) from error

    def flush(self) -> None:
        try:
            self._file.flush()
        except OSError as error:
            raise self._failed(error) from error

    def close(self) -> None:
        try:
            self._file.close()
        except OSError as error:
            raise self._failed(error) from error

    def _failed(self, error: OSError) -> OutputError:
        with suppress(OSError):  # closing would raise the same error again
            self._file.close()
        return OutputError(f"{self._what}: {error.strerror or error}; the run was stopped")
