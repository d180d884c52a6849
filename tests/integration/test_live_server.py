"""The page's server: who gets in, what goes in, and that no page slows or stops the board."""

from __future__ import annotations

import json
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from http.client import HTTPConnection, HTTPResponse
from typing import Any

import pytest
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import ClientConnection, connect

from emulator.errors import InputError, LinkError
from emulator.live import address, messages, server
from emulator.live.server import Outbox, PageServer
from emulator.live.session import Session
from emulator.live.setup import Setup
from tests.live_fuzz import fuzzed


@contextmanager
def running(setup: Setup, port: int = 0) -> Iterator[tuple[PageServer, Session]]:
    """A served session, in a thread of its own: the board is built where it runs."""
    pages = PageServer(port)
    made: list[Session] = []
    ready = threading.Event()

    def live() -> None:
        session = Session(setup, pages.publish)
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
def live() -> Iterator[tuple[PageServer, Session]]:
    with running(Setup("solution", ideal=True)) as served:
        yield served


def get(pages: PageServer, path: str, **headers: str) -> HTTPResponse:
    connection = HTTPConnection("127.0.0.1", pages.address.port, timeout=30)
    connection.request(
        "GET", path, headers={name.replace("_", "-"): value for name, value in headers.items()}
    )
    return connection.getresponse()


def until(client: ClientConnection, kind: str, **wanted: Any) -> dict[str, Any]:
    """The next event of a type whose fields are as wanted."""
    for _ in range(5000):
        event: dict[str, Any] = json.loads(client.recv(timeout=30))
        if event["type"] == kind and all(event[name] == value for name, value in wanted.items()):
            return event
    raise AssertionError(f"no {kind} with {wanted}")


def say(client: ClientConnection, **command: Any) -> None:
    client.send(json.dumps(command))


def test_the_first_url_sets_a_cookie_and_with_it_the_page_comes(live: tuple[PageServer, Session]) -> None:
    pages, _ = live
    first = get(pages, f"/?token={pages.address.token}")
    cookie = str(first.getheader("Set-Cookie"))
    assert (first.status, first.getheader("Location")) == (303, "/")
    assert {"HttpOnly", "SameSite=Strict"} <= {part.strip() for part in cookie.split(";")}
    for path in ("/", "/app.js", "/app.css", "/icon.svg"):
        response = get(pages, path, Cookie=cookie.split(";", maxsplit=1)[0])
        assert response.status == 200
        policy = str(response.getheader("Content-Security-Policy"))
        assert "script-src 'self';" in policy
        assert "default-src 'none'" in policy
        assert len(response.read()) == int(str(response.getheader("Content-Length")))
    assert get(pages, "/../server.py", Cookie=cookie.split(";", maxsplit=1)[0]).status == 404


@pytest.mark.parametrize(
    "headers",
    [
        {"Host": "evil.example"},
        {"Host": "evil.example:80"},
        {"Host": "127.0.0.1"},
        {"Cookie": "fcu=1"},
        {"Cookie": "fcu-{port}=wrong"},
        {},
    ],
)
def test_others_are_refused(live: tuple[PageServer, Session], headers: dict[str, str]) -> None:
    pages, _ = live
    token = f"/?token={pages.address.token}" if "Host" in headers else "/?token=wrong"
    sent = {name: value.format(port=pages.address.port) for name, value in headers.items()}
    assert get(pages, token, **sent).status == 403


@pytest.mark.parametrize("origin", ["http://evil.example", "null", "https://127.0.0.1", "http://127.0.0.1:1"])
def test_a_page_of_another_origin_gets_no_socket(live: tuple[PageServer, Session], origin: str) -> None:
    pages, _ = live
    with pytest.raises(InvalidStatus) as refused, connect(pages.address.socket, origin=origin):  # type: ignore[arg-type]
        pass
    assert refused.value.response.status_code == 403


def test_the_servers_own_page_gets_a_socket_by_its_cookie_and_origin(
    live: tuple[PageServer, Session],
) -> None:
    pages, _ = live
    url = pages.address.socket.partition("?")[0]
    cookie = f"fcu-{pages.address.port}={pages.address.token}"
    own = f"http://127.0.0.1:{pages.address.port}"
    with connect(url, origin=own, additional_headers={"Cookie": cookie}) as client:  # type: ignore[arg-type]
        until(client, "hello")
    for headers in ({"Cookie": cookie}, {"Origin": own}, {"Cookie": cookie, "Origin": "http://evil.example"}):
        with pytest.raises(InvalidStatus) as refused, connect(url, additional_headers=headers):
            pass
        assert refused.value.response.status_code == 403


def test_a_client_moves_the_board_and_sees_it(live: tuple[PageServer, Session]) -> None:
    pages, _ = live
    with connect(pages.address.socket) as client:
        hello = until(client, "hello")
        assert set(hello["parts"]) == {"LSM6DSL", "LIS2MDL", "LPS22HB"}
        assert until(client, "status")["state"] == "running"
        say(client, type="do", entry={"do": "set_attitude", "pitch_deg": 85}, id=7)
        assert until(client, "state", done=7)["truth"]["pitch_deg"] == 85
        assert until(client, "state", leds={"LED1": True, "LED2": False})
        say(client, type="do", entry={"do": "set_attitude"}, id=8)
        assert until(client, "state", leds={"LED1": False, "LED2": False})


def test_two_clients_see_the_same_board_and_one_may_leave(live: tuple[PageServer, Session]) -> None:
    pages, _ = live
    with connect(pages.address.socket) as one:
        with connect(pages.address.socket) as other:
            say(other, type="pause")
            assert until(one, "status", state="paused")
            assert until(other, "status", state="paused")
        say(one, type="run")
        assert until(one, "status", state="running")


def test_fuzzed_messages_never_stop_the_board(live: tuple[PageServer, Session]) -> None:
    pages, session = live
    with connect(pages.address.socket) as client:
        for message in fuzzed(seed=5, count=150):
            client.send(message)
        say(client, type="record")
        until(client, "recorded")  # all before has been taken
    with connect(pages.address.socket) as client:
        say(client, type="firmware", name="solution")
        say(client, type="run")
        say(client, type="speed", factor=1)
        until(client, "status", state="running", speed=1)
        times = {until(client, "state")["t_s"] for _ in range(20)}
    assert len(times) > 1
    assert not session.stopped


def test_a_huge_message_ends_its_connection_only(live: tuple[PageServer, Session]) -> None:
    pages, _ = live
    with connect(pages.address.socket) as client, suppress(ConnectionClosed):
        client.send("x" * (messages.LONGEST_UPLOAD + 1))
        for _ in client:
            pass
    assert client.close_code == 1009
    with connect(pages.address.socket) as other:
        assert until(other, "state")


def test_a_page_that_takes_nothing_is_kept_short() -> None:
    outbox = Outbox()
    for number in range(10_000):
        outbox.put("state", f"s{number}")
        outbox.put("text", "x" * 100)
    for number in range(5_000):
        outbox.put("", f"n{number}")
    taken = []
    while (message := outbox.take()) is not None:
        taken.append(message)
    assert sum(len(one) for one in taken if one.startswith("x")) <= server._TEXT_KEPT
    assert [one for one in taken if one.startswith("s")] in ([], ["s9999"])
    assert taken[-1] == "n4999"
    assert len(taken) <= server._MOST_KEPT


def test_a_server_started_again_on_its_port_lets_the_open_page_in_again() -> None:
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


def test_without_the_library_a_line_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(__import__("sys").modules, "websockets.asyncio.server", None)
    with pytest.raises(InputError, match=r'pip install "fcu-emulator\[web\]"'):
        PageServer()
