"""The page's port: requests of every kind, and messages on its socket.

The board must continue to run, and the terminal must show only few lines.
"""

from __future__ import annotations

import contextlib
import io
import json
import socket
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from random import Random

from websockets.sync.client import ClientConnection

from fcu_emulator.emulator.host.loopback import HOST
from fcu_emulator.emulator.live.address import Address
from fcu_emulator.emulator.live.server import PageServer
from fcu_emulator.emulator.live.session import LiveSession
from fcu_emulator.emulator.live.setup import Setup
from tests.campaigns.live_fuzz import fuzzed
from tests.support.live_fakes import connected

_PATIENCE_S = 20
_IDLE_KEPT = 100
_LONGEST_S = 120  # for the answer to a message, after all before it
_SETTLED = "settled-b7e1"  # a firmware that does not exist
_SETTLED_EVERY = 200  # messages after which a page waits until all have been taken
_METHODS = (*(b"GET",) * 6, b"POST", b"HEAD", b"OPTIONS")
_BROKEN_METHODS = (b"get", b"", b"G\0T", b"\xff", b"GET GET")
_TARGETS = (
    *(b"/", b"/session", b"/session", b"/app.js", b"/icon.svg", b"/?2d", b"/favicon.ico", b"*", b""),
    *(
        b"//[x",
        b"http://[",
        b"http://127.0.0.1/",
        b"/../server.py",
        b"/%2e%2e/",
        b"/\x1b[2J\x07",
        b"/\0",
        b"/\r",
    ),
    *(b"/session?token={token}", b"/" + b"a" * 9000, b"/?" + b"&" * 3000, b"/;x=y#z"),
)
_BROKEN_TARGETS = (b"/\xff\xfe", b"/ /", b"/\n")
_VERSIONS = (b"HTTP/1.1",) * 6 + (b"HTTP/1.0",)
_BROKEN_VERSIONS = (b"HTTP/0.9", b"HTTP/2", b"", b"HTTP/1.1 x", b"\x1b[31m")
_HEADERS = (
    *(
        b"Connection: Upgrade\r\nUpgrade: websocket",
        b"Sec-WebSocket-Version: 13",
        b"Sec-WebSocket-Version: 99",
    ),
    *(
        b"Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==",
        b"Sec-WebSocket-Key: x",
        b"Sec-WebSocket-Extensions: \xff",
    ),
    *(
        b"Sec-WebSocket-Protocol: fcu",
        b"Sec-WebSocket-Protocol: fcu, fcu.token.wrong",
        b"Origin: http://evil",
    ),
    *(b"Sec-WebSocket-Protocol: ,,\x80,", b"Sec-WebSocket-Protocol: fcu.token.\xff", b"Origin: null"),
    *(b"Sec-WebSocket-Protocol: fcu.token.{token}", b"Cookie: fcu=\xe4", b"Content-Length: 0", b"\x41: \xe4"),
    *(b"Expect: 100-continue", b"Range: bytes=0-", b"Upgrade: h2c", b"Host: evil.example", b"Host: {host}"),
)
_BROKEN_HEADERS = (
    *(b"Transfer-Encoding: chunked", b"Content-Length: 5", b"Content-Length: -1", b"Cookie: \x1b[31m"),
    *(
        b"A: " + b"x" * 9000,
        b"A: b\r\n" * 200 + b"A: b",
        b": x",
        b"no colon",
        b" folded",
        b"\0: \0",
        b"\xe4: \xe4",
    ),
)
_NOISE = (
    b"\x16\x03\x01\x02\x00\x01\x00\x01\xfc\x03\x03" + bytes(64) + b"\n",  # the beginning of TLS
    b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n",
    b"SSH-2.0-OpenSSH_9.2\r\n",
    b"$qSupported#37\n",
    b"\xff\xfd\x2c\r\n",
    b"\x1b]0;x\x07\n",
    b"\n" * 100,
    b"\r\n\r\n",
)


class Served:
    """A board with a server, and the output of the terminal."""

    def __init__(self) -> None:
        self.lines: list[str] = []
        self.pages = PageServer(0, self.lines.append)
        self._ready = threading.Event()
        self._thread = threading.Thread(target=self._live)
        self._thread.start()
        self._ready.wait()

    @property
    def address(self) -> Address:
        """Return the address of the server."""
        return self.pages.address

    def _live(self) -> None:
        self.session = LiveSession(Setup("solution"), self.pages.publish)
        self.pages.controls = self.session
        self._ready.set()
        self.session.run()

    def check(self) -> None:
        """Raise AssertionError unless the board runs, a page is accepted, and the terminal has only lines."""
        with connected(self.address) as page:
            for command in ({"type": "firmware", "name": "solution"}, {"type": "run"}):
                page.send(json.dumps(command))
            page.send('{"type":"speed","factor":1}')
            printed = ""
            end_s = time.monotonic() + _LONGEST_S
            while "Pitch:" not in printed:
                assert time.monotonic() < end_s, f"the board does not run: {printed[-200:]}"
                event = json.loads(page.recv(timeout=_LONGEST_S))
                printed += event.get("text", "") if event["type"] == "text" else ""
        assert all(line.isprintable() for line in self.lines), self.lines

    def close(self) -> None:
        """End the session and the server."""
        self.session.stop()
        self._thread.join()
        self.pages.close()


@contextlib.contextmanager
def _served() -> Iterator[Served]:
    """Serve a board that must still run at the end, without any other output."""
    printed = io.StringIO()
    with contextlib.redirect_stderr(printed):
        served = Served()
        try:
            yield served
            served.check()
        finally:
            served.close()
    assert printed.getvalue() == "", printed.getvalue()[:300]


def requests(tries: int, random: Random, folder: Path) -> Iterator[str]:
    """Try connections: each sends a random request, random bytes, a truncated request, or a request without an end."""
    del folder
    idle: list[socket.socket] = []
    with _served() as served:
        try:
            for _ in range(tries):
                yield _request(served.address, random, idle)
        finally:
            for one in idle:
                one.close()


def _request(address: Address, random: Random, idle: list[socket.socket]) -> str:
    client = socket.create_connection((HOST, address.port))
    client.settimeout(_PATIENCE_S)
    sent = random.choice(_NOISE) if random.random() < 0.1 else _of_chance(address, random)
    how = random.randrange(20)
    if how == 0:
        idle.append(client)
        client.sendall(sent[: random.randrange(len(sent) + 1)].rstrip(b"\n"))
        if len(idle) > _IDLE_KEPT:
            idle.pop(0).close()
        return "left open without an end"
    with client, contextlib.suppress(BrokenPipeError, ConnectionResetError):
        if how == 1:
            client.sendall(sent[: random.randrange(len(sent) + 1)])
            client.shutdown(socket.SHUT_WR)
            return f"cut short: {_answered(client, sent)}"
        if how == 2:
            return "closed at once"
        client.sendall(sent)
        if b"\n\r\n" not in sent and b"\n\n" not in sent:
            client.shutdown(socket.SHUT_WR)
        return _answered(client, sent)
    return "hung up on"


def _of_chance(address: Address, random: Random) -> bytes:
    host = f"{HOST}:{address.port}".encode()
    parts = [random.choice(some) for some in (_METHODS, _TARGETS, _VERSIONS)]
    headers = random.choices(_HEADERS, k=random.randrange(8))
    if random.random() < 0.3:
        at = random.randrange(4)
        broken = (_BROKEN_METHODS, _BROKEN_TARGETS, _BROKEN_VERSIONS, _BROKEN_HEADERS)[at]
        (headers if at == 3 else parts)[at : at + 1] = [random.choice(broken)]
    if random.random() < 0.8:
        headers.insert(0, b"Host: {host}")
    text = b"\r\n".join((b" ".join(parts), *headers, b"", b"")).replace(b"{host}", host)
    text = text.replace(b"{token}", address.token.encode())
    if random.random() < 0.2:
        at = random.randrange(len(text))
        text = text[:at] + random.randbytes(random.randrange(1, 20)) + text[at + random.randrange(20) :]
    return text


def _answered(client: socket.socket, sent: bytes) -> str:
    """Return the class of the answer. Raises AssertionError for an answer that no request may have."""
    answer = b""
    while data := client.recv(1 << 16):
        answer += data[: 64 - len(answer)]
        if answer.startswith(b"HTTP/1.1 101 "):
            assert b"fcu.token" in sent, "a socket without the token"
            return "a socket, for the token"
    if not answer:
        return "hung up on"
    version, status = answer.split(b" ")[:2]
    assert version == b"HTTP/1.1", answer
    assert status in (b"200", b"505") or status.startswith(b"4"), answer  # 505: a socket with HTTP/1.0
    return f"answered with {'200' if status == b'200' else '4xx or 505'}"


def messages(tries: int, random: Random, folder: Path) -> Iterator[str]:
    """Try messages of a page with the token: wrong fields, damaged JSON, bytes, deep nesting."""
    del folder
    with _served() as served:
        made = 0
        while made < tries:
            some = min(_SETTLED_EVERY, tries - made)
            made += some
            with connected(served.address) as page:
                for message in fuzzed(random.randrange(1 << 30), some):
                    page.send(message)
                refused = _refused_until_settled(page)
            yield from ["refused, newest shown"] * min(refused, some)
            yield from ["carried out, or refused unseen"] * (some - min(refused, some))


def _refused_until_settled(page: ClientConnection) -> int:
    """Return the number of error notices before the answer to a final message, which is unique."""
    last = json.dumps({"type": "firmware", "name": _SETTLED})
    page.send(last)
    refused = 0
    end_s = time.monotonic() + _LONGEST_S
    while True:
        assert time.monotonic() < end_s, "the last message has no answer"
        event = json.loads(page.recv(timeout=_LONGEST_S))
        if event["type"] == "notice" and event["kind"] == "error":
            if _SETTLED in event["text"]:
                return refused
            assert event["text"].isprintable(), event
            assert "bug" not in event["text"], event
            refused += 1
            if "dropped" in event["text"]:  # it may have been the last one
                page.send(last)
