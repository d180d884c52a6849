"""Ports of a board are open only on 127.0.0.1 of this machine, and closed when the board has ended."""

from __future__ import annotations

import socket
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from fcu_emulator import Board
from fcu_emulator.emulator.chip.gdb.attach import serve
from fcu_emulator.emulator.cli import execute
from fcu_emulator.emulator.host.loopback import HOST
from fcu_emulator.emulator.links.control import ControlServer
from fcu_emulator.emulator.links.rfc2217 import Rfc2217Link
from fcu_emulator.emulator.links.tcp import TcpLink
from fcu_emulator.emulator.live.server import PageServer

Opened = tuple[int, Callable[[], None]]
"""A port, and the function that closes it."""


def page() -> Opened:
    server = PageServer()
    return server.address.port, server.close


def control() -> Opened:
    door = ControlServer("lab3", [], dict)
    return door._board.port, door.close


def debugger() -> Opened:
    server = serve(Board("solution"), 0, halted=False)
    return server.port, server.close


def tcp() -> Opened:
    link = TcpLink(0)
    return link.port, link.close


def rfc2217() -> Opened:
    link = Rfc2217Link(0, lambda: 115_200.0, lambda _line: None)
    return link.port, link.close


@pytest.mark.skipif(sys.platform != "linux", reason="only Linux has all of 127.0.0.0/8")
@pytest.mark.parametrize("opened", [page, control, debugger, tcp, rfc2217])
def test_port_is_open_on_localhost_only(
    opened: Callable[[], Opened], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    port, close = opened()
    try:
        socket.create_connection((HOST, port), 30).close()
        with pytest.raises(ConnectionRefusedError):
            socket.create_connection(("127.0.0.2", port), 30)
    finally:
        close()
    with pytest.raises(ConnectionRefusedError):
        socket.create_connection((HOST, port), 30)
    assert [path for path in tmp_path.rglob("*") if not path.is_dir()] == []


def test_run_without_options_opens_no_port(
    monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    opened: list[object] = []
    monkeypatch.setattr(socket.socket, "listen", lambda *arguments: opened.append(arguments))
    assert execute(["run", "lab3", "--duration", "10ms", "--speed", "max"]) == 0
    capfd.readouterr()
    assert opened == []
    assert execute(["run", "lab3", "--duration", "10ms", "--speed", "max", "--serial", "tcp:0", "-q"]) == 0
    assert opened
