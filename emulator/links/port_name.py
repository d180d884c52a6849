"""The stable name of a pseudo-terminal: a symbolic link, the same in every run while ``/dev/pts/7`` is not.

Decision: a board that lives holds an flock on a file beside its link, and the kernel drops it however the
board dies. Roads not taken: asking whether the link's target still exists (its number may be another
terminal's by now) and a file with a process id (ids are used again too, and are not the same inside a
container).

POSIX only (``fcntl``).
"""

from __future__ import annotations

import contextlib
import fcntl
import itertools
import os
import sys
from pathlib import Path

from emulator.errors import LinkError
from emulator.links.runtime_folder import runtime_folder

PORT_NAME = "ttyFCU"


class PortName:
    """A claimed name: ``path`` is this board's alone until ``release``."""

    def __init__(self, path: Path, lock_fd: int) -> None:
        self.path = path
        self._lock_fd = lock_fd
        self._device = ""

    def point_to(self, device: str) -> None:
        """Make ``path`` a link to ``device``, in one step for who opens it meanwhile. Raises LinkError."""
        fresh = self.path.with_name(f".{self.path.name}.new")
        try:
            fresh.unlink(missing_ok=True)
            fresh.symlink_to(device)
            fresh.replace(self.path)
        except OSError as error:
            raise LinkError(f"--serial pty: cannot make the link {self.path}: {error.strerror}") from error
        self._device = device

    def release(self) -> None:
        """Remove the link, if it is still the one made here, and let others have the name."""
        with contextlib.suppress(OSError):
            if str(self.path.readlink()) == self._device:
                self.path.unlink()
        with contextlib.suppress(OSError):
            _lock_path(self.path).unlink()
        os.close(self._lock_fd)


def claim_port(path: Path | None = None) -> PortName:
    """Claim ``path``, or else the first free one of ttyFCU0, ttyFCU1, ... in the user's runtime folder.

    Raises LinkError if ``path`` is a living board's, is a file of another kind, or cannot be made.
    """
    if path is not None:
        if not path.name or "\0" in str(path):
            raise LinkError(f"--serial pty:{path}: not a name for a link; use --serial pty:/path/of/a/link")
        name = _claim(path.absolute())
        if name is None:
            raise LinkError(f"--serial pty:{path}: another board has this name; end it or choose another")
        return name
    directory = runtime_folder("--serial pty", "use --serial pty:/path/of/a/link")
    names = (_claim(directory / f"{PORT_NAME}{number}") for number in itertools.count())
    return next(name for name in names if name is not None)


def _claim(path: Path) -> PortName | None:
    """Return the claimed name, None if a living board has it; a link that a dead board left is taken over."""
    try:
        lock_fd = _lock(_lock_path(path))
    except OSError as error:
        raise LinkError(f"--serial pty: cannot make {path}: {error.strerror}; use another link") from error
    if lock_fd is None:
        return None
    name = PortName(path, lock_fd)
    foreign = not str(path.readlink()).startswith("/dev/") if path.is_symlink() else path.exists()
    if foreign:
        name.release()
        raise LinkError(f"--serial pty: {path} exists and is no link to a terminal; choose another name")
    return name


def _lock_path(path: Path) -> Path:
    return path.with_name(f".{path.name}.lock")


def _lock(path: Path) -> int | None:
    """Return the descriptor of ``path``, locked; None if another board holds the lock."""
    while True:
        lock_fd = os.open(path, os.O_RDWR | os.O_CREAT | getattr(os, "O_NOFOLLOW", 0), 0o600)
        try:
            if sys.platform != "win32":
                fcntl.flock(lock_fd, fcntl.LOCK_EX | fcntl.LOCK_NB)
            if _is_same_file(lock_fd, path):
                return lock_fd
            os.close(lock_fd)  # the last owner removed the file between our open and our lock: once more
        except BlockingIOError:
            os.close(lock_fd)
            return None
        except OSError:
            os.close(lock_fd)
            raise


def _is_same_file(fd: int, path: Path) -> bool:
    try:
        return os.path.samestat(os.fstat(fd), path.lstat())
    except FileNotFoundError:
        return False
