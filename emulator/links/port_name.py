"""Stable name of a pseudo-terminal: a symbolic link with a fixed path (POSIX only).

Decision: the process of a running board holds an flock on a file beside its symbolic link, because
terminal numbers and process ids are reused.
"""

from __future__ import annotations

import contextlib
import errno
import fcntl
import itertools
import os
import stat
import sys
from pathlib import Path

from fcu_emulator.emulator.errors import LinkError
from fcu_emulator.emulator.host.cleanup import before_exit, done
from fcu_emulator.emulator.links.runtime_folder import runtime_folder

PORT_NAME = "ttyFCU"


class PortName:
    """A claimed ``path``, which belongs to this board until ``release``."""

    def __init__(self, path: Path, lock_fd: int) -> None:
        self.path = path
        self._lock_fd = lock_fd
        self._device = ""
        before_exit(self._remove_files)

    def point_to(self, device: str) -> None:
        """Atomically link ``path`` to ``device``. Raises LinkError."""
        self._device = device
        fresh = self._new_link
        try:
            fresh.unlink(missing_ok=True)
            fresh.symlink_to(device)
            fresh.replace(self.path)
        except OSError as error:
            raise LinkError(f"--serial pty: cannot create the link {self.path}: {error.strerror}") from error

    def release(self) -> None:
        self._remove_files()
        done(self._remove_files)
        os.close(self._lock_fd)

    def _remove_files(self) -> None:
        with contextlib.suppress(OSError):
            if str(self.path.readlink()) == self._device:
                self.path.unlink()
        lock = _lock_path(self.path)
        if _is_same_file(
            self._lock_fd, lock
        ):  # the file is removed while it is locked: after the unlock, the file may belong to another board
            with contextlib.suppress(OSError):
                self._new_link.unlink(missing_ok=True)
                lock.unlink()

    @property
    def _new_link(self) -> Path:
        return self.path.with_name(f".{self.path.name}.new")


def claim_port(path: Path | None = None) -> PortName:
    """Claim ``path``, by default the first free ttyFCU<n> in the user's runtime folder.

    Raises LinkError if ``path`` is in use or cannot be created.
    """
    if path is not None:
        if not path.name or "\0" in str(path):
            raise LinkError(f"--serial pty:LINK must be a path such as /path/of/a/link, not {path}")
        name = _claim(path.absolute())
        if name is None:
            raise LinkError(
                f"--serial pty:{path}: another board has this name; end it or choose another",
                kind="name_in_use",
            )
        return name
    directory = runtime_folder("--serial pty", "use --serial pty:/path/of/a/link")
    names = (_claim(directory / f"{PORT_NAME}{number}") for number in itertools.count())
    return next(name for name in names if name is not None)


def _claim(path: Path) -> PortName | None:
    """Return the claimed name, or None if another board has it."""
    try:
        lock_fd = _lock(_lock_path(path))
    except OSError as error:
        raise LinkError(
            f"--serial pty: cannot create {path}: {error.strerror}; use another link", kind="cannot_create"
        ) from error
    if lock_fd is None:
        return None
    name = PortName(path, lock_fd)
    if _is_foreign(path):
        name.release()
        raise LinkError(
            f"--serial pty: {path} must not exist, or be a link to a terminal; choose another name",
            kind="not_a_terminal",
        )
    return name


def _is_foreign(path: Path) -> bool:
    if path.is_symlink():
        return not str(path.readlink()).startswith("/dev/")
    return path.exists()


def _lock_path(path: Path) -> Path:
    return path.with_name(f".{path.name}.lock")


def _lock(path: Path) -> int | None:
    """Lock a file, and return its descriptor, or None if another board has the lock."""
    while True:
        flags = os.O_RDWR | os.O_CREAT | getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_NONBLOCK", 0)
        lock_fd = os.open(path, flags, 0o600)
        try:
            if not stat.S_ISREG(os.fstat(lock_fd).st_mode):
                raise OSError(errno.EINVAL, f"{path.name} is not a regular file", str(path))
            if sys.platform != "win32":
                fcntl.flock(lock_fd, fcntl.LOCK_EX | fcntl.LOCK_NB)
            if _is_same_file(lock_fd, path):
                return lock_fd
            os.close(lock_fd)  # the previous owner removed the file between open and lock: try again
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
