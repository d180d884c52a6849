"""HTTP answers: every browser gets the page's files, but only clients with the token get a socket.

Decision: the token is a subprotocol and never a cookie. Browsers send cookies to all ports of a
host, and thus to another user's server.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from hmac import compare_digest
from http import HTTPStatus
from typing import Protocol

from fcu_emulator.emulator.live.address import TOKEN_PREFIX, Address
from fcu_emulator.emulator.live.bundle import Bundle
from fcu_emulator.emulator.live.public import PublicPlace

SOCKET = "session"  # relative to the path prefix
_TEXT = "text/plain; charset=utf-8"


class Headers(Protocol):
    """Interface to a request's headers."""

    def get_all(self, key: str) -> list[str]: ...


@dataclass(frozen=True)
class Answer:
    """An HTTP response. ``because``: reason for refusing a socket."""

    status: HTTPStatus
    headers: Sequence[tuple[str, str]]
    body: bytes
    because: str = ""


class Requests:
    """Handler of requests to ``address`` at ``place``. Raises OSError if page files cannot be read."""

    def __init__(self, address: Address, place: PublicPlace) -> None:
        self._offer = f"{TOKEN_PREFIX}{address.token}".encode()
        self._place = place
        self._bundle = Bundle()  # read once, so that a request does not need a file descriptor

    def answer(self, method: str, target: str, headers: Headers, has_room: bool) -> Answer | None:
        """Return the response, or None to open a socket if the server ``has_room``."""
        hosts = headers.get_all("Host")
        if len(hosts) != 1 or hosts[0].lower() not in self._place.hosts:
            return self._refuse(HTTPStatus.FORBIDDEN, f"the host must be {self._place.hosts[0]}")
        if method != "GET":
            return self._refuse(HTTPStatus.METHOD_NOT_ALLOWED, "the method must be GET", ("Allow", "GET"))
        return self._answer_path(target.partition("?")[0], headers, has_room)

    def _answer_path(self, path: str, headers: Headers, has_room: bool) -> Answer | None:
        base = self._place.base_path
        if path and f"{path}/" == base:
            return self._refuse(HTTPStatus.PERMANENT_REDIRECT, f"the page is at {base}", ("Location", base))
        name = path[len(base) :] if path.startswith(base) else None
        if name == SOCKET:
            return self._reason_against(headers, has_room)
        file = None if name is None else self._bundle.file(f"/{name}", headers.get_all("Accept-Encoding"))
        if file is None:
            return self._refuse(HTTPStatus.NOT_FOUND, "not found")
        return self._respond(HTTPStatus.OK, file.body, file.headers)

    def failure(self) -> Answer:
        return self._refuse(HTTPStatus.INTERNAL_SERVER_ERROR, "the server cannot answer this request")

    def _reason_against(self, headers: Headers, has_room: bool) -> Answer | None:
        why = ""
        status = HTTPStatus.FORBIDDEN
        if any(origin not in self._place.origins for origin in headers.get_all("Origin")):
            why = "another page must not move this board"
        elif not self._knows_token(headers):
            why = "open the address that fcu web printed"
        elif not has_room:
            status, why = HTTPStatus.SERVICE_UNAVAILABLE, "too many pages are open"
        return self._refuse(status, why, because=why) if why else None

    def _knows_token(self, headers: Headers) -> bool:
        offered = ",".join(headers.get_all("Sec-WebSocket-Protocol")).split(",")
        given = [one.strip().encode("utf-8", "replace") for one in offered]
        return any(compare_digest(one, self._offer) for one in given)

    def _refuse(self, status: HTTPStatus, why: str, *headers: tuple[str, str], because: str = "") -> Answer:
        body = f"fcu web: {why}\n".encode()
        return self._respond(status, body, [("Content-Type", _TEXT), *headers], because)

    def _respond(
        self, status: HTTPStatus, body: bytes, headers: Sequence[tuple[str, str]], because: str = ""
    ) -> Answer:
        sockets = " ".join(self._place.sockets)
        policy = (
            "default-src 'none'; script-src 'self'; img-src 'self' data: blob:; "
            "style-src 'self' 'unsafe-inline'; "  # xterm.js inserts a style sheet into the page
            f"connect-src 'self' {sockets}; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
        )
        usual = [
            ("Content-Length", str(len(body))),
            ("Content-Security-Policy", policy),
            ("X-Content-Type-Options", "nosniff"),
            ("Referrer-Policy", "no-referrer"),
            ("Cross-Origin-Opener-Policy", "same-origin"),
            ("Cross-Origin-Resource-Policy", "same-origin"),
            ("Cache-Control", "no-store"),
            ("Connection", "close"),
        ]
        return Answer(status, [*headers, *usual], body, because)
