"""Files in the runtime folder: commands do not wait for any kind of file."""

from __future__ import annotations

import json
import os
import socket
import stat
import sys
import threading
from collections.abc import Callable
from contextlib import closing, suppress
from pathlib import Path

import pytest

from fcu_emulator.emulator.errors import InputError, LinkError, OutputError
from fcu_emulator.emulator.host.files import write_atomically
from fcu_emulator.emulator.host.loopback import HOST
from fcu_emulator.emulator.links.control import (
    LONGEST_MESSAGE,
    MOST_CALLERS,
    ControlServer,
    RunningBoard,
    running_boards,
)
from fcu_emulator.emulator.links.runtime_folder import read_own_file
from fcu_emulator.emulator.live import address

posix = pytest.mark.skipif(sys.platform == "win32", reason="pipes, links and devices with a name")


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return a runtime folder for this test."""
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    monkeypatch.setenv("LOCALAPPDATA", str(tmp_path))
    made = tmp_path / "fcu-emulator"
    made.mkdir(mode=0o700)
    return made


def _pipe(path: Path) -> None:
    os.mkfifo(path)


def _folder(path: Path) -> None:
    path.mkdir()


def _link(path: Path) -> None:
    target = path.with_name("elsewhere")
    target.write_text(json.dumps({"port": 8000, "token": "x" * 32}), encoding="utf-8")
    path.symlink_to(target)


def _device(path: Path) -> None:
    path.symlink_to("/dev/zero")


def _socket(path: Path) -> None:
    with closing(socket.socket(socket.AF_UNIX)) as one:
        one.bind(str(path))


def _large(path: Path) -> None:
    path.write_bytes(b'{"token": "' + b"x" * 200_000)


def _deep(path: Path) -> None:
    path.write_bytes(b"[" * 50_000)


def _binary(path: Path) -> None:
    path.write_bytes(bytes(range(256)))


def _infinite(path: Path) -> None:
    path.write_text('{"port": Infinity, "token": "x", "process": 1, "name": "x", "serial": []}', "utf-8")


def _large_number(path: Path) -> None:
    number = "9" * 300
    path.write_text(f'{{"port": {number}, "token": "x", "process": 1, "name": "x", "serial": []}}', "utf-8")


KINDS = [_pipe, _folder, _link, _device, _socket, _large, _deep, _binary, _infinite, _large_number]


@posix
@pytest.mark.parametrize("make", KINDS)
def test_non_file_is_not_found_as_board(folder: Path, make: Callable[[Path], None]) -> None:
    make(folder / "board-1-2.json")
    with closing(ControlServer("lab3", [], dict)) as door:
        serving = threading.Event()
        thread = threading.Thread(target=_serve, args=(door, serving))
        thread.start()
        try:
            found = running_boards()
        finally:
            serving.set()
            thread.join()
    assert [one.name for one in found] == ["lab3"]


def _serve(door: ControlServer, over: threading.Event) -> None:
    while not over.wait(0.001):
        door.serve()


@posix
@pytest.mark.parametrize("make", KINDS)
def test_token_is_not_read_from_non_file(folder: Path, make: Callable[[Path], None]) -> None:
    make(folder / "web-8000.json")
    found = address.address_for(8000)
    assert found.port == 8000
    assert found.token != "x" * 32


def test_invalid_stored_token_is_replaced(folder: Path) -> None:
    (folder / "web-8000.json").write_text(json.dumps({"token": "\x1b[31m" + "x" * 27}), encoding="utf-8")
    assert address.address_for(8000).token.isprintable()


@posix
def test_file_of_user_is_read_completely_or_refused(folder: Path) -> None:
    file = folder / "file"
    file.write_bytes(b"12345")
    assert read_own_file(file, 5) == b"12345"
    with pytest.raises(OSError, match="4 bytes"):
        read_own_file(file, 4)


@posix
def test_port_name_does_not_replace_pipe(folder: Path) -> None:
    from fcu_emulator.emulator.links.port_name import claim_port

    os.mkfifo(folder / ".ttyFCU0.lock")
    with pytest.raises(LinkError):
        claim_port()


@posix
def test_write_does_not_replace_device_or_pipe(folder: Path) -> None:
    os.mkfifo(folder / "pipe")
    for path in (folder / "pipe", folder):
        with pytest.raises(OutputError):
            write_atomically(path, "text")
    write_atomically(Path(os.devnull), "text")
    assert stat.S_ISCHR(Path(os.devnull).stat().st_mode)


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="/dev/full is a Linux device")
def test_full_device_raises_error_and_stays_device() -> None:
    with pytest.raises(OutputError):
        write_atomically(Path("/dev/full"), "text")
    assert stat.S_ISCHR(Path("/dev/full").stat().st_mode)


# -- The control socket -------------------------------------------------------------------------------------


def _served(door: ControlServer) -> RunningBoard:
    return door._board


def test_callers_without_token_do_not_displace_others() -> None:
    with closing(ControlServer("lab3", [], lambda _message: {"t_s": 0.0})) as door:
        board = _served(door)
        with (
            closing(socket.create_connection((HOST, board.port))) as one,
            closing(one.makefile("rb")) as answers,
        ):
            one.sendall(json.dumps({"token": board.token}).encode() + b"\n")
            _until(door, lambda: any(caller.known for caller in door._callers))
            assert json.loads(answers.readline()) == {"ok": True}
            strangers = [socket.create_connection((HOST, board.port)) for _ in range(3 * MOST_CALLERS)]
            _until(door, lambda: len(door._callers) == MOST_CALLERS)
            one.sendall(b'{"type": "truth"}\n')
            _until(door, lambda: not door._callers[0].reader.unread())
            assert json.loads(answers.readline()) == {"t_s": 0.0}
            for stranger in strangers:
                stranger.close()


def test_caller_with_token_is_not_displaced() -> None:
    with closing(ControlServer("lab3", [], lambda _message: {"t_s": 0.0})) as door:
        board = _served(door)
        with (
            closing(socket.create_connection((HOST, board.port))) as one,
            closing(one.makefile("rb")) as answers,
        ):
            one.sendall(json.dumps({"token": board.token}).encode() + b"\n")
            strangers = [socket.create_connection((HOST, board.port)) for _ in range(3 * MOST_CALLERS)]
            _until(door, lambda: len(door._callers) == MOST_CALLERS)
            assert json.loads(answers.readline()) == {"ok": True}
            for stranger in strangers:
                stranger.close()


@pytest.mark.parametrize(
    "said",
    [
        b'{"type": "truth"}',
        b'{"token": ""}',
        b'{"token": "0123456789abcdef0123456789abcdef"}',
        b'{"token": ["{token}"]}',
        b'{"token": "{token}x"}',
        b'["{token}"]',
        b'{"token": "\\ud800"}',
        b'{"token": "\xc3\xa9"}',
        b"{token}",
        b"\xff\x00",
        b"[" * 50_000,
        b"9" * 5_000,
        b"GET / HTTP/1.1",
        b"x" * (2 * LONGEST_MESSAGE),
    ],
    ids=lambda said: repr(said[:20]),
)
def test_caller_without_token_is_refused(said: bytes) -> None:
    asked: list[object] = []

    def answer(message: object) -> dict[str, object]:
        asked.append(message)
        return {}

    with closing(ControlServer("lab3", [], answer)) as door:
        board = _served(door)
        said = said.replace(b"{token}", board.token.encode()) + b'\n{"type": "truth"}\n'
        with closing(socket.create_connection((HOST, board.port))) as one:
            ended = threading.Event()
            caller = threading.Thread(target=_send, args=(one, said, ended))
            caller.start()
            _until(door, ended.is_set)
            caller.join()
    assert asked == []


def _send(connection: socket.socket, data: bytes, ended: threading.Event) -> None:
    """Send ``data`` and wait until the board has closed the connection, without an answer."""
    with suppress(ConnectionError):  # it may be closed before all is read
        connection.sendall(data)
    with suppress(ConnectionError):
        if connection.recv(1):
            return
    ended.set()


@posix
def test_files_with_token_are_readable_by_owner_only(folder: Path) -> None:
    with closing(ControlServer("lab3", [], dict)):
        one = address.fresh(8000)
        address.publish(one)
        files = [path for path in folder.iterdir() if path.is_file()]
        assert len(files) == 2
        assert {stat.S_IMODE(path.stat().st_mode) for path in files} == {0o600}
        assert stat.S_IMODE(folder.stat().st_mode) == 0o700


def _until(door: ControlServer, condition: Callable[[], bool]) -> None:
    for _ in range(100_000):
        door.serve()
        if condition():
            return
    raise AssertionError("it did not happen")


@pytest.mark.parametrize(
    "error", [OSError(28, "No space left on device"), MemoryError(), KeyError("x"), InputError("x")]
)
def test_failed_message_gets_error_as_its_answer(error: Exception) -> None:
    def answer(_message: object) -> dict[str, object]:
        raise error

    with closing(ControlServer("lab3", [], answer)) as door:
        board = _served(door)
        with (
            closing(socket.create_connection((HOST, board.port))) as one,
            closing(one.makefile("rb")) as answers,
        ):
            one.sendall(json.dumps({"token": board.token}).encode() + b'\n{"type": "truth"}\n')
            _until(door, lambda: any(caller.known for caller in door._callers))
            door.serve()
            assert json.loads(answers.readline()) == {"ok": True}
            assert set(json.loads(answers.readline())) == {"error"}
