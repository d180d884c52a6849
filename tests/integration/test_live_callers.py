"""Clients of the page's port that are not a page get an answer or are disconnected, with few lines on the terminal."""

from __future__ import annotations

import socket
import threading
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path

import pytest
from websockets.exceptions import ConnectionClosed

from fcu_emulator.emulator.host.loopback import HOST
from fcu_emulator.emulator.links.limited_lines import BURST
from fcu_emulator.emulator.live import messages, server
from fcu_emulator.emulator.live.requests import Requests
from fcu_emulator.emulator.live.server import PageServer
from tests.support.live_fakes import connected

PATIENCE_S = 30
UPGRADE = (
    b"Upgrade: websocket\r\nConnection: upgrade\r\nSec-WebSocket-Version: 13\r\n"
    b"Sec-WebSocket-Protocol: fcu, {token}\r\n"
)


class IdleSession:
    """A session that does nothing except count its pages."""

    def __init__(self) -> None:
        self.pages = 0
        self.came = threading.Event()

    def post(self, client: object, command: messages.PageCommand) -> bool:
        """Accept all commands."""
        return True

    def attach(self, client: object) -> None:
        """Count a new page."""
        self.pages += 1
        self.came.set()

    def detach(self, client: object) -> None:
        """Count a page that has left."""


@pytest.fixture
def said() -> list[str]:
    return []


@pytest.fixture
def pages(
    said: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> Iterator[PageServer]:
    """Yield a server. At the end, check that it has logged few short lines, and has printed nothing else."""
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    monkeypatch.setenv("LOCALAPPDATA", str(tmp_path))
    one = PageServer(0, said.append)
    one.controls = IdleSession()
    yield one
    one.close()
    assert capsys.readouterr() == ("", "")
    assert all(line.isprintable() and len(line) < 300 for line in said)
    assert len(said) <= BURST


def answer(pages: PageServer, request: bytes, *, whole: bool = True) -> bytes:
    """Return the beginning of the answer, or b"" if the server disconnects without an answer."""
    with socket.create_connection((HOST, pages.address.port), PATIENCE_S) as client:
        got = b""
        try:
            client.sendall(request)
            if not whole:
                client.shutdown(socket.SHUT_WR)
            while data := client.recv(1 << 16):
                got += data
        except (BrokenPipeError, ConnectionResetError):
            pass
    return got


def status(pages: PageServer, request: bytes) -> int:
    return int(answer(pages, request).split(b" ")[1])


def host(pages: PageServer) -> bytes:
    return f"Host: {HOST}:{pages.address.port}\r\n".encode()


@pytest.mark.parametrize(
    "target", [b"//[x", b"http://[", b"/\x1b[2J", b"*", b"/%00", b"//", b"/" * 8000, b"?", b"#"]
)
def test_unusual_target_gets_404_or_403_without_host(
    pages: PageServer, said: list[str], target: bytes
) -> None:
    assert status(pages, b"GET " + target + b" HTTP/1.1\r\n" + host(pages) + b"\r\n") == 404
    assert status(pages, b"GET " + target + b" HTTP/1.1\r\n\r\n") == 403
    assert said == []


@pytest.mark.parametrize(
    ("first", "headers", "expected"),
    [
        (b"POST / HTTP/1.1", b"", 405),
        (b"HEAD / HTTP/1.1", b"", 405),
        (b"G\x1bT / HTTP/1.1", b"", 405),
        (b"GET /" + b"a" * 9000 + b" HTTP/1.1", b"", 414),
        (b"GET / HTTP/1.1", b"A: " + b"x" * 9000 + b"\r\n", 431),
        (b"GET / HTTP/1.1", b"A: b\r\n" * 1000, 431),
        (b"GET / HTTP/1.1", b"Host: evil.example\r\n", 403),
        (b"GET / HTTP/1.1", b"A: \xff\xe4\r\n", 200),
        (b"GET /session HTTP/1.1", b"Upgrade: websocket\r\nConnection: upgrade\r\n", 403),
        (b"GET /session HTTP/1.1", b"Sec-WebSocket-Protocol: \xff, fcu.token.\xff\r\n", 403),
        (b"GET /session HTTP/1.1", b"Sec-WebSocket-Protocol: {token}\r\n", 426),
        (
            b"GET /session HTTP/1.1",
            UPGRADE + b"Sec-WebSocket-Key: x\r\n",
            400,
        ),
        (
            b"GET /session HTTP/1.1",
            UPGRADE + b"Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\nOrigin: http://evil.example\r\n",
            403,
        ),
    ],
)
def test_wrong_request_gets_matching_http_status(
    pages: PageServer, first: bytes, headers: bytes, expected: int
) -> None:
    headers = headers.replace(b"{token}", pages.address.protocols[1].encode())
    assert status(pages, first + b"\r\n" + host(pages) + headers + b"\r\n") == expected


@pytest.mark.parametrize(
    "data",
    [
        b"\x16\x03\x01\x02\x00\x01\x00\x01\xfc\x03\x03" + bytes(500) + b"\n",  # the beginning of TLS
        b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n",
        b"$qSupported#37\n",
        b"\r\n\r\n",
        b"GET /\xff HTTP/1.1\r\n\r\n",
        b"GET / HTTP/1.1\r\nno colon\r\n\r\n",
        b"GET / HTTP/1.1\r\nA: \0\x1b[31m\r\n\r\n",
        b"GET / HTTP/1.1\r\nContent-Length: 5\r\n\r\nhello",
        b"GET / HTTP/1.1\r\nTransfer-Encoding: chunked\r\n\r\n0\r\n\r\n",
        b"GET / HTTP/9.9\r\n\r\n",
        b"GET",
        b"",
    ],
)
def test_client_that_sends_noise_is_disconnected(pages: PageServer, said: list[str], data: bytes) -> None:
    assert answer(pages, data, whole=data.endswith(b"\n")) == b""
    assert said == []


@pytest.mark.parametrize("data", [b"", b"GET / HTTP/1.1\r\nA: "])
def test_unfinished_request_is_ended(monkeypatch: pytest.MonkeyPatch, data: bytes) -> None:
    monkeypatch.setattr(server, "_REQUEST_S", 0.01)
    pages = PageServer(0)
    try:
        assert answer(pages, data) == b""
    finally:
        pages.close()


def test_number_of_callers_is_limited(pages: PageServer) -> None:
    with ExitStack() as stack:
        for _ in range(5 * server._MOST_CALLERS):
            client = stack.enter_context(socket.create_connection((HOST, pages.address.port), PATIENCE_S))
            client.sendall(b"GET / HTTP/1.1\r\nA: ")
        assert len(pages._callers) <= server._MOST_CALLERS + 1
        assert status(pages, b"GET / HTTP/1.1\r\n" + host(pages) + b"\r\n") == 200
        with connected(pages.address):
            assert isinstance(pages.controls, IdleSession)
            assert pages.controls.came.wait(PATIENCE_S)
            assert pages.controls.pages == 1
        pages.close()  # without waiting until each of them has had its time


def test_refused_callers_print_limited_number_of_lines(pages: PageServer, said: list[str]) -> None:
    for _ in range(50):
        assert status(pages, b"GET /session HTTP/1.1\r\n" + host(pages) + b"\r\n") == 403
    assert 0 < len(said) <= BURST


@pytest.mark.parametrize("error", [MemoryError(), KeyError("\x1b[31m\n"), OSError(24, "Too many open files")])
def test_failure_of_server_prints_one_line(
    pages: PageServer, said: list[str], monkeypatch: pytest.MonkeyPatch, error: Exception
) -> None:
    def fail(*_arguments: object) -> None:
        raise error

    monkeypatch.setattr(Requests, "answer", fail)
    assert status(pages, b"GET / HTTP/1.1\r\n" + host(pages) + b"\r\n") == 500
    assert len(said) == 1


def test_failure_of_library_prints_one_line(pages: PageServer, said: list[str]) -> None:
    assert isinstance(pages.controls, IdleSession)

    def fail(client: object) -> None:
        raise OSError(28, "No space\x1b[31m\nleft")

    pages.controls.attach = fail  # type: ignore[method-assign]
    with connected(pages.address) as client, pytest.raises(ConnectionClosed):
        client.recv(timeout=PATIENCE_S)
    pages.close()
    assert len(said) == 1
    assert pages._outboxes == {}
