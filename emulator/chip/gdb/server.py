"""The debugger's TCP socket on 127.0.0.1, served between short periods of virtual time.

Decision: if the connection to a debugger breaks, the debugger counts as detached: its breakpoints
are removed, and the firmware continues.

Decision: a new connection becomes the debugger only with its first valid packet. Other connections
are closed, because any web page can send to a local port.
"""

from __future__ import annotations

import select
import socket
from collections.abc import Callable, Iterable
from contextlib import suppress

from fcu_emulator.emulator.chip.gdb.packets import ACK, MALFORMED, NACK, Arrival, Framer, Received, frame
from fcu_emulator.emulator.chip.gdb.session import EXITED, DebuggerExit, GdbSession
from fcu_emulator.emulator.chip.gdb.target import HaltReason, Target
from fcu_emulator.emulator.clock import to_ps
from fcu_emulator.emulator.errors import FirmwareError
from fcu_emulator.emulator.host.loopback import listen

_PATIENCE_S = 0.05  # wall time to wait for a packet while the target is halted
_CHUNK = 0x10000
_SEND_TIMEOUT_S = 5.0  # wall time to wait for a debugger that does not read
_MAX_CALLERS = 8  # connections that have not yet sent a packet
_CTRL_C = b"\x03"
_BEFORE_A_PACKET = b"+-\x03"  # acknowledgements, and Ctrl-C


class _Caller:
    """A connection that has not yet sent a packet."""

    def __init__(self, connection: socket.socket) -> None:
        self.socket = connection
        self.framer = Framer()
        self._in_packet = False

    def accepts(self, data: bytes) -> bool:
        if not self._in_packet:
            rest = data.lstrip(_BEFORE_A_PACKET)
            self._in_packet = rest.startswith(b"$")
            return self._in_packet or not rest
        return True

    def fileno(self) -> int:
        return self.socket.fileno()


class GdbServer:
    """Serves ``target`` on ``port``; 0 selects a free port. Raises LinkError.

    ``halted``: the target waits before its first instruction. ``killed``: the debugger has ended the
    run.
    """

    def __init__(
        self, target: Target, monitor: Callable[[str], str], port: int, halted: bool = False
    ) -> None:
        self._target = target
        self._monitor = monitor
        self._listener = listen(port, f"--gdb {port}")
        self.port: int = self._listener.getsockname()[1]
        self._callers: list[_Caller] = []
        self._client: socket.socket | None = None
        self._session: GdbSession | None = None
        self._framer = Framer()
        self._sent = b""
        self._waits = halted
        self.killed = False

    @property
    def halted(self) -> bool:
        return self._waits if self._session is None else self._session.halted

    def run_until(self, seconds: float) -> None:
        self.run_until_ps(to_ps(seconds))

    def run_until_ps(self, at_ps: int) -> None:
        """Serve the debugger, and run unless the target is halted.

        Without a debugger, this raises FirmwareError if the firmware fails.
        """
        self._serve(_PATIENCE_S if self.halted else 0.0)
        if self.halted or self.killed:
            return
        try:
            stop = self._target.run_until_ps(at_ps)
        except FirmwareError as error:
            if self._session is None:
                raise
            self._session.stopped(HaltReason(failure=str(error)))
            return
        if stop is not None and self._session is not None:
            self._session.stopped(stop)

    def close(self) -> None:
        if self._session is not None and not self._session.halted:
            self._send_packet(EXITED)
        self._leave()
        for caller in self._callers:
            caller.socket.close()
        self._callers.clear()
        self._listener.close()

    # -- the connection ---------------------------------------------------------------------------------

    def _serve(self, patience_s: float) -> None:
        waiting: list[socket.socket | _Caller] = [self._listener, *self._callers]
        if self._client is not None:
            waiting.append(self._client)
        found = select.select(waiting, [], [], patience_s)[0]
        if (
            self._client in found
        ):  # the debugger may disconnect in this step; a new connection is accepted only after the step
            found = [ready for ready in found if ready is not self._listener]
        for ready in found:
            if ready is self._listener:
                self._accept()
            elif isinstance(ready, _Caller):
                self._hear(ready)
            else:
                self._receive()

    def _accept(self) -> None:
        with suppress(OSError):  # the other side has already closed the connection
            client, _ = self._listener.accept()
            if self._client is not None:
                client.close()
                return
            client.settimeout(_SEND_TIMEOUT_S)
            client.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            self._callers.append(_Caller(client))
            if len(self._callers) > _MAX_CALLERS:
                self._hang_up(self._callers[0])

    def _hear(self, caller: _Caller) -> None:
        """Read from a connection that has not yet sent a packet."""
        if caller not in self._callers:  # another connection became the debugger
            return
        try:
            data = caller.socket.recv(_CHUNK)
        except OSError:
            data = b""
        arrivals = caller.framer.feed(data) if data and caller.accepts(data) else []
        packets = [arrived for arrived in arrivals if isinstance(arrived, bytes)]
        broken = not {Arrival.CORRUPT, Arrival.OVERLONG}.isdisjoint(arrivals)
        if not data or not caller.accepts(data) or (broken and not packets):
            self._hang_up(caller)
        elif packets:
            self._callers.remove(caller)
            while self._callers:
                self._hang_up(self._callers[0])
            self._client, self._framer, self._sent = caller.socket, caller.framer, b""
            self._session = GdbSession(self._target, self._monitor, self._send_packet, self._is_interrupted)
            self._waits = False
            self._take(arrivals)

    def _hang_up(self, caller: _Caller) -> None:
        self._callers.remove(caller)
        caller.socket.close()

    def _receive(self) -> None:
        assert self._client is not None
        try:
            data = self._client.recv(_CHUNK)
        except OSError:
            data = b""
        if not data:
            self._leave()
            return
        self._take(self._framer.feed(data))

    def _take(self, arrivals: Iterable[Received]) -> None:
        for arrived in arrivals:
            session = self._session
            if session is None:
                return
            self._answer(session, arrived)
            if session.ended is not None:
                self.killed = session.ended is DebuggerExit.KILLED
                self._leave()

    def _answer(self, session: GdbSession, arrived: Received) -> None:
        acknowledged = session.acknowledged
        if arrived is Arrival.INTERRUPT:
            session.interrupt()
        elif arrived is Arrival.RESEND:
            self._send(self._sent if acknowledged else b"")
        elif arrived is Arrival.CORRUPT:
            self._send(NACK if acknowledged else b"")
        else:
            self._send(ACK if acknowledged else b"")
            if isinstance(arrived, bytes):
                session.handle(arrived)
            else:
                self._send_packet(MALFORMED)

    def _is_interrupted(self) -> bool:
        """Return whether Ctrl-C is waiting, and remove it."""
        client = self._client
        if client is None or not select.select([client], [], [], 0)[0]:
            return False
        try:
            return client.recv(1, socket.MSG_PEEK) == _CTRL_C and bool(client.recv(1))
        except OSError:
            return True

    def _leave(self) -> None:
        session, client = self._session, self._client
        self._session = self._client = None
        if session is not None:
            session.close()
        if client is not None:
            client.close()

    def _send_packet(self, payload: bytes) -> None:
        self._sent = frame(payload)
        self._send(self._sent)

    def _send(self, data: bytes) -> None:
        if self._client is not None and data:
            try:
                self._client.sendall(data)
            except OSError:
                self._leave()
