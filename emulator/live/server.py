"""Server of the page and its WebSocket, on 127.0.0.1 or the user's address, possibly behind a proxy.

The server runs in a separate thread. A slow page receives fewer messages and never slows the board. If a
page sends too fast, it must wait.
"""

from __future__ import annotations

import asyncio
import errno
import logging
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Protocol

from fcu_emulator.emulator.errors import InputError, LinkError
from fcu_emulator.emulator.host.cleanup import before_exit, done
from fcu_emulator.emulator.links.limited_lines import LimitedLines
from fcu_emulator.emulator.live import address as addresses
from fcu_emulator.emulator.live import listening, messages, public
from fcu_emulator.emulator.live.messages import PageCommand, SessionEvent
from fcu_emulator.emulator.live.outbox import Outbox
from fcu_emulator.emulator.live.requests import Answer, Requests

if TYPE_CHECKING:
    from websockets.asyncio.server import Server, ServerConnection
    from websockets.http11 import Request, Response

_REQUEST_S = 5.0  # maximum wall time for receiving a complete request
_MOST_CALLERS = 64  # connections without a socket; a browser opens six for a page
_MESSAGES_AHEAD = 4  # messages of one page that are read ahead; each message may be an upload
_PER_SECOND = 250  # messages per second from one page
_BURST = 50
_MOST_PAGES = 32
_LATEST = {
    messages.State: "state",
    messages.BusEvent: "bus",
    messages.Pins: "pins",
    messages.Verdicts: "verdicts",
    messages.Findings: "findings",
    messages.StatusEvent: "status",
}


class Controls(Protocol):
    """Receiver of commands, :class:`fcu_emulator.emulator.live.session.LiveSession`."""

    def post(self, client: object, command: PageCommand) -> bool:
        """Queue a command. Return False if the queue is full."""
        ...

    def attach(self, client: object) -> None: ...

    def detach(self, client: object) -> None: ...


def websockets_missing() -> InputError:
    """Return the error for a missing websockets library."""
    return InputError(
        "fcu web needs the package websockets; install it with: pip install websockets", kind="not_installed"
    )


class PageServer:
    """Server of the page and its sockets. Set ``controls`` before the first page connects.

    If ``port`` is 0, any free port is used. ``say(line)`` receives failures. ``base_path`` and ``behind`` are the path
    prefix and the origin behind a proxy. If ``token`` is None, the server makes a token. Raises InputError for a
    missing library or an invalid ``listen``, ``base_path`` or ``behind``, and LinkError for an unavailable address or
    port.
    """

    def __init__(
        self,
        port: int = 0,
        say: Callable[[str], None] = lambda _line: None,
        listen: str = listening.LOCAL,
        *,
        base_path: str = "/",
        behind: str | None = None,
        token: str | None = None,
    ) -> None:
        try:
            import websockets.asyncio.server  # noqa: F401 is it installed?
        except ImportError as error:
            raise websockets_missing() from error
        self.controls: Controls | None = None
        self._listen_on = listening.checked(listen)
        self._base_path = public.checked_base_path(base_path)
        self._behind = None if behind is None else public.checked_behind(behind)
        self._given_token = token
        self._fixed = port != 0 and token is None  # with a stored token
        self._say = LimitedLines(say)
        self._outboxes: dict[object, Outbox] = {}
        self._callers: dict[ServerConnection, None] = {}
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
        return LinkError(f"--port {port}: {reason}; give another port, or 0 for any free port")

    @property
    def url(self) -> str:
        return self.address.page

    def publish(self, event: SessionEvent, client: object | None = None) -> None:
        """Send an event to one or all pages. This thread-safe call does not wait."""
        if not self._outboxes:
            return
        key = _LATEST.get(type(event), "")
        if isinstance(event, messages.RegistersEvent):
            key = f"registers {event.part}"
        elif isinstance(event, messages.Text):
            key = "text"
        with suppress(RuntimeError):  # the loop has ended
            self._loop.call_soon_threadsafe(self._put, key, messages.encode(event), client)

    def close(self) -> None:
        if self._thread.is_alive():
            self._loop.call_soon_threadsafe(self._stop.set)
            self._thread.join()
        if not self._fixed and self._given_token is None:
            self._withdraw_address()
            done(self._withdraw_address)

    def _withdraw_address(self) -> None:
        addresses.withdraw(self.address)

    # -- in the server's thread -------------------------------------------------------------------------

    def _serve(self, port: int) -> None:
        try:
            with asyncio.Runner(loop_factory=lambda: self._loop) as runner:  # also ends tasks of late clients
                runner.run(self._run(port))
        except OSError as error:
            self._problems.append(error)
        finally:
            self._ready.set()

    async def _run(self, port: int) -> None:
        from websockets.asyncio.server import serve

        self._stop = asyncio.Event()
        self._loop.set_exception_handler(self._handle_failure)
        server = await serve(
            self._talk,
            self._listen_on,
            port,
            process_request=self._answer,
            subprotocols=[addresses.PROTOCOL],  # type: ignore[list-item]  # a str for older versions
            compression=None,
            max_size=messages.LONGEST_UPLOAD,
            max_queue=_MESSAGES_AHEAD,
            server_header=None,
            open_timeout=_REQUEST_S,
            close_timeout=0.5,
            logger=_logger(self._say),
            create_connection=_counted(self._callers),
        )
        async with server:
            self._begin(server)
            await self._stop.wait()
            for caller in list(
                self._callers
            ):  # otherwise closing could wait for each unfinished request until its time limit
                caller.transport.abort()

    def _begin(self, server: Server) -> None:
        port = next(iter(server.sockets)).getsockname()[1]
        host = listening.host(self._listen_on)
        at = addresses.address_for(port, host) if self._fixed else addresses.fresh(port, host)
        self.address = replace(
            at,
            token=self._given_token or at.token,
            base_path=self._base_path,
            behind=self._behind or "",
        )
        if self._given_token is None:
            if not self._fixed:
                before_exit(self._withdraw_address)
            addresses.publish(self.address)
        place = public.place(self._listen_on, port, self._base_path, self._behind)
        self._requests = Requests(self.address, place)
        self._ready.set()

    def _handle_failure(self, loop: asyncio.AbstractEventLoop, context: dict[str, Any]) -> None:
        del loop
        self._say(f"page: {_failure(str(context.get('message')), context.get('exception'))}")

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
        del connection
        try:
            method = getattr(request, "method", "GET")  # older versions of the library refuse other methods
            has_room = len(self._outboxes) < _MOST_PAGES
            answer = self._requests.answer(method, request.path, request.headers, has_room)
        except Exception as error:
            self._say(f"page: {_failure('a request failed', error)}")
            answer = self._requests.failure()
        if answer is not None and answer.because:
            self._say(f"page: a socket was refused: {answer.because}")
        return None if answer is None else _response(answer)

    # -- sockets ----------------------------------------------------------------------------------------

    async def _talk(self, connection: ServerConnection) -> None:
        controls = self.controls
        if controls is None:
            return
        self._callers.pop(connection, None)
        client, outbox = object(), Outbox()
        self._outboxes[client] = outbox
        sender = asyncio.create_task(_send(connection, outbox))
        try:
            controls.attach(client)
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
                        raise messages.MessageError("messages must be text")
                    if not controls.post(client, messages.decode(message)):
                        raise messages.MessageError("this message was dropped: too many wait")
                except Exception as error:
                    outbox.put("refused", messages.encode(messages.failure(error)))
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


def _response(answer: Answer) -> Response:
    from websockets.datastructures import Headers
    from websockets.http11 import Response

    return Response(answer.status.value, answer.status.phrase, Headers(answer.headers), answer.body)


def _counted(callers: dict[ServerConnection, None]) -> type[ServerConnection]:
    """Return a connection class. Instances without a socket are in ``callers``."""
    from websockets.asyncio.server import ServerConnection

    class Connection(ServerConnection):
        def connection_made(self, transport: asyncio.BaseTransport) -> None:
            super().connection_made(transport)
            callers[self] = None
            if len(callers) > _MOST_CALLERS:
                oldest = next(iter(callers))
                del callers[oldest]
                oldest.transport.abort()

        def connection_lost(self, exc: Exception | None) -> None:
            callers.pop(self, None)
            super().connection_lost(exc)

    return Connection


class _OneLine(logging.Handler):
    """Handler that reports log records on one line, without traceback."""

    def __init__(self, say: Callable[[str], None]) -> None:
        super().__init__(logging.WARNING)
        self._hear = say

    def emit(self, record: logging.LogRecord) -> None:
        error = record.exc_info[1] if record.exc_info else None
        self._hear(f"page: {_failure(record.getMessage(), error)}")


def _logger(say: Callable[[str], None]) -> logging.Logger:
    logger = logging.Logger("fcu web", logging.WARNING)
    logger.addHandler(_OneLine(say))
    return logger


def _failure(what: str, error: object) -> str:
    return f"{what}: {type(error).__name__}: {error}" if isinstance(error, BaseException) else what
