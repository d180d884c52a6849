"""Where a session with a page is reached: its port and token, kept in a folder that is this user's alone.

So a page that was left open finds the server again when it is started anew on the same port, and other
programs of this user find running boards. Whoever may read the folder could open the page just as well.
"""

from __future__ import annotations

import json
import os
import secrets
import stat
import tempfile
from contextlib import suppress
from dataclasses import asdict, dataclass
from pathlib import Path

_TOKEN_LENGTH = 32


@dataclass(frozen=True)
class Address:
    """``http://127.0.0.1:PORT/?token=TOKEN``."""

    port: int
    token: str

    @property
    def page(self) -> str:
        """The first URL of the page."""
        return f"http://127.0.0.1:{self.port}/?token={self.token}"

    @property
    def socket(self) -> str:
        """The WebSocket for programs."""
        return f"ws://127.0.0.1:{self.port}/session?token={self.token}"


def address_for(port: int) -> Address:
    """The address on ``port``, with the token of an earlier server there, if this user's folder tells."""
    folder = _folder()
    token = ""
    if folder is not None:
        with suppress(OSError, ValueError, KeyError, TypeError):
            token = str(json.loads(_file(folder, port).read_text(encoding="utf-8"))["token"])
    return Address(port, token) if len(token) == _TOKEN_LENGTH else fresh(port)


def fresh(port: int) -> Address:
    """An address with a new token."""
    return Address(port, secrets.token_urlsafe(24))


def publish(address: Address) -> None:
    """Let this user's other programs find it; without a folder of its own nobody does."""
    folder = _folder()
    if folder is None:
        return
    with suppress(OSError):
        handle, name = tempfile.mkstemp(dir=folder)
        with os.fdopen(handle, "w", encoding="utf-8") as file:
            json.dump(asdict(address), file)
        Path(name).replace(_file(folder, address.port))


def withdraw(address: Address) -> None:
    """Forget an address, of a port that nobody will ask for again."""
    folder = _folder()
    if folder is not None:
        with suppress(OSError):
            _file(folder, address.port).unlink()


def known() -> list[Address]:
    """Addresses of sessions of this user, the latest first; some may have ended."""
    folder = _folder()
    if folder is None:
        return []
    found = []
    for path in folder.glob("web-*.json"):
        with suppress(OSError, ValueError, TypeError, KeyError):
            table = json.loads(path.read_text(encoding="utf-8"))
            found.append((path.stat().st_mtime, Address(int(table["port"]), str(table["token"]))))
    return [address for _, address in sorted(found, key=lambda one: one[0], reverse=True)]


def _file(folder: Path, port: int) -> Path:
    return folder / f"web-{port}.json"


def _folder() -> Path | None:
    """A folder that nobody else can look into; None where there is none, or somebody else made it."""
    user = (
        str(os.getuid()) if hasattr(os, "getuid") else "user"
    )  # on Windows the temporary folder is one's own
    folder = Path(tempfile.gettempdir()) / f"fcu-emulator-web-{user}"
    try:
        folder.mkdir(mode=0o700, exist_ok=True)
        status = folder.lstat()
    except OSError:
        return None
    private = not hasattr(os, "getuid") or (status.st_uid == os.getuid() and not status.st_mode & 0o077)
    return folder if stat.S_ISDIR(status.st_mode) and private else None
