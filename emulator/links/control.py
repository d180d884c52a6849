"""Control of running boards by other ``fcu`` programs of the same user.

A file in the user's runtime folder contains the port and a token. Each line from a client is a JSON
object; the first line contains the token.

Decision: the control server uses TCP and a token on every system, because Windows needs TCP anyway.

Decision: a board counts as running if its control server answers with the board's token, because
process ids are reused.
"""

from __future__ import annotations

import hmac
import json
import os
import secrets
import socket
from collections.abc import Callable, Mapping, Sequence
from contextlib import closing, suppress
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import Any

from fcu_emulator.emulator.errors import InputError, LinkError, OutputError, failure_text
from fcu_emulator.emulator.host.cleanup import before_exit, done
from fcu_emulator.emulator.host.files import write_atomically
from fcu_emulator.emulator.host.loopback import HOST, LARGEST_PORT, listen
from fcu_emulator.emulator.links.runtime_folder import read_own_file, runtime_folder
from fcu_emulator.emulator.links.tcp import Coding, Reader

LONGEST_MESSAGE = 64 * 1024
MOST_CALLERS = 8
PATIENCE_S = 10.0
"""Time limit for an answer, in seconds of wall time. It is long, because slow firmware delays the answer."""
_LARGEST_FILE = 64 * 1024
_PATTERN = "board-*.json"
Message = Mapping[str, Any]


@dataclass(frozen=True)
class RunningBoard:
    """A running board's control port, firmware, and serial ports."""

    port: int
    token: str
    process: int
    name: str
    serial: tuple[str, ...] = ()

    def ask(self, *messages: Message) -> list[dict[str, Any]]:
        """Send messages and return their answers. Raises LinkError if the board has ended."""
        with closing(ControlClient(self)) as conversation:
            return [conversation.ask(message) for message in messages]


class ControlClient:
    """A connection to a control server. Raises LinkError if the server does not answer."""

    def __init__(self, board: RunningBoard) -> None:
        self._board = board
        try:
            self._socket = socket.create_connection((HOST, board.port), PATIENCE_S)
        except OSError as error:
            raise self._gone(error) from error
        self._answers = self._socket.makefile("rb")
        try:
            self.ask({"token": board.token})
        except LinkError:
            self.close()
            raise

    def ask(self, message: Message) -> dict[str, Any]:
        try:
            self._socket.sendall(json.dumps(message).encode() + b"\n")
            return _parsed(self._answers.readline(LONGEST_MESSAGE))
        except (OSError, ValueError) as error:
            raise self._gone(error) from error

    def close(self) -> None:
        """Close the connection to the board."""
        self._answers.close()
        self._socket.close()

    def _gone(self, error: Exception) -> LinkError:
        board = self._board
        return LinkError(f"the board {board.name} (process {board.process}) does not answer: {error}")


# -- The board's side ---------------------------------------------------------------------------------------


class ControlServer:
    """Server of a running board for other programs. ``answer(message)`` returns the answer.

    Raises LinkError if no port or folder is available.
    """

    def __init__(self, name: str, serial: Sequence[str], answer: Callable[[Message], dict[str, Any]]) -> None:
        folder = _folder()
        self._answer = answer
        self._callers: list[_Client] = []
        self._listener = listen(0, "fcu move")
        self._listener.setblocking(False)
        port: int = self._listener.getsockname()[1]
        self._board = RunningBoard(port, secrets.token_hex(16), os.getpid(), name, tuple(serial))
        self._file = folder / f"board-{os.getpid()}-{port}.json"
        before_exit(self._remove_file)
        try:
            write_atomically(self._file, json.dumps(asdict(self._board)), private=True)
        except OutputError as error:
            self._listener.close()
            raise LinkError(str(error)) from error

    def serve(self) -> None:
        with suppress(OSError):
            while True:
                connection, _ = self._listener.accept()
                self._callers.append(_Client(connection))
                if len(self._callers) > MOST_CALLERS:
                    self._make_room()
        for caller in list(self._callers):
            caller.serve(self._board.token, self._answer)
            if caller.reader.gone:
                self._callers.remove(caller)
                caller.reader.close()

    def _make_room(self) -> None:
        """Close the oldest connection, preferably one without the token."""
        for caller in self._callers:
            if not caller.known:
                caller.serve(self._board.token, self._answer)
        strangers = [one for one in self._callers if not one.known]
        leaves = (strangers or self._callers)[0]
        self._callers.remove(leaves)
        leaves.reader.close()

    def close(self) -> None:
        self._remove_file()
        done(self._remove_file)
        for caller in self._callers:
            caller.reader.close()
        self._callers.clear()
        self._listener.close()

    def _remove_file(self) -> None:
        with suppress(OSError):
            self._file.unlink()


class _Client:
    """A client's connection. The client must first send the token."""

    def __init__(self, connection: socket.socket) -> None:
        self.reader = Reader(connection, Coding())
        self.known = False
        self._heard = bytearray()

    def serve(self, token: str, answer: Callable[[Message], dict[str, Any]]) -> None:
        self._heard += self.reader.receive()
        if len(self._heard) > LONGEST_MESSAGE:
            self.reader.gone = True
        *lines, self._heard = self._heard.split(b"\n")
        for line in lines:
            reply = self._reply(bytes(line), token, answer)
            if reply is None:
                self.reader.gone = True
                return
            self.reader.backlog.put(json.dumps(reply).encode() + b"\n")
        self.reader.write()

    def _reply(
        self, line: bytes, token: str, answer: Callable[[Message], dict[str, Any]]
    ) -> dict[str, Any] | None:
        """Return the answer, or None if the client has not sent the token."""
        try:
            message = _parsed(line)
        except ValueError as error:
            return {"error": f"invalid message: {error}"} if self.known else None
        if self.known:
            try:
                return answer(message)
            except Exception as error:  # an error must not end the observed run
                return {"error": failure_text(error)}
        given = message.get("token")
        self.known = isinstance(given, str) and hmac.compare_digest(
            given.encode("utf-8", "replace"), token.encode()
        )
        return {"ok": True} if self.known else None


# -- The client's side --------------------------------------------------------------------------------------


def running_boards() -> list[RunningBoard]:
    """Return the user's boards that answer, the oldest first.

    Raises LinkError without a runtime folder.
    """
    found = []
    for file in sorted(_folder().glob(_PATTERN), key=_age):
        try:
            board = _read(file)
            board.ask()
        except (OSError, ValueError, LinkError):
            with suppress(OSError):  # the file of a board that was killed
                file.unlink()
            continue
        found.append(board)
    return found


def the_running_board(wanted: str | None = None) -> RunningBoard:
    """Return the only running board, or the board in process ``wanted``. Raises InputError."""
    boards = running_boards()
    if wanted is not None:
        boards = [one for one in boards if str(one.process) == wanted]
        if not boards:
            raise InputError(
                f"cannot find a running board in process {wanted}; omit --board for a list of the running boards",
                kind="no_such_process",
            )
    if not boards:
        raise InputError(
            "cannot find a running board; start one in another terminal: fcu run --serial port",
            kind="no_board",
        )
    if len(boards) > 1:
        known = ", ".join(f"{one.process} ({one.name})" for one in boards)
        raise InputError(f"{len(boards)} boards run: {known}; select one with --board PROCESS")
    return boards[0]


def _folder() -> Path:
    return runtime_folder("finding a running board", "it needs a private folder")


def _age(file: Path) -> float:
    try:
        return file.stat().st_mtime
    except OSError:
        return 0.0


def _read(file: Path) -> RunningBoard:
    """Return the board that a file describes. Raises OSError or ValueError."""
    known = _parsed(read_own_file(file, _LARGEST_FILE))
    port, token, process, name, serial = (known.get(one.name) for one in fields(RunningBoard))
    if not (
        isinstance(port, int)
        and 0 < port <= LARGEST_PORT
        and isinstance(process, int)
        and isinstance(token, str)
        and isinstance(name, str)
        and isinstance(serial, list)
        and all(isinstance(one, str) for one in serial)
    ):
        raise ValueError(f"{file} must be the file of a running board")
    return RunningBoard(port, token, process, name, tuple(serial))


def _parsed(line: bytes) -> dict[str, Any]:
    """Return a line's JSON object. Raises ValueError."""
    try:
        message = json.loads(line)
    except RecursionError as error:
        raise ValueError("nested too deeply") from error
    if not isinstance(message, dict):
        raise ValueError(f"a message must be a JSON object, not {line[:40]!r}")
    return message
