"""The user's private folder for port names and control addresses of running boards."""

from __future__ import annotations

import errno
import os
import stat
import sys
import tempfile
from pathlib import Path

from fcu_emulator.emulator.errors import LinkError

NAME = "fcu-emulator"
_NEITHER_WAIT_NOR_FOLLOW = getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_NONBLOCK", 0)


def runtime_folder(option: str, instead: str) -> Path:
    """Return the folder, and create it if needed.

    Raises LinkError with ``option`` and ``instead`` in its message.
    """
    try:
        if sys.platform == "win32":
            folder = _windows_folder()
        else:
            folder = _posix_folder(os.geteuid(), option, instead)
    except OSError as error:
        problem = f"cannot use the folder {error.filename}: {error.strerror}"
        raise LinkError(f"{option}: {problem}; {instead}") from error
    return folder


def read_own_file(path: Path, most_bytes: int) -> bytes:
    """Read a regular file of this user without blocking. Raises OSError for any other file."""
    descriptor = os.open(path, os.O_RDONLY | _NEITHER_WAIT_NOR_FOLLOW)
    with os.fdopen(descriptor, "rb") as file:
        status = os.fstat(descriptor)
        if not stat.S_ISREG(status.st_mode) or path.is_symlink():
            raise OSError(errno.EINVAL, "is not a regular file", str(path))
        if sys.platform != "win32" and status.st_uid != os.geteuid():
            raise OSError(errno.EPERM, "belongs to another user", str(path))
        contents = file.read(most_bytes + 1)
    if len(contents) > most_bytes:
        raise OSError(errno.EFBIG, f"has more than {most_bytes} bytes", str(path))
    return contents


def _windows_folder() -> Path:
    folder = Path(os.environ.get("LOCALAPPDATA") or tempfile.gettempdir()) / NAME
    folder.mkdir(parents=True, exist_ok=True)
    return folder


def _posix_folder(user: int, option: str, instead: str) -> Path:
    runtime = os.environ.get("XDG_RUNTIME_DIR")
    if runtime and _belongs_to(
        user, Path(runtime)
    ):  # after "su" the variable may still contain the previous user's folder
        folder = Path(runtime) / NAME
    else:
        folder = Path(tempfile.gettempdir()) / f"{NAME}-{user}"
    folder.mkdir(mode=0o700, exist_ok=True)
    if not _belongs_to(user, folder):
        raise LinkError(f"{option}: {folder} belongs to another user; {instead}", kind="foreign_folder")
    folder.chmod(0o700)
    return folder


def _belongs_to(user: int, folder: Path) -> bool:
    try:
        status = folder.lstat()
    except OSError:
        return False
    return stat.S_ISDIR(status.st_mode) and status.st_uid == user
