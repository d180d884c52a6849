"""Where a session with a page is reached: its port and token, kept in a folder that is this user's alone.

So a page that was left open finds the server again when it is started anew on the same port. Whoever may read
the folder could open the page just as well.
"""

from __future__ import annotations

import json
import secrets
from contextlib import suppress
from dataclasses import asdict, dataclass
from pathlib import Path

from emulator.errors import LinkError, OutputError
from emulator.files import write_atomically
from emulator.links.runtime_folder import runtime_folder
from emulator.live.listening import LOCAL

_TOKEN_LENGTH = 32


@dataclass(frozen=True)
class Address:
    """``http://HOST:PORT/?token=TOKEN``."""

    port: int
    token: str
    host: str = LOCAL

    @property
    def page(self) -> str:
        """The first URL of the page."""
        return f"http://{self.host}:{self.port}/?token={self.token}"

    @property
    def socket(self) -> str:
        """The WebSocket for programs."""
        return f"ws://{self.host}:{self.port}/session?token={self.token}"


def address_for(port: int, host: str = LOCAL) -> Address:
    """The address on ``port``, with the token of an earlier server there, if this user's folder tells."""
    folder = _folder()
    token = ""
    if folder is not None:
        with suppress(OSError, ValueError, KeyError, TypeError):
            token = str(json.loads(_file(folder, port).read_text(encoding="utf-8"))["token"])
    return Address(port, token, host) if len(token) == _TOKEN_LENGTH else fresh(port, host)


def fresh(port: int, host: str = LOCAL) -> Address:
    """An address with a new token."""
    return Address(port, secrets.token_urlsafe(24), host)


def publish(address: Address) -> None:
    """Keep it for the next server on this port; without a folder of this user's own it is not kept."""
    folder = _folder()
    if folder is not None:
        with suppress(OutputError):
            write_atomically(_file(folder, address.port), json.dumps(asdict(address)), private=True)


def withdraw(address: Address) -> None:
    """Forget an address, of a port that nobody will ask for again."""
    folder = _folder()
    if folder is not None:
        with suppress(OSError):
            _file(folder, address.port).unlink()


def _file(folder: Path, port: int) -> Path:
    return folder / f"web-{port}.json"


def _folder() -> Path | None:
    """A folder that nobody else can look into; None where there is none, or somebody else made it."""
    try:
        return runtime_folder("fcu web", "the page's token is not kept")
    except LinkError:
        return None
