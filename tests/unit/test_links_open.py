"""The value of ``--serial``, and the time for which the end of a run waits."""

from __future__ import annotations

import contextlib
import os
import re
import socket
import sys
from pathlib import Path

import pytest

from fcu_emulator.emulator.errors import LinkError
from fcu_emulator.emulator.links import CHOICES, StdoutLink, byte_link, open_link, programs
from fcu_emulator.emulator.links.byte_link import Patience


def test_stdout_value_opens_stdout_link(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(os, "isatty", lambda fd: False)  # the terminal of who runs the tests stays theirs
    link = open_link("stdout")
    link.close()
    assert isinstance(link, StdoutLink)


@pytest.mark.parametrize(
    "spec", ["", "pty:", "tcp:", "rfc2217:", "file", "file:", "stdout:x", "port:1", "ptyx", "PTY"]
)
def test_unknown_link_is_refused_with_choices(spec: str) -> None:
    with pytest.raises(LinkError, match=re.escape(repr(spec))) as caught:
        open_link(spec)
    assert caught.value.kind == "unknown_link"
    assert CHOICES in str(caught.value)


@pytest.mark.parametrize("spec", ["pty", "pty:/some/link"])
def test_windows_error_recommends_tcp(spec: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "platform", "win32")
    with pytest.raises(LinkError, match="--serial tcp") as caught:
        open_link(spec)
    assert caught.value.kind == "no_pty"


@pytest.mark.parametrize("port", ["65536", "-1", "com3", "1.5", "123456", "\u0661"])
@pytest.mark.parametrize("kind", ["tcp", "rfc2217"])
def test_invalid_port_number_is_refused(kind: str, port: str) -> None:
    with pytest.raises(LinkError, match="65535") as caught:
        open_link(f"{kind}:{port}")
    assert caught.value.kind == "no_port"


def on_windows(monkeypatch: pytest.MonkeyPatch, python: str) -> None:
    monkeypatch.setattr(sys, "platform", "win32")
    monkeypatch.setattr(sys, "executable", python)


@pytest.mark.skipif(sys.platform == "win32", reason="its sockets have no SO_EXCLUSIVEADDRUSE")
def test_port_link_uses_tcp_without_pseudo_terminals(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(socket, "SO_EXCLUSIVEADDRUSE", socket.SO_REUSEADDR, raising=False)
    on_windows(monkeypatch, r"C:\Python\python.exe")
    with contextlib.closing(open_link("port")) as link:
        title, *commands = link.announce()
    number = title.split()[3]
    assert commands == [
        f"  fcu terminal tcp:{number}",
        rf"  C:\Python\python.exe -m serial.tools.miniterm socket://127.0.0.1:{number}",
        f"  putty -raw 127.0.0.1 -P {number}",
        f"  ttermpro 127.0.0.1:{number} /nossh /T=0",
    ]


def test_windows_command_avoids_python_path_with_spaces(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A path in quotes is a program for cmd, but a text for PowerShell."""
    on_windows(monkeypatch, r"C:\Program Files\Python\python.exe")
    assert programs.for_tcp(4001)[1] == "python -m serial.tools.miniterm socket://127.0.0.1:4001"


@pytest.mark.skipif(sys.platform == "win32", reason="the commands are for this system's shell")
def test_port_name_with_space_is_quoted() -> None:
    _, screen, *_ = programs.for_pty(Path("/tmp/my board"))
    assert screen == "screen '/tmp/my board' 115200"


class WallClock:
    """A replacement of ``time.monotonic`` that the test controls."""

    def __init__(self) -> None:
        self.now_s = 100.0

    def monotonic(self) -> float:
        return self.now_s


@pytest.fixture
def wall(monkeypatch: pytest.MonkeyPatch) -> WallClock:
    clock = WallClock()
    monkeypatch.setattr(byte_link, "time", clock)
    return clock


def test_wait_ends_at_timeout_despite_progress(wall: WallClock) -> None:
    waiting = Patience(timeout_s=3.0)
    for step in range(3):
        wall.now_s = 100.0 + step
        assert waiting.wait_s(10 - step) > 0.0
    wall.now_s = 103.0
    assert waiting.wait_s(1) == 0.0


def test_wait_ends_two_seconds_after_latest_progress(wall: WallClock) -> None:
    waiting = Patience(timeout_s=60.0)
    assert waiting.wait_s(10) == 2.0
    wall.now_s = 101.5
    assert waiting.wait_s(10) == 0.5
    assert waiting.wait_s(9) == 2.0
    wall.now_s = 103.5
    assert waiting.wait_s(9) == 0.0
