"""Where a session with a page is reached: its port and token, kept in a folder that is this user's alone.

So a page that was left open finds the server again when it is started again on the same port. A program that
may read the folder could open the page just as well.

The printed address has the token in its fragment, which no browser sends to a server; the socket gets it as a
subprotocol (:mod:`fcu_emulator.emulator.live.requests`).
"""

from __future__ import annotations

import json
import secrets
import string
from contextlib import suppress
from dataclasses import asdict, dataclass
from pathlib import Path

from fcu_emulator.emulator.errors import LinkError, OutputError
from fcu_emulator.emulator.host.files import write_atomically
from fcu_emulator.emulator.links.runtime_folder import read_own_file, runtime_folder
from fcu_emulator.emulator.live.listening import LOCAL

PROTOCOL = "fcu"
"""The subprotocol of the socket, which the server selects."""
TOKEN_PREFIX = "fcu.token."
"""Begins the other subprotocol that a client offers, which has the token."""
_TOKEN_LENGTH = 32
_TOKEN_SIGNS = frozenset(string.ascii_letters + string.digits + "-_")
_LARGEST_FILE = 4096


@dataclass(frozen=True)
class Address:
    """``http://HOST:PORT/#token=TOKEN``."""

    port: int
    token: str
    host: str = LOCAL

    @property
    def page(self) -> str:
        """The URL that opens the page."""
        return f"http://{self.host}:{self.port}/#token={self.token}"

    @property
    def socket(self) -> str:
        """The WebSocket, for programs; it wants :attr:`protocols`."""
        return f"ws://{self.host}:{self.port}/session"

    @property
    def protocols(self) -> tuple[str, str]:
        """The subprotocols that a client of :attr:`socket` has to offer."""
        return PROTOCOL, TOKEN_PREFIX + self.token


def address_for(port: int, host: str = LOCAL) -> Address:
    """The address on ``port``, with the token of an earlier server there, if this user's folder tells."""
    folder = _folder()
    token = ""
    if folder is not None:
        with suppress(OSError, ValueError, KeyError, TypeError, RecursionError):
            token = str(json.loads(read_own_file(_file(folder, port), _LARGEST_FILE))["token"])
    usable = len(token) == _TOKEN_LENGTH and _TOKEN_SIGNS.issuperset(token)
    return Address(port, token, host) if usable else fresh(port, host)


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
