"""The page's server: admission of clients, validation of messages, and independence of the board from pages."""

from __future__ import annotations

import json
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from http.client import HTTPConnection, HTTPResponse
from typing import Any
from urllib.parse import urlsplit

import pytest
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import ClientConnection, connect

from fcu_emulator.emulator.errors import InputError, LinkError
from fcu_emulator.emulator.live import address, messages, outbox
from fcu_emulator.emulator.live.outbox import Outbox
from fcu_emulator.emulator.live.server import PageServer
from fcu_emulator.emulator.live.session import LiveSession
from fcu_emulator.emulator.live.setup import Setup
from tests.campaigns.live_fuzz import fuzzed
from tests.support.live_fakes import connected


@contextmanager
def running(setup: Setup, port: int = 0) -> Iterator[tuple[PageServer, LiveSession]]:
    """Run a served session in a thread, in which the board is also created."""
    pages = PageServer(port)
    made: list[LiveSession] = []
    ready = threading.Event()

    def live() -> None:
        session = LiveSession(setup, pages.publish)
        pages.controls = session
        made.append(session)
        ready.set()
        session.run()

    thread = threading.Thread(target=live)
    thread.start()
    assert ready.wait(30)
    try:
        yield pages, made[0]
    finally:
        made[0].stop()
        thread.join()
        pages.close()


@pytest.fixture(scope="module")
def live() -> Iterator[tuple[PageServer, LiveSession]]:
    with running(Setup("solution", ideal=True)) as served:
        yield served


def get(pages: PageServer, path: str, **headers: str) -> HTTPResponse:
    connection = HTTPConnection("127.0.0.1", pages.address.port, timeout=30)
    connection.request(
        "GET", path, headers={name.replace("_", "-"): value for name, value in headers.items()}
    )
    return connection.getresponse()


def until(client: ClientConnection, kind: str, **wanted: Any) -> dict[str, Any]:
    """Return the next event of a type whose fields have these values."""
    for _ in range(5000):
        event: dict[str, Any] = json.loads(client.recv(timeout=30))
        if event["type"] == kind and all(event[name] == value for name, value in wanted.items()):
            return event
    raise AssertionError(f"no {kind} with {wanted}")


def say(client: ClientConnection, **command: Any) -> None:
    client.send(json.dumps(command))


def test_page_files_need_no_secret_or_cookie(live: tuple[PageServer, LiveSession]) -> None:
    pages, _ = live
    for path in ("/", "/?2d", "/app.js", "/app.css", "/icon.svg"):
        response = get(pages, path)
        assert response.status == 200
        policy = str(response.getheader("Content-Security-Policy"))
        assert "script-src 'self';" in policy
        assert "default-src 'none'" in policy
        assert response.getheader("X-Content-Type-Options") == "nosniff"
        assert response.getheader("Set-Cookie") is None
        body = response.read()
        assert len(body) == int(str(response.getheader("Content-Length")))
        assert pages.address.token.encode() not in body
    assert get(pages, "/../server.py").status == 404


def test_printed_address_hides_its_token_from_servers(live: tuple[PageServer, LiveSession]) -> None:
    pages, _ = live
    parts = urlsplit(pages.url)
    assert (parts.path, parts.query, parts.fragment) == ("/", "", f"token={pages.address.token}")


@pytest.mark.parametrize("host", ["evil.example", "evil.example:{port}", "127.0.0.1", "127.0.0.1:1", ""])
@pytest.mark.parametrize("path", ["/", "/session"])
def test_foreign_host_is_refused(live: tuple[PageServer, LiveSession], host: str, path: str) -> None:
    pages, _ = live
    assert get(pages, path, Host=host.format(port=pages.address.port)).status == 403


@pytest.mark.parametrize(
    "protocols",
    [
        [],
        ["fcu"],
        ["fcu", "fcu.token."],
        ["fcu", "fcu.token.wrong"],
        ["fcu", "fcu.token.{token}x"],
        ["fcu", "{token}"],
        ["{token}", "fcu.token."],
    ],
)
@pytest.mark.parametrize("by_page", [True, False])
def test_socket_without_token_is_never_opened(
    live: tuple[PageServer, LiveSession], protocols: list[str], by_page: bool
) -> None:
    pages, session = live
    before = len(session._clients)
    offered = [one.format(token=pages.address.token) for one in protocols]
    origin = f"http://127.0.0.1:{pages.address.port}" if by_page else None
    cookie = {"Cookie": f"fcu-{pages.address.port}={pages.address.token}"}
    url = f"{pages.address.socket}?token={pages.address.token}"
    with (
        pytest.raises(InvalidStatus) as refused,
        connect(
            url,
            subprotocols=offered or None,  # type: ignore[arg-type]
            origin=origin,  # type: ignore[arg-type]
            additional_headers=cookie,
        ),
    ):
        pass
    assert refused.value.response.status_code == 403
    assert len(session._clients) == before


def test_page_with_token_gets_board(live: tuple[PageServer, LiveSession]) -> None:
    pages, _ = live
    with connected(pages.address, origin=f"http://127.0.0.1:{pages.address.port}") as client:
        assert client.subprotocol == "fcu"
        assert until(client, "hello")


@pytest.mark.parametrize("origin", ["http://evil.example", "null", "https://127.0.0.1", "http://127.0.0.1:1"])
def test_page_of_another_origin_gets_no_socket(live: tuple[PageServer, LiveSession], origin: str) -> None:
    pages, _ = live
    with pytest.raises(InvalidStatus) as refused, connected(pages.address, origin=origin):
        pass
    assert refused.value.response.status_code == 403


def test_client_moves_board_and_receives_new_state(live: tuple[PageServer, LiveSession]) -> None:
    pages, _ = live
    with connected(pages.address) as client:
        hello = until(client, "hello")
        assert set(hello["parts"]) == {"LSM6DSL", "LIS2MDL", "LPS22HB"}
        assert until(client, "status")["state"] == "running"
        say(client, type="do", entry={"do": "set_attitude", "pitch_deg": 85}, id=7)
        assert until(client, "state", done=7)["truth"]["pitch_deg"] == 85
        assert until(client, "state", leds={"LED1": True, "LED2": False})
        say(client, type="do", entry={"do": "set_attitude"}, id=8)
        assert until(client, "state", leds={"LED1": False, "LED2": False})


def test_two_clients_share_board(live: tuple[PageServer, LiveSession]) -> None:
    pages, _ = live
    with connected(pages.address) as one:
        with connected(pages.address) as other:
            say(other, type="pause")
            assert until(one, "status", state="paused")
            assert until(other, "status", state="paused")
        say(one, type="run")
        assert until(one, "status", state="running")


def test_fuzzed_messages_never_stop_board(live: tuple[PageServer, LiveSession]) -> None:
    pages, session = live
    with connected(pages.address) as client:
        for message in fuzzed(seed=5, count=150):
            client.send(message)
        say(client, type="record")
        until(client, "recorded")  # all before has been taken
    with connected(pages.address) as client:
        say(client, type="firmware", name="solution")
        say(client, type="run")
        say(client, type="speed", factor=1)
        until(client, "status", state="running", speed=1)
        times = {until(client, "state")["t_s"] for _ in range(20)}
    assert len(times) > 1
    assert not session.stopped


def test_huge_message_ends_only_its_connection(live: tuple[PageServer, LiveSession]) -> None:
    pages, _ = live
    with connected(pages.address) as client, suppress(ConnectionClosed):
        client.send("x" * (messages.LONGEST_UPLOAD + 1))
        for _ in client:
            pass
    assert client.close_code == 1009
    with connected(pages.address) as other:
        assert until(other, "state")


def test_backlog_of_stalled_page_is_limited() -> None:
    kept = Outbox()
    for number in range(10_000):
        kept.put("state", f"s{number}")
        kept.put("text", "x" * 100)
    for number in range(5_000):
        kept.put("", f"n{number}")
    taken = []
    while (message := kept.take()) is not None:
        taken.append(message)
    assert sum(len(one) for one in taken if one.startswith("x")) <= outbox.TEXT_KEPT
    assert [one for one in taken if one.startswith("s")] in ([], ["s9999"])
    assert taken[-1] == "n4999"
    assert len(taken) <= outbox.MOST_KEPT


def test_restarted_server_accepts_open_page() -> None:
    with running(Setup(None)) as (pages, _):
        port = pages.address.port
    with running(Setup(None), port) as (pages, _):
        token = pages.address.token
        with pytest.raises(LinkError, match=f"--port {port}"):
            PageServer(port)
    with running(Setup(None), port) as (pages, _):
        assert pages.address.token == token
        assert pages.address == address.address_for(port)
    address.withdraw(pages.address)


def test_error_for_missing_websockets_shows_install_command(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(__import__("sys").modules, "websockets.asyncio.server", None)
    with pytest.raises(InputError, match="websockets") as refused:
        PageServer()
    assert refused.value.kind == "not_installed"
