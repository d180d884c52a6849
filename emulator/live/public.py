"""The page's public address behind a reverse proxy, for example in JupyterHub.

The user names the origin (``--behind https://hub.example``) and the path prefix (``--base-path /user/ada/fcu/``).

Decision: the proxy must keep the prefix and the ``Host`` header, and headers such as ``X-Forwarded-Host`` are not
read. Every caller of the port can send those headers, but only the user gives the options.
"""

from __future__ import annotations

import os
import re
from dataclasses import dataclass
from urllib.parse import urlsplit

from fcu_emulator.emulator.errors import InputError
from fcu_emulator.emulator.live import listening
from fcu_emulator.emulator.text import shown

TOKEN_VARIABLE = "FCU_WEB_TOKEN"
"""Environment variable with the token of the page, for a program that starts ``fcu web`` and opens the page."""
_TOKEN = re.compile(r"[A-Za-z0-9_-]{32,100}")
_LONGEST = 1000  # characters of a prefix or an origin
_PREFIX = re.compile(
    r"(/(?!\.{1,2}/)([A-Za-z0-9._~!$&'()*+,=:@-]|%[0-9A-Fa-f]{2})+)*/"
)  # RFC 3986, 3.3: no ";"
_HOST = re.compile(r"[a-z0-9]([a-z0-9.-]*[a-z0-9])?|\[[0-9a-f:.]+\]")
_USUAL_PORTS = {"http": 80, "https": 443}


@dataclass(frozen=True)
class PublicPlace:
    """Valid hosts and origins of requests, and the path prefix, which begins and ends with a slash."""

    hosts: tuple[str, ...]
    origins: tuple[str, ...]
    base_path: str = "/"

    @property
    def sockets(self) -> tuple[str, ...]:
        """The origins with the scheme of a WebSocket."""
        return tuple(f"ws{origin.removeprefix('http')}" for origin in self.origins)


def place(listen: str, port: int, base_path: str, behind: str | None) -> PublicPlace:
    """Return the place of a page. ``base_path`` and ``behind`` must be checked."""
    if behind is not None:
        return PublicPlace((behind.partition("//")[2],), (behind,), base_path)
    hosts = listening.hosts(listen, port)
    return PublicPlace(hosts, tuple(f"http://{host}" for host in hosts), base_path)


def checked_base_path(text: str) -> str:
    """Return a prefix that ends with a slash. Raises InputError for relative, empty or dotted parts."""
    prefix = text if text.endswith("/") else f"{text}/"
    if not text or len(prefix) > _LONGEST or not _PREFIX.fullmatch(prefix):
        raise InputError(
            f"--base-path must be a path such as /user/ada/fcu/, not {shown(text)}", kind="base_path"
        )
    return prefix


def checked_behind(text: str) -> str:
    """Return an origin as browsers send it (RFC 6454, 6.2). Raises InputError unless it is an origin."""
    refusal = InputError(
        f"--behind must be the origin of the proxy, such as https://hub.example, not {shown(text)}",
        kind="behind",
    )
    if len(text) > _LONGEST or not text.isascii() or not text.isprintable() or " " in text:
        raise refusal
    try:
        parts = urlsplit(text)
        port = parts.port
    except ValueError:
        raise refusal from None
    scheme, netloc = parts.scheme, parts.netloc.lower()
    host = netloc.rpartition(":")[0] if re.search(r":\d*$", netloc) and not netloc.endswith("]") else netloc
    rest = text.partition("://")[2][len(netloc) :]
    if scheme not in _USUAL_PORTS or not _HOST.fullmatch(host) or rest not in ("", "/"):
        raise refusal
    return f"{scheme}://{host}" if port in (None, _USUAL_PORTS[scheme]) else f"{scheme}://{host}:{port}"


def given_token() -> str | None:
    """Remove the token from the environment and return it, so that compilers and browsers do not inherit it.

    Raises InputError for a token with a wrong length, or with characters other than letters, digits, "-" and "_".
    """
    token = os.environ.pop(TOKEN_VARIABLE, None)
    if token is not None and not _TOKEN.fullmatch(token):
        raise InputError(f"{TOKEN_VARIABLE} must be 32 to 100 letters, digits, '-' or '_'", kind="token")
    return token
