"""``fcu terminal``: a serial terminal that sends each typed key to the board.

Decision: output is passed to the console unchanged, so that recordings contain exactly
the bytes that the board sent.

Decision: the keyboard has a separate thread, because ``select`` does not support Windows' console.
"""

from __future__ import annotations

import contextlib
import os
import signal
import socket
import sys
import threading
import time
from collections.abc import Callable, Iterator
from typing import Protocol

import click

from fcu_emulator.emulator.cli.exit_codes import ExitCode
from fcu_emulator.emulator.errors import InputError, LinkError
from fcu_emulator.emulator.host.loopback import HOST
from fcu_emulator.emulator.links.control import ControlClient, RunningBoard, the_running_board
from fcu_emulator.emulator.links.tcp import parse_port
from fcu_emulator.emulator.text import visible

if sys.platform == "win32":
    import msvcrt
else:
    import termios
    import tty

LEAVE = b"\x1d"  # Ctrl-]
_WAIT_S = 0.05
_CHUNK = 4096
_TYPED_AT_ONCE = 1024  # bytes in one message
_BAUD = 115_200


class Port(Protocol):
    """One end of the line to a board."""

    def read(self) -> bytes | None:
        """Return received bytes, b"" if no bytes arrive for a while, or None after the end of the connection."""
        ...

    def write(self, data: bytes) -> None:
        """Send all data, waiting if necessary. Raises OSError."""
        ...

    def close(self) -> None:
        """Close the port of the board."""
        ...


class _TcpPort:
    def __init__(self, port: int) -> None:
        try:
            self._socket = socket.create_connection((HOST, port), timeout=5)
        except OSError as error:
            problem = error.strerror or error
            raise LinkError(f"tcp:{port}: {problem}; start a board: fcu run --serial tcp:{port}") from error

    def read(self) -> bytes | None:
        self._socket.settimeout(_WAIT_S)
        try:
            return self._socket.recv(_CHUNK) or None
        except TimeoutError:
            return b""
        except OSError:
            return None

    def write(self, data: bytes) -> None:
        # the timeout of reads also ends writes; after a timeout, sendall would not return the number of
        # sent bytes
        while data:
            with contextlib.suppress(TimeoutError):
                data = data[self._socket.send(data) :]

    def close(self) -> None:
        self._socket.close()


class _SerialPort:
    def __init__(self, name: str) -> None:
        import serial

        self._errors = (OSError, serial.SerialException)
        try:
            self._device = serial.serial_for_url(name, _BAUD, timeout=_WAIT_S)
        except (OSError, ValueError) as error:  # includes SerialException
            raise LinkError(f"{name}: {getattr(error, 'strerror', None) or error}") from error

    def read(self) -> bytes | None:
        try:  # only available bytes: if the port closes during a longer read, pyserial loses bytes
            data: bytes = self._device.read(max(1, min(self._device.in_waiting, _CHUNK)))
        except self._errors:
            return None
        return data

    def write(self, data: bytes) -> None:
        self._device.write(data)

    def close(self) -> None:
        self._device.close()


class _ControlPort:
    """Terminal of a board that has no serial port. It uses the board's control server."""

    def __init__(self, board: RunningBoard) -> None:
        self._conversation = ControlClient(board)
        self._position: int | None = None
        self._lock = threading.Lock()

    def read(self) -> bytes | None:
        try:
            with self._lock:
                answer = self._conversation.ask({"type": "text", "position": self._position})
        except LinkError:
            return None
        if "text" not in answer:  # another version of fcu
            return None
        self._position, data = int(answer["position"]), str(answer["text"]).encode("latin-1")
        if not data:
            time.sleep(_WAIT_S)
        return data

    def write(self, data: bytes) -> None:
        for start in range(0, len(data), _TYPED_AT_ONCE):
            entry = {"do": "send", "hex": data[start : start + _TYPED_AT_ONCE].hex()}
            try:
                with self._lock:
                    answer = self._conversation.ask({"type": "do", "entry": entry})
            except LinkError as error:
                raise OSError(str(error)) from error
            if "error" in answer:
                click.echo(f"fcu: {visible(str(answer['error']))}\r", err=True)

    def close(self) -> None:
        self._conversation.close()


def open_port(where: str | None, board: str | None = None) -> tuple[str, Port]:
    """Return the name and the port, by default for the running board. Raises InputError."""
    if where is None:
        running = the_running_board(board)
        if not running.serial:
            return f"the board {running.name} (process {running.process})", _ControlPort(running)
        where = running.serial[0]
    kind, _, rest = where.partition(":")
    if kind == "tcp":
        return where, _TcpPort(parse_port("tcp", rest))
    if kind == "rfc2217" and not rest.startswith("//"):
        return where, _SerialPort(f"rfc2217://{HOST}:{parse_port(kind, rest)}")
    return where, _SerialPort(where)


def converse(where: str | None, board: str | None = None) -> ExitCode:
    """Run a terminal until Ctrl-], or until the board ends. Raises InputError."""
    name, port = open_port(where, board)
    over = threading.Event()
    with contextlib.closing(port), _ended_by_signals(over), Console() as console:
        if console.is_keyboard:
            click.echo(f"fcu: {visible(name)}; Ctrl-] ends the connection\r", err=True)
        typist = threading.Thread(target=_type, args=(console, port, over), daemon=True)
        typist.start()
        while not over.is_set():
            data = port.read()
            if data is None:
                break
            console.write(data)
    if not over.is_set():
        click.echo("\nfcu: the board has ended", err=True)
    return ExitCode.PASSED


@contextlib.contextmanager
def _ended_by_signals(over: threading.Event) -> Iterator[None]:
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    numbers = [getattr(signal, name) for name in ("SIGTERM", "SIGHUP", "SIGBREAK") if hasattr(signal, name)]
    before = {number: signal.signal(number, lambda *_: over.set()) for number in numbers}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def _type(console: Console, port: Port, over: threading.Event) -> None:
    with contextlib.suppress(OSError):
        while not over.is_set() and (data := console.read()):
            before, leave, _ = data.partition(LEAVE) if console.is_keyboard else (data, b"", b"")
            if before:
                port.write(before)
            if leave:
                over.set()


# -- The console --------------------------------------------------------------------------------------------


class Console:
    """Standard input and output. A console gives single keys, other streams give unchanged bytes."""

    def __init__(self) -> None:
        self.is_keyboard = sys.stdin is not None and sys.stdin.isatty()
        if sys.stdout is None:
            raise InputError("cannot print: standard output is closed; redirect it, for example > FILE")
        self._out = sys.stdout.buffer
        self._restore: Callable[[], object] = bool  # does nothing

    def __enter__(self) -> Console:
        if sys.platform == "win32":
            if not self.is_keyboard and sys.stdin is not None:
                msvcrt.setmode(sys.stdin.fileno(), os.O_BINARY)
            msvcrt.setmode(self._out.fileno(), os.O_BINARY)
        elif self.is_keyboard:
            self._restore = _raw(sys.stdin.fileno())
        return self

    def __exit__(self, *_: object) -> None:
        self._restore()

    def write(self, data: bytes) -> None:
        self._out.write(data)
        self._out.flush()

    def read(self) -> bytes:
        """Wait for typed data and return it, or b"" at the end of input."""
        if sys.stdin is None:
            return b""
        if sys.platform == "win32" and self.is_keyboard:
            return key(msvcrt.getwch, msvcrt.kbhit)
        return os.read(sys.stdin.fileno(), _CHUNK)


if sys.platform != "win32":

    def _raw(descriptor: int) -> Callable[[], None]:
        """Make the console deliver each key, even Ctrl-C, immediately. Return a function that restores the previous mode.

        The mode of the output does not change.
        """
        before = termios.tcgetattr(descriptor)
        tty.setraw(descriptor, termios.TCSADRAIN)
        now = termios.tcgetattr(descriptor)
        now[1] = before[1]
        termios.tcsetattr(descriptor, termios.TCSADRAIN, now)
        return lambda: termios.tcsetattr(descriptor, termios.TCSADRAIN, before)


_ESCAPES = {"H": "A", "P": "B", "M": "C", "K": "D", "G": "H", "O": "F"}
"""Last character of xterm's escape sequences for arrows, Home and End, by Windows key code."""


def key(getwch: Callable[[], str], kbhit: Callable[[], bool]) -> bytes:
    """Wait for a key of a Windows console and return its bytes. Skip keys without bytes."""
    while True:
        character = getwch()
        if character == "\x00" or (character == "\xe0" and kbhit()):
            if ending := _ESCAPES.get(getwch()):
                return f"\x1b[{ending}".encode()
            continue
        if "\ud800" <= character <= "\udbff":  # the first surrogate of a pair; the second follows
            character += getwch()
        return character.encode("utf-16", "surrogatepass").decode("utf-16", "replace").encode()
