"""The page and its WebSocket, on 127.0.0.1 or on the address a user names, in a thread beside the session.

Who gets in: requests for this very host and port (a foreign name that leads here has another Host), with
the token of the first URL or the cookie that it sets; a socket only from a page of this origin. All else is
403. Scripts come from here alone (Content-Security-Policy). Nothing but messages of
:mod:`emulator.live.messages` goes in, and of files only firmware.

A page that is slow or asleep gets less, and never slows the board: of what changes all the time it gets the
latest, and of the terminal's text the latest 256 KiB; what is missing shows in the positions. A page that
sends too fast waits: its messages are read at most 250 times a second.

Library: ``websockets``, one package without dependencies, made and maintained by the one who wrote the
protocol's asyncio implementation of reference; it serves the few files as well. The road not taken, a web
framework, brings some fifty packages and answers a foreign Host.
"""

from __future__ import annotations

import asyncio
import errno
import threading
import time
from collections.abc import Iterable
from contextlib import suppress
from hmac import compare_digest
from http import HTTPStatus
from http.cookies import CookieError, SimpleCookie
from typing import TYPE_CHECKING, Protocol
from urllib.parse import parse_qs, urlsplit

from emulator.errors import InputError, LinkError
from emulator.live import address as addresses
from emulator.live import listening, messages
from emulator.live.bundle import Bundle
from emulator.live.messages import Command, Event

if TYPE_CHECKING:
    from websockets.asyncio.server import Server, ServerConnection
    from websockets.http11 import Request, Response

_TEXT_KEPT = 256 << 10  # characters of the terminal that wait for one page
_MOST_KEPT = 2000  # other messages that wait for it
_PER_SECOND = 250  # messages that are taken from one page
_BURST = 50
_MOST_PAGES = 32
_LATEST = {
    messages.State: "state",
    messages.Bus: "bus",
    messages.Pins: "pins",
    messages.Verdicts: "verdicts",
    messages.Findings: "findings",
    messages.Status: "status",
}


class Controls(Protocol):
    """Who carries out what pages ask for: :class:`emulator.live.session.Session` is one."""

    def post(self, client: object, command: Command) -> bool:
        """Hand over a command; False if too many wait already."""
        ...

    def attach(self, client: object) -> None:
        """Tell a new client everything."""
        ...

    def detach(self, client: object) -> None:
        """Forget a client."""
        ...


def websockets_missing() -> InputError:
    """For who has not got the library."""
    return InputError(
        'fcu web needs the package websockets; install it with: pip install "fcu-emulator[web]"'
    )


class Outbox:
    """What waits for one page; used in the server's thread only."""

    def __init__(self) -> None:
        self.filled = asyncio.Event()
        self._waiting: dict[str, str] = {}
        self._number = 0
        self._text = 0

    def put(self, key: str, message: str) -> None:
        """Let a message wait. ``key``: what it replaces; empty: nothing; "text": of the terminal."""
        if key and key != "text":
            self._waiting.pop(key, None)
        else:
            self._number += 1
            if key == "text":
                self._text += len(message)
            key = f"{key}#{self._number}"
        self._waiting[key] = message
        while self._text > _TEXT_KEPT:
            self._drop("text#")
        if len(self._waiting) > _MOST_KEPT:
            self._drop("")
        self.filled.set()

    def take(self) -> str | None:
        """The message that has waited longest; None if there is none."""
        for key in self._waiting:
            return self._remove(key)
        self.filled.clear()
        return None

    def _drop(self, begin: str) -> None:
        self._remove(next(key for key in self._waiting if key.startswith(begin) and "#" in key))

    def _remove(self, key: str) -> str:
        message = self._waiting.pop(key)
        if key.startswith("text#"):
            self._text -= len(message)
        return message


class PageServer:
    """Serves the page and its sockets until :meth:`close`.

    ``port`` 0: any free one. ``listen``: the address of this machine to listen on. Raises InputError where
    the library is missing or ``listen`` is not an address, LinkError for an address or a port that cannot be
    had. ``controls`` may be given later, before the first page comes.
    """

    def __init__(self, port: int = 0, listen: str = listening.LOCAL) -> None:
        try:
            import websockets.asyncio.server  # noqa: F401 whether it is there
        except ImportError as error:
            raise websockets_missing() from error
        self.controls: Controls | None = None
        self._listen_on = listening.checked(listen)
        self._bundle = Bundle()
        self._fixed = port != 0
        self._outboxes: dict[object, Outbox] = {}
        self._ready = threading.Event()
        self._problems: list[OSError] = []
        self._loop = asyncio.new_event_loop()
        self._thread = threading.Thread(target=self._serve, args=(port,), name="fcu web", daemon=True)
        self._thread.start()
        self._ready.wait()
        for problem in self._problems:
            self._thread.join()
            raise self._unusable(port, problem) from problem

    def _unusable(self, port: int, problem: OSError) -> LinkError:
        reason = problem.strerror or problem
        if problem.errno == errno.EADDRNOTAVAIL:
            return LinkError(f"cannot listen on {self._listen_on}: it is not an address of this machine")
        return LinkError(f"--port {port}: {reason}; give another one, or 0 for any")

    @property
    def url(self) -> str:
        """The first URL, with the token."""
        return self.address.page

    def publish(self, event: Event, client: object | None = None) -> None:
        """Send an event to one page, or to all; from any thread, without waiting."""
        if not self._outboxes:
            return
        key = _LATEST.get(type(event), "")
        if isinstance(event, messages.Registers):
            key = f"registers {event.part}"
        elif isinstance(event, messages.Text):
            key = "text"
        with suppress(RuntimeError):  # the loop has ended
            self._loop.call_soon_threadsafe(self._put, key, messages.encode(event), client)

    def close(self) -> None:
        """End all connections and the thread; a second call does nothing."""
        if self._thread.is_alive():
            self._loop.call_soon_threadsafe(self._stop.set)
            self._thread.join()
        if not self._fixed:
            addresses.withdraw(self.address)

    # -- in the server's thread -------------------------------------------------------------------------

    def _serve(self, port: int) -> None:
        asyncio.set_event_loop(self._loop)
        try:
            self._loop.run_until_complete(self._run(port))
        except OSError as error:
            self._problems.append(error)
        finally:
            self._ready.set()
            self._loop.close()

    async def _run(self, port: int) -> None:
        from websockets.asyncio.server import serve

        self._stop = asyncio.Event()
        server = await serve(
            self._talk,
            self._listen_on,
            port,
            process_request=self._answer,
            compression=None,
            max_size=messages.LONGEST_UPLOAD,
            server_header=None,
            close_timeout=0.5,
        )
        async with server:
            self._begin(server)
            await self._stop.wait()

    def _begin(self, server: Server) -> None:
        port = next(iter(server.sockets)).getsockname()[1]
        host = listening.host(self._listen_on)
        self.address = addresses.address_for(port, host) if self._fixed else addresses.fresh(port, host)
        addresses.publish(self.address)
        self._hosts = listening.hosts(self._listen_on, port)
        self._origins = tuple(f"http://{host}" for host in self._hosts)
        self._cookie = f"fcu-{port}"
        self._ready.set()

    def _put(self, key: str, message: str, client: object | None) -> None:
        if client is not None:
            outbox = self._outboxes.get(client)
            if outbox is not None:
                outbox.put(key, message)
            return
        for outbox in self._outboxes.values():
            outbox.put(key, message)

    # -- HTTP -------------------------------------------------------------------------------------------

    def _answer(self, connection: ServerConnection, request: Request) -> Response | None:
        """The answer to a request; None: go on to the socket."""
        del connection
        url = urlsplit(request.path)
        by_url = self._is_token(parse_qs(url.query).get("token", [""])[0])
        refused = self._reason_against(request, url.path, by_url)
        if refused:
            return self._refuse(refused)
        if url.path == "/session":
            return None
        if url.path == "/" and by_url:
            cookie = f"{self._cookie}={self.address.token}; HttpOnly; SameSite=Strict; Path=/"
            return self._respond(HTTPStatus.SEE_OTHER, b"", [("Location", "/"), ("Set-Cookie", cookie)])
        file = self._bundle.file(url.path, request.headers.get_all("Accept-Encoding"))
        if file is not None:
            return self._respond(HTTPStatus.OK, file.body, file.headers)
        return self._respond(HTTPStatus.NOT_FOUND, b"not found\n", [("Content-Type", "text/plain")])

    def _reason_against(self, request: Request, path: str, by_url: bool) -> str:
        """Why a request is refused; empty if it is not."""
        hosts, origins = request.headers.get_all("Host"), request.headers.get_all("Origin")
        if len(hosts) != 1 or hosts[0] not in self._hosts:
            return f"this server answers {self._listen_on} only"
        if not by_url and not self._has_cookie(request):
            return "open the address that fcu web has printed"
        if path != "/session":
            return ""
        if any(origin not in self._origins for origin in origins) or (not origins and not by_url):
            return "another page may not move this board"
        return "too many pages are open" if len(self._outboxes) >= _MOST_PAGES else ""

    def _is_token(self, token: str) -> bool:
        return compare_digest(token.encode("utf-8", "replace"), self.address.token.encode())

    def _has_cookie(self, request: Request) -> bool:
        for header in request.headers.get_all("Cookie"):
            with suppress(CookieError):
                morsel = SimpleCookie(header).get(self._cookie)
                if morsel is not None and self._is_token(morsel.value):
                    return True
        return False

    def _refuse(self, why: str) -> Response:
        kind = [("Content-Type", "text/plain; charset=utf-8")]
        return self._respond(HTTPStatus.FORBIDDEN, f"fcu web: {why}\n".encode(), kind)

    def _respond(self, status: HTTPStatus, body: bytes, headers: Iterable[tuple[str, str]]) -> Response:
        from websockets.datastructures import Headers
        from websockets.http11 import Response

        sockets = " ".join(f"ws://{host}" for host in self._hosts)
        policy = (
            "default-src 'none'; script-src 'self'; img-src 'self' data: blob:; "
            "style-src 'self' 'unsafe-inline'; "  # xterm.js writes a style sheet of its own
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
        return Response(status.value, status.phrase, Headers([*headers, *usual]), body)

    # -- sockets ----------------------------------------------------------------------------------------

    async def _talk(self, connection: ServerConnection) -> None:
        controls = self.controls
        if controls is None:
            return
        client, outbox = object(), Outbox()
        self._outboxes[client] = outbox
        controls.attach(client)
        sender = asyncio.create_task(_send(connection, outbox))
        try:
            await self._listen(connection, client, outbox, controls)
        finally:
            sender.cancel()
            del self._outboxes[client]
            controls.detach(client)

    async def _listen(
        self, connection: ServerConnection, client: object, outbox: Outbox, controls: Controls
    ) -> None:
        from websockets.exceptions import ConnectionClosed

        allowance, before_s = float(_BURST), time.monotonic()
        with suppress(ConnectionClosed):
            async for message in connection:
                try:
                    if isinstance(message, bytes):
                        raise messages.MessageError("messages are text")
                    if not controls.post(client, messages.decode(message)):
                        raise messages.MessageError("too many messages wait; this one was dropped")
                except messages.MessageError as error:
                    outbox.put("refused", messages.encode(messages.Notice("error", str(error))))
                now_s = time.monotonic()
                allowance = min(allowance + (now_s - before_s) * _PER_SECOND, _BURST) - 1
                before_s = now_s
                if allowance < 0:
                    await asyncio.sleep(1 / _PER_SECOND)


async def _send(connection: ServerConnection, outbox: Outbox) -> None:
    from websockets.exceptions import ConnectionClosed

    with suppress(ConnectionClosed):
        while True:
            await outbox.filled.wait()
            message = outbox.take()
            if message is not None:
                await connection.send(message)
