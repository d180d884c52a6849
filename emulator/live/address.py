"""Port and token of a session's page, stored for a restart of the server."""

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
"""The subprotocol that the server selects."""
TOKEN_PREFIX = "fcu.token."
"""Prefix of the second offered subprotocol, which contains the token."""
_TOKEN_LENGTH = 32
_TOKEN_SIGNS = frozenset(string.ascii_letters + string.digits + "-_")
_LARGEST_FILE = 4096


@dataclass(frozen=True)
class Address:
    """The address ``http://HOST:PORT/#token=TOKEN`` of a session, or its address behind a proxy.

    ``behind``: origin of the proxy, or "". ``base_path``: path prefix with a slash at both ends.
    """

    port: int
    token: str
    host: str = LOCAL
    base_path: str = "/"
    behind: str = ""

    @property
    def _place(self) -> str:
        return f"{self.behind or f'http://{self.host}:{self.port}'}{self.base_path}"

    @property
    def page(self) -> str:
        return f"{self._place}#token={self.token}"

    @property
    def page_without_token(self) -> str:
        return self._place

    @property
    def socket(self) -> str:
        """URL of the WebSocket. Clients must offer :attr:`protocols`."""
        return f"ws{self._place.removeprefix('http')}session"

    @property
    def protocols(self) -> tuple[str, str]:
        return PROTOCOL, TOKEN_PREFIX + self.token


def address_for(port: int, host: str = LOCAL) -> Address:
    """Return the address on ``port`` with the stored token, if any."""
    folder = _folder()
    token = ""
    if folder is not None:
        with suppress(OSError, ValueError, KeyError, TypeError, RecursionError):
            token = str(json.loads(read_own_file(_file(folder, port), _LARGEST_FILE))["token"])
    usable = len(token) == _TOKEN_LENGTH and _TOKEN_SIGNS.issuperset(token)
    return Address(port, token, host) if usable else fresh(port, host)


def fresh(port: int, host: str = LOCAL) -> Address:
    """Return an address with a new token."""
    return Address(port, secrets.token_urlsafe(24), host)


def publish(address: Address) -> None:
    """Store the address for a restart, if the user has a private folder."""
    folder = _folder()
    if folder is not None:
        with suppress(OutputError):
            write_atomically(_file(folder, address.port), json.dumps(asdict(address)), private=True)


def withdraw(address: Address) -> None:
    """Delete the address that is stored for the same port."""
    folder = _folder()
    if folder is not None:
        with suppress(OSError):
            _file(folder, address.port).unlink()


def _file(folder: Path, port: int) -> Path:
    return folder / f"web-{port}.json"


def _folder() -> Path | None:
    try:
        return runtime_folder("fcu web", "the page's token is not kept")
    except LinkError:
        return None
