"""The board's serial port as a TCP port of this machine: the link that is the same on every system.

Bytes pass as they are, so it is *raw* TCP to terminal programs; the Telnet protocol with the settings of a
serial line is :mod:`fcu_emulator.emulator.links.rfc2217`.

Decisions about readers, of which there may be several:

* Each one gets everything that is printed while it is connected, and what any of them sends goes to the
  board in the order of arrival. So a lecturer's projector and a program that records see the same board. The
  road not taken, one reader at a time, would lock a user out whose terminal program was not closed properly.
* What is printed before the first one comes is kept for it, as with a pseudo-terminal.
* Who closes the connection, or its sending half, has left: a connection that is half closed cannot be told
  from one that is closed until bytes have been sent into it, and these would be lost without anybody's
  knowing. What was sent before closing arrives.
* A reader that has left leaves unread what was queued for it; while nobody is connected, text is lost as on a
  real wire. All of that is counted.

Decision: sockets that never block, looked at whenever the board has time, and no thread. The system's own
buffer for each reader is made small, so that the bounds below say how much is kept.

Whoever can run programs on this machine can connect (127.0.0.1); there is no password, as a terminal program
could not give one.
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
"""Bytes kept before the first reader."""
BACKLOG_LIMIT = 16 * 1024 * 1024
"""Bytes kept for each reader that is connected and does not read."""
INBOX_LIMIT = 64 * 1024
"""Bytes taken from readers before the board asks; the rest waits in the system, which stops the writer."""
MOST_READERS = 8
CHUNK = 4096
WRITE_BUDGET = 256 * 1024
"""Bytes handed to the system for one reader in one call, about: a fast one must not keep the board in it."""
SYSTEM_BUFFER = 128 * 1024
"""Bytes that the system is asked to keep on their way to one reader."""
POLL_S = 0.005
FIRST_PORT = 4001
"""Where no port is given: this one, or the next of ``PORTS_TRIED`` that is free. Serial device servers use it
for their first port, and a terminal program's saved session finds the board again."""
PORTS_TRIED = 16


# -- One reader ---------------------------------------------------------------------------------------------


class Coding:
    """How bytes of the line look in the connection of one reader: as they are."""

    def encode(self, data: bytes) -> bytes:
        """Return what to send for ``data``."""
        return data

    def decode(self, data: bytes) -> tuple[bytes, bytes]:
        """Return what ``data`` types to the board, and what the other end is to be answered.

        Raises ValueError when it breaks the protocol.
        """
        return data, b""

    def ready(self) -> bool:
        """Return whether the reader has set itself up, and can be given the board's text."""
        return True

    def takes_back(self) -> bool:
        """Return whether the reader has asked, since the last call, to forget what it has not been sent."""
        return False


class Reader:
    """One connection, which never blocks; ``backlog`` holds what the board has printed for it."""

    def __init__(self, connection: socket.socket, coding: Coding) -> None:
        connection.setblocking(False)
        with contextlib.suppress(OSError):
            connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            connection.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, SYSTEM_BUFFER)
        self.backlog = Backlog(BACKLOG_LIMIT)
        self.coding = coding
        self.gone = False
        self._socket = connection
        self._encoded = b""  # on its way into the socket

    def unread(self) -> int:
        """Return how many bytes have not been handed to the system."""
        return len(self.backlog) + len(self._encoded)

    def receive(self) -> bytes:
        """Return one piece of what it has sent to the board, b"" if there is none or it has left."""
        if self.gone or len(self._encoded) > CHUNK:  # it asks much and reads no answer: first that
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
        """Hand the system what it has room for."""
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
        """End the connection; what the system has taken still arrives.

        Closed with input unread, a connection would be reset, and its other end lose what is under way.
        """
        with contextlib.suppress(OSError):
            self._socket.shutdown(socket.SHUT_WR)
            for _ in range(INBOX_LIMIT // CHUNK):
                if not self._socket.recv(CHUNK):
                    break
        self._socket.close()


# -- The link -----------------------------------------------------------------------------------------------


class TcpLink:
    """Readers connect to ``port`` of 127.0.0.1; None for the usual one, 0 for any that is free.

    Raises LinkError if the port cannot be had.
    """

    kind = "tcp"
    first_port = FIRST_PORT

    def __init__(self, port: int | None = None) -> None:
        self._listener = _listen(self.kind, self.first_port, port)
        self._listener.setblocking(False)
        self.port: int = self._listener.getsockname()[1]
        self._readers: list[Reader] = []
        self._had_reader = False
        self._first = Backlog(FIRST_LIMIT)  # printed before the first reader came
        self._inbox = Backlog(INBOX_LIMIT)
        self._lost_absent = 0
        self._lost_slow = 0
        self._left_unread = 0
        self._refused = 0
        self._closed = False

    @property
    def address(self) -> str:
        """Return where it is, as ``fcu terminal`` takes it."""
        return f"{self.kind}:{self.port}"

    def send(self, data: bytes) -> None:
        """Queue ``data`` for every reader, and hand the system what it has room for."""
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
        """Return what the readers have sent."""
        if self._closed:
            return b""
        self._follow_readers()
        for reader in self._readers:
            reader.write()
        return self._inbox.take(most)

    def flush(self, timeout_s: float) -> None:
        """Wait until the system has taken everything for the readers that are connected."""
        if self._closed:
            return
        patience = Patience(timeout_s)
        while (left := self._untaken()) and (wait_s := patience.wait_s(left)):
            time.sleep(min(POLL_S, wait_s))

    def close(self) -> None:
        """Close the port and all connections; what the system has not taken is lost."""
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
        """Return the port and, for each usual terminal program, the command to paste."""
        return [
            f"serial: TCP port {self.port} of {HOST}, connection type raw; open it with one of",
            *(f"  {command}" for command in programs.for_tcp(self.port)),
        ]

    def report(self) -> list[str]:
        """Return a line if bytes were lost, and one if readers were turned away."""
        lines = losses(
            self.address,
            (self._lost_absent, "while nobody was connected"),
            (self._lost_slow, "because a reader was too slow"),
            (self._left_unread, "that readers left unread"),
        )
        if self._refused:
            lines.append(
                f"serial: {self.address} has turned {self._refused} away: {MOST_READERS} were connected"
            )
        return lines

    def undelivered(self) -> int:
        """Return how many bytes a reader was too slow for; what nobody was there to read is none of them."""
        return self._lost_slow

    def coding(self) -> Coding:
        """Return how the bytes look to a reader that has just come."""
        return Coding()

    def _follow_readers(self) -> None:
        """Notice readers' coming and going, and take in what they have sent."""
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
                if error.errno in (errno.ECONNABORTED, errno.EPROTO):  # it has given up already: the next
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
    """The port in ``tcp:PORT``. Raises LinkError."""
    if not text.isascii() or not text.isdigit() or len(text) > 5 or int(text) > LARGEST_PORT:
        problem = f"no port; give a number up to {LARGEST_PORT}, 0 for a free one"
        raise LinkError(f"--serial {kind}:{text}: {problem}", kind="no_port")
    return int(text)
