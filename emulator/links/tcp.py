"""The serial port as a raw TCP port of 127.0.0.1.

The port has no password, because terminal programs cannot send passwords.

Decision: several readers may connect to the TCP port at the same time, for example a projector and a
recorder.

Decision: the TCP port keeps output for the first reader, as the pseudo-terminal does.

Decision: if a TCP reader closes the connection, or only its sending half, it counts as gone,
because the two cases cannot be distinguished without a loss of bytes.

Decision: when a TCP reader leaves, the bytes in its queue are lost. Text that is
sent without a reader is lost, as on a real wire.

Decision: the sockets of the TCP port never block and are polled, so that no threads are needed.
"""

from __future__ import annotations

import contextlib
import errno
import socket
import time

from fcu_emulator.emulator.errors import LinkError
from fcu_emulator.emulator.host.loopback import HOST, LARGEST_PORT, listen
from fcu_emulator.emulator.links import programs
from fcu_emulator.emulator.links.byte_link import Backlog, Patience, losses

FIRST_LIMIT = 1024 * 1024
"""Bytes kept before the first reader connects."""
BACKLOG_LIMIT = 16 * 1024 * 1024
"""Bytes kept for each reader that does not read."""
INBOX_LIMIT = 64 * 1024
"""Maximum number of readers' bytes that wait here; further bytes wait in the system."""
MOST_READERS = 8
CHUNK = 4096
WRITE_BUDGET = 256 * 1024
"""Approximate number of bytes written per reader and call, so that a fast reader does not delay the board."""
SYSTEM_BUFFER = 128 * 1024
"""Requested size of the system's buffer for one reader."""
POLL_S = 0.005
FIRST_PORT = 4001
"""Default port, the usual first port of serial device servers; ``PORTS_TRIED`` ports from here on are tried."""
PORTS_TRIED = 16


# -- One reader ---------------------------------------------------------------------------------------------


class Coding:
    """Encoding of one reader's connection. This class leaves all bytes unchanged."""

    def encode(self, data: bytes) -> bytes:
        return data

    def decode(self, data: bytes) -> tuple[bytes, bytes]:
        """Return the board's input and the answer to the reader. Raises ValueError."""
        return data, b""

    def ready(self) -> bool:
        return True

    def takes_back(self) -> bool:
        """Return whether the reader asked to discard its queued bytes."""
        return False


class Reader:
    """A reader's non-blocking connection. ``backlog`` contains the board's output."""

    def __init__(self, connection: socket.socket, coding: Coding) -> None:
        connection.setblocking(False)
        with contextlib.suppress(OSError):
            connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            connection.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, SYSTEM_BUFFER)
        self.backlog = Backlog(BACKLOG_LIMIT)
        self.coding = coding
        self.gone = False
        self._socket = connection
        self._encoded = b""  # bytes on the way to the socket

    def unread(self) -> int:
        return len(self.backlog) + len(self._encoded)

    def receive(self) -> bytes:
        if (
            self.gone or len(self._encoded) > CHUNK
        ):  # send pending answers first: otherwise answers to a reader that never reads would accumulate
            return b""
        try:
            data = self._socket.recv(CHUNK)
            typed, answer = self.coding.decode(data)
        except BlockingIOError:
            return b""
        except (OSError, ValueError):
            self.gone = True
            return b""
        self.gone = not data
        self._encoded += answer
        if self.coding.takes_back():
            self.backlog.take()
        return typed

    def write(self) -> None:
        budget = WRITE_BUDGET
        while not self.gone and budget > 0:
            if not self._encoded:
                if not self.backlog or not self.coding.ready():
                    return
                self._encoded = self.coding.encode(self.backlog.take(CHUNK))
            try:
                count = self._socket.send(self._encoded)
            except BlockingIOError:
                return
            except OSError:
                self.gone = True
                return
            self._encoded = self._encoded[count:]
            budget -= count

    def close(self) -> None:
        """Read pending input and disconnect. Unread input would reset the connection."""
        with contextlib.suppress(OSError):
            self._socket.shutdown(socket.SHUT_WR)
            for _ in range(INBOX_LIMIT // CHUNK):
                if not self._socket.recv(CHUNK):
                    break
        self._socket.close()


# -- The link -----------------------------------------------------------------------------------------------


class TcpLink:
    """A link on ``port`` of 127.0.0.1 (None: the default port, 0: any free port). Raises LinkError."""

    kind = "tcp"
    first_port = FIRST_PORT

    def __init__(self, port: int | None = None) -> None:
        self._listener = _listen(self.kind, self.first_port, port)
        self._listener.setblocking(False)
        self.port: int = self._listener.getsockname()[1]
        self._readers: list[Reader] = []
        self._had_reader = False
        self._first = Backlog(FIRST_LIMIT)  # output before the first reader connects
        self._inbox = Backlog(INBOX_LIMIT)
        self._lost_absent = 0
        self._lost_slow = 0
        self._left_unread = 0
        self._refused = 0
        self._closed = False

    @property
    def address(self) -> str:
        return f"{self.kind}:{self.port}"

    def send(self, data: bytes) -> None:
        if self._closed:
            return
        self._follow_readers()
        if self._readers:
            for reader in self._readers:
                self._lost_slow += reader.backlog.put(data)
                reader.write()
        elif self._had_reader:
            self._lost_absent += len(data)
        else:
            self._lost_absent += self._first.put(data)

    def receive(self, most: int) -> bytes:
        if self._closed:
            return b""
        self._follow_readers()
        for reader in self._readers:
            reader.write()
        return self._inbox.take(most)

    def flush(self, timeout_s: float) -> None:
        if self._closed:
            return
        patience = Patience(timeout_s)
        while (left := self._untaken()) and (wait_s := patience.wait_s(left)):
            time.sleep(min(POLL_S, wait_s))

    def close(self) -> None:
        if self._closed:
            return
        self._follow_readers()
        self._closed = True
        self._lost_absent += len(self._first.take())
        for reader in self._readers:
            self._lost_slow += reader.unread()
            reader.close()
        self._readers.clear()
        self._listener.close()

    def announce(self) -> list[str]:
        return [
            f"serial: TCP port {self.port} of {HOST}, connection type raw; open it with one of",
            *(f"  {command}" for command in programs.for_tcp(self.port)),
        ]

    def report(self) -> list[str]:
        lines = losses(
            self.address,
            (self._lost_absent, "while no terminal was connected"),
            (self._lost_slow, "because a reader was too slow"),
            (self._left_unread, "because readers did not read them"),
        )
        if self._refused:
            lines.append(
                f"serial: connections refused at {self.address}: {self._refused} (at most {MOST_READERS} may be open)"
            )
        return lines

    def undelivered(self) -> int:
        return self._lost_slow

    def coding(self) -> Coding:
        return Coding()

    def _follow_readers(self) -> None:
        self._accept()
        for reader in self._readers:
            while len(self._inbox) <= INBOX_LIMIT - CHUNK:  # the inbox never overflows
                typed = reader.receive()
                self._inbox.put(typed)
                if not typed:
                    break
        for reader in [one for one in self._readers if one.gone]:
            self._readers.remove(reader)
            self._left_unread += reader.unread()
            reader.close()

    def _accept(self) -> None:
        while True:
            try:
                connection, _ = self._listener.accept()
            except OSError as error:
                if error.errno in (
                    errno.ECONNABORTED,
                    errno.EPROTO,
                ):  # this client has given up: try the next client
                    continue
                return
            if len(self._readers) >= MOST_READERS:
                self._refused += 1
                connection.close()
                continue
            reader = Reader(connection, self.coding())
            reader.backlog.put(self._first.take())
            self._readers.append(reader)
            self._had_reader = True

    def _untaken(self) -> int:
        self._follow_readers()
        for reader in self._readers:
            reader.write()
        return sum(reader.unread() for reader in self._readers)


def _listen(kind: str, first_port: int, port: int | None) -> socket.socket:
    if port is not None:
        return listen(port, f"--serial {kind}:{port}")
    for number in range(first_port, first_port + PORTS_TRIED - 1):
        with contextlib.suppress(LinkError):
            return listen(number, f"--serial {kind}")
    return listen(first_port + PORTS_TRIED - 1, f"--serial {kind}")


def parse_port(kind: str, text: str) -> int:
    """Return the port in ``tcp:PORT``. Raises LinkError."""
    if not text.isascii() or not text.isdigit() or len(text) > 5 or int(text) > LARGEST_PORT:
        problem = f"the port must be from 0 (a free one) to {LARGEST_PORT}"
        raise LinkError(f"--serial {kind}:{text}: {problem}", kind="no_port")
    return int(text)
