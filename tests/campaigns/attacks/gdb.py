"""The debugger's port: any client connects, and the board and the next debugger must not be affected."""

from __future__ import annotations

import socket
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from random import Random

from fcu_emulator import Board
from fcu_emulator.emulator.chip.gdb.attach import serve
from fcu_emulator.emulator.chip.gdb.packets import frame
from fcu_emulator.emulator.chip.gdb.server import GdbServer
from fcu_emulator.emulator.clock import PS_PER_US
from fcu_emulator.emulator.errors import FirmwareError
from fcu_emulator.emulator.host.loopback import HOST

_KINDS = ("valid", "HTTP", "garbage", "nearly a packet", "half-open", "connect and close", "idle")
_IDLE_KEPT = 20
_HTTP = b"POST / HTTP/1.1\r\nHost: 127.0.0.1\r\nContent-Length: 20\r\n\r\n" + frame(b"M20000000,4:deadbeef")


def connections(tries: int, random: Random, folder: Path) -> Iterator[str]:
    """Try connections of every kind; a debugger must still be served."""
    del folder
    board = Board("solution", seed=random.randrange(100))
    server = serve(board, 0, halted=True)
    idle: list[socket.socket] = []
    try:
        for _ in range(tries):
            kind = random.choice(_KINDS)
            client = socket.create_connection((HOST, server.port))
            client.settimeout(20)
            if kind == "idle":
                idle.append(client)
                if len(idle) > _IDLE_KEPT:
                    idle.pop(0).close()
                _serve(board, server)
                yield kind
                continue
            with client:
                yield _speak(kind, client, random, board, server)
    finally:
        for client in idle:
            client.close()
        server.close()


def _speak(kind: str, client: socket.socket, random: Random, board: Board, server: GdbServer) -> str:
    _serve(board, server)  # a debugger before that has left has let the board go
    held = server.halted
    try:
        if kind == "valid":
            return _debug(client, board, server)
        if kind == "HTTP":
            client.sendall(_HTTP)
        elif kind == "garbage":
            client.sendall(random.randbytes(random.choice((1, 100, 20_000))))
        elif kind == "nearly a packet":
            client.sendall(random.choice((b"$", b"$g#00", b"$m0,ffffffff", b"+$" * 50, b"$" + b"x" * 9000)))
        elif kind == "half-open":
            client.shutdown(socket.SHUT_WR)
    except (BrokenPipeError, ConnectionResetError):  # hung up on before it had said everything
        pass
    _serve(board, server)
    assert server.halted == held, f"{kind} has changed whether the board is held"
    return f"{kind}: nothing changed"


def _debug(client: socket.socket, board: Board, server: GdbServer) -> str:
    """Act as a debugger that queries and steps, and does not kill the program."""
    for request in (b"qSupported", b"?", b"g", b"s"):
        client.sendall(frame(request))
        answer = b""
        while b"#" not in answer:
            _serve(board, server)
            client.setblocking(False)
            with suppress(BlockingIOError):
                got = client.recv(65536)
                assert got, f"hung up on at {request!r}"
                answer += got
            client.setblocking(True)
        assert b"$" in answer, answer
        client.sendall(b"+")
    return "valid: served"


def _serve(board: Board, server: GdbServer) -> None:
    for _ in range(3):
        try:
            server.run_until_ps(board.clock.now_ps + 50 * PS_PER_US)
        except FirmwareError as error:
            raise AssertionError(f"the firmware was changed: {error}") from error
