"""This user's own folder for what exists while a board runs: names of ports, and where to reach the board.

On Linux and macOS it has mode 0700 and is in ``XDG_RUNTIME_DIR``, or else in the system's folder for
temporary files under the user's number; on Windows it is in ``LOCALAPPDATA``, which others cannot read.
"""

from __future__ import annotations

import os
import stat
import sys
import tempfile
from pathlib import Path

from emulator.errors import LinkError

NAME = "fcu-emulator"


def runtime_folder(option: str, instead: str) -> Path:
    """Return the folder, made if need be.

    ``option`` is what the user typed, and ``instead`` what to do without the folder, for the error. Raises
    LinkError if it is somebody else's or cannot be made.
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


def _windows_folder() -> Path:
    folder = Path(os.environ.get("LOCALAPPDATA") or tempfile.gettempdir()) / NAME
    folder.mkdir(parents=True, exist_ok=True)
    return folder


def _posix_folder(user: int, option: str, instead: str) -> Path:
    runtime = os.environ.get("XDG_RUNTIME_DIR")
    if runtime and _belongs_to(user, Path(runtime)):  # after "su" it may still be the other user's
        folder = Path(runtime) / NAME
    else:
        folder = Path(tempfile.gettempdir()) / f"{NAME}-{user}"
    folder.mkdir(mode=0o700, exist_ok=True)
    if not _belongs_to(user, folder):
        raise LinkError(f"{option}: {folder} is somebody else's; {instead}")
    folder.chmod(0o700)
    return folder


def _belongs_to(user: int, folder: Path) -> bool:
    """Tell whether ``folder`` is one, no link to one, and owned by ``user``."""
    try:
        status = folder.lstat()
    except OSError:
        return False
    return stat.S_ISDIR(status.st_mode) and status.st_uid == user
