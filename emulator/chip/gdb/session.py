"""A debugger's session ("Packets", "General Query Packets", "Stop Reply Packets").

The answers to errors are E01 for a malformed packet, E02 for an impossible request, and the empty
packet for an unsupported request.

Decision: the Z packets of software and hardware breakpoints have the same effect and do not change
memory. At most 1000 breakpoints and watchpoints can be set.
"""

from __future__ import annotations

from collections.abc import Callable
from enum import Enum
from typing import Final

from fcu_emulator.emulator.chip.gdb import packets
from fcu_emulator.emulator.chip.gdb.description import DOCUMENTS, REGISTERS, GdbRegister
from fcu_emulator.emulator.chip.gdb.packets import LONGEST, MALFORMED, MOST_BYTES, OK, REFUSED, MalformedError
from fcu_emulator.emulator.chip.gdb.target import HaltReason, Point, PointKind, Target
from fcu_emulator.emulator.chip.memory_map import FLASH, FLASH_SIZE

# -- registers and memory ("Packets") -----------------------------------------------------------------------


class StatePackets:
    """Answers packets about registers and memory of a stopped target. Raises MalformedError."""

    def __init__(self, target: Target) -> None:
        self._target = target
        self.commands: Final[dict[bytes, Callable[[bytes], bytes]]] = {
            b"g": self._read_all,
            b"G": self._write_all,
            b"p": self._read_one,
            b"P": self._write_one,
            b"m": self._read_memory,
            b"M": lambda text: self._write_memory(text, binary=False),
            b"X": lambda text: self._write_memory(text, binary=True),
        }

    def _read_all(self, text: bytes) -> bytes:
        del text
        values = self._target.read_registers()
        return b"".join(_to_hex(register, values) for register in REGISTERS)

    def _write_all(self, text: bytes) -> bytes:
        data = packets.from_hex(text)
        if len(data) != sum(register.size for register in REGISTERS):
            raise MalformedError
        at = 0
        for register in REGISTERS:
            self._write(register, int.from_bytes(data[at : at + register.size], "little"))
            at += register.size
        return OK

    def _read_one(self, text: bytes) -> bytes:
        return _to_hex(_register(text), self._target.read_registers())

    def _write_one(self, text: bytes) -> bytes:
        which, _, value = text.partition(b"=")
        register = _register(which)
        self._write(register, packets.word(value, register.size))
        return OK

    def _write(self, register: GdbRegister, value: int) -> None:
        for part in register.parts:
            self._target.write_register(part, value & 0xFFFF_FFFF)
            value >>= 32

    def _read_memory(self, text: bytes) -> bytes:
        address, length = packets.pair(text)
        data = self._target.read_memory(address, min(length, MOST_BYTES))
        return data.hex().encode("ascii") if data or not length else REFUSED

    def _write_memory(self, text: bytes, binary: bool) -> bytes:
        address, data = packets.data_at(text, binary)
        return OK if not data or self._target.write_memory(address, data) else REFUSED

    def flash(self, text: bytes) -> bytes:
        """Answer the packets of GDB's ``load``; return b"" for other packets."""
        name, _, rest = text.partition(b":")
        if name == b"FlashErase":
            address, length = packets.pair(rest)
            return self._program(address, b"\xff" * length) if length <= FLASH_SIZE else REFUSED
        if name == b"FlashWrite":
            place, _, data = rest.partition(b":")
            return self._program(packets.number(place), data)
        return OK if text == b"FlashDone" else b""

    def _program(self, address: int, data: bytes) -> bytes:
        in_flash = address >= FLASH and address + len(data) <= FLASH + FLASH_SIZE
        return OK if in_flash and self._target.write_memory(address, data) else REFUSED


def _register(text: bytes) -> GdbRegister:
    number = packets.number(text)
    if number >= len(REGISTERS):
        raise MalformedError
    return REGISTERS[number]


def _to_hex(register: GdbRegister, values: dict[str, int]) -> bytes:
    return b"".join(values[part].to_bytes(4, "little") for part in register.parts).hex().encode("ascii")


# -- the session --------------------------------------------------------------------------------------------

EXITED: Final = b"W00"
_UNSUPPORTED = b""
_SIGINT, _SIGTRAP, _SIGSEGV = 2, 5, 11
_MAX_POINTS = 1000
_CONSOLE_CHUNK = 1000  # bytes of text in one packet
_WATCH = {PointKind.WRITE: b"watch", PointKind.READ: b"rwatch", PointKind.ACCESS: b"awatch"}


class DebuggerExit(Enum):
    """The ways in which a debugger ends its session."""

    DETACHED = "detached"
    KILLED = "killed"


class GdbSession:
    """Answers packets about one target.

    ``is_interrupted()``: whether the debugger has sent Ctrl-C. ``halted``: the target is stopped. ``ended``: how the
    debugger has ended the session, or None.
    """

    def __init__(
        self,
        target: Target,
        monitor: Callable[[str], str],
        send: Callable[[bytes], None],
        is_interrupted: Callable[[], bool] = lambda: False,
    ) -> None:
        self._target = target
        self._monitor = monitor
        self._send = send
        self._is_interrupted = is_interrupted
        self._points: set[Point] = set()
        self._stop_reply = _signal(_SIGTRAP)
        self._tells_breaks = False
        self.halted = True
        self.acknowledged = True
        self.ended: DebuggerExit | None = None
        target.attach()
        self._state = StatePackets(target)
        self._commands: dict[bytes, Callable[[bytes], bytes | None]] = {
            **self._state.commands,
            b"?": lambda _: self._stop_reply,
            b"c": lambda text: self._resume(b"c", text),
            b"C": lambda text: self._resume(b"c", text.partition(b";")[2]),
            b"s": lambda text: self._resume(b"s", text),
            b"S": lambda text: self._resume(b"s", text.partition(b";")[2]),
            b"b": self._reverse,
            b"Z": self._insert,
            b"z": self._remove,
            b"H": lambda _: OK,
            b"T": lambda text: OK if text in (b"1", b"01") else MALFORMED,
            b"D": lambda _: self._leave(DebuggerExit.DETACHED),
            b"k": lambda _: self._leave(DebuggerExit.KILLED),
            b"q": self._query,
            b"Q": self._set,
            b"v": self._long,
        }

    # -- the interface for the server -------------------------------------------------------------------

    def handle(self, packet: bytes) -> None:
        """Answer a packet; ignore the packet while the target runs."""
        if not self.halted:
            return
        command = self._commands.get(packet[:1])
        try:
            reply = command(packet[1:]) if command is not None else _UNSUPPORTED
        except MalformedError:
            reply = MALFORMED
        if reply is not None:
            self._send(reply)

    def interrupt(self) -> None:
        if not self.halted:
            self._target.halt()
            self._stopped(_signal(_SIGINT))

    def stopped(self, stop: HaltReason) -> None:
        if stop.failure:
            self._print(f"{stop.failure}\n")
            self._stopped(_signal(_SIGSEGV))
        elif stop.point is None:
            self._stopped(_signal(_SIGTRAP))
        elif stop.point.kind.is_break:
            reason = b"swbreak:;" if stop.point.kind is PointKind.SOFTWARE_BREAK else b"hwbreak:;"
            self._stopped(_signal(_SIGTRAP, reason if self._tells_breaks else b""))
        else:
            self._stopped(_signal(_SIGTRAP, b"%s:%x;" % (_WATCH[stop.point.kind], stop.address)))

    def close(self) -> None:
        self.halted = False
        self._points.clear()
        self._target.release()

    def _stopped(self, reply: bytes) -> None:
        self.halted = True
        self._stop_reply = reply
        self._send(reply)

    def _leave(self, how: DebuggerExit) -> bytes | None:
        self.ended = how
        return OK if how is DebuggerExit.DETACHED else None

    # -- running ----------------------------------------------------------------------------------------

    def _resume(self, how: bytes, address: bytes) -> None:
        if address:
            self._target.write_register("pc", packets.number(address))
        self.halted = False
        self._print(self._target.take_remark())
        if how == b"s":
            self._target.step()
        else:
            self._target.resume()

    def _reverse(self, how: bytes) -> bytes | None:
        """Answer ``bs`` and ``bc`` ("Reverse Execution")."""
        if how not in (b"s", b"c") or not self._target.can_reverse:
            return _UNSUPPORTED
        if how == b"s":
            stop = HaltReason() if self._target.reverse_step() else None
        else:
            stop = self._target.reverse_continue(self._is_interrupted)
        if stop is not None:
            self.stopped(stop)
        else:
            self._stopped(_signal(_SIGTRAP, b"replaylog:begin;"))
        return None

    def _insert(self, text: bytes) -> bytes:
        point = packets.point(text)
        if point is None:
            return _UNSUPPORTED
        if point not in self._points:
            if len(self._points) >= _MAX_POINTS:
                return REFUSED
            self._points.add(point)
            self._target.add(point)
        return OK

    def _remove(self, text: bytes) -> bytes:
        point = packets.point(text)
        if point is None:
            return _UNSUPPORTED
        if point in self._points:
            self._points.remove(point)
            self._target.remove(point)
        return OK

    # -- packets with names -----------------------------------------------------------------------------

    def _query(self, text: bytes) -> bytes | None:
        name, _, rest = text.partition(b":")
        if name == b"Supported":
            self._tells_breaks = b"hwbreak+" in rest.split(b";")
            return (
                b"PacketSize=%x;QStartNoAckMode+;qXfer:features:read+;qXfer:memory-map:read+;"
                b"hwbreak+;swbreak+;vContSupported+%s" % (LONGEST, self._reverses())
            )
        if name == b"Xfer":
            return self._transfer(rest)
        if text.startswith(b"Rcmd,"):
            return self._command(packets.from_hex(text[5:]))
        answers = {b"Attached": b"1", b"C": b"QC1", b"fThreadInfo": b"m1", b"sThreadInfo": b"l"}
        return answers.get(name, _UNSUPPORTED)

    def _reverses(self) -> bytes:
        return b";ReverseStep+;ReverseContinue+" if self._target.can_reverse else b""

    @staticmethod
    def _transfer(text: bytes) -> bytes:
        name, _, place = text.rpartition(b":")
        document = DOCUMENTS.get(name)
        if document is None:
            return _UNSUPPORTED
        offset, length = packets.pair(place)
        content = document()
        piece = content[offset : offset + min(length, MOST_BYTES)]
        return (b"l" if offset + len(piece) >= len(content) else b"m") + piece

    def _set(self, text: bytes) -> bytes:
        if text != b"StartNoAckMode":
            return _UNSUPPORTED
        self.acknowledged = False
        return OK

    def _long(self, text: bytes) -> bytes | None:
        name, _, rest = text.partition(b";")
        if name == b"Cont?":
            return b"vCont;c;C;s;S"
        if name == b"Cont":
            self._resume(packets.continues(rest), b"")
            return None
        if name == b"Kill":
            self._leave(DebuggerExit.KILLED)
            return OK
        return self._state.flash(text)

    def _command(self, text: bytes) -> bytes:
        self._print(self._monitor(text.decode("latin-1")))
        return OK

    def _print(self, text: str) -> None:
        data = text.encode("utf-8", "replace")
        for at in range(0, len(data), _CONSOLE_CHUNK):
            self._send(b"O" + data[at : at + _CONSOLE_CHUNK].hex().encode("ascii"))


def _signal(number: int, reason: bytes = b"") -> bytes:
    return b"T%02x%sthread:1;" % (number, reason)
