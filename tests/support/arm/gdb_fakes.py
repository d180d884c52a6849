"""A target for tests of the debugger's server: a core that only counts, 1 ns an instruction of two bytes.

At the addresses of ``stores`` it writes a word to RAM; at ``LOOP_END`` it jumps back to ``START``.
"""

from __future__ import annotations

import select
import socket
from collections.abc import Callable

from fcu_emulator.emulator.chip.gdb.description import REGISTERS
from fcu_emulator.emulator.chip.gdb.packets import Framer, Received, frame
from fcu_emulator.emulator.chip.gdb.server import GdbServer
from fcu_emulator.emulator.chip.gdb.session import GdbSession
from fcu_emulator.emulator.chip.gdb.target import HaltReason, Point, PointKind
from fcu_emulator.emulator.chip.memory_map import FLASH, FLASH_SIZE, RAM, RAM_SIZE
from fcu_emulator.emulator.host.loopback import HOST

START, LOOP_END = FLASH + 0x200, FLASH + 0x300
INSTRUCTION_PS = 1000


class FakeTarget:
    def __init__(self) -> None:
        self.registers = {part: 0 for register in REGISTERS for part in register.parts}
        self.registers["pc"] = START
        self.flash, self.ram = bytearray(b"\xff" * FLASH_SIZE), bytearray(RAM_SIZE)
        self.stores: dict[int, int] = {}
        self.points: set[Point] = set()
        self.now_ps = 0
        self._steps: int | None = None
        self._skip = False

    def attach(self) -> None:
        self.halt()

    def release(self) -> None:
        self.points.clear()
        self.resume()

    def halt(self) -> None:
        self._steps = None

    def read_registers(self) -> dict[str, int]:
        return dict(self.registers)

    def write_register(self, name: str, value: int) -> None:
        self.registers[name] = value

    def _place(self, address: int) -> tuple[bytearray, int]:
        for memory, base in ((self.flash, FLASH), (self.ram, RAM)):
            if base <= address < base + len(memory):
                return memory, address - base
        return bytearray(), 0

    def read_memory(self, address: int, size: int) -> bytes:
        memory, at = self._place(address)
        return bytes(memory[at : at + size])

    def write_memory(self, address: int, data: bytes) -> bool:
        memory, at = self._place(address)
        if at + len(data) > len(memory):
            return False
        memory[at : at + len(data)] = data
        return True

    def add(self, point: Point) -> None:
        self.points.add(point)

    def remove(self, point: Point) -> None:
        self.points.discard(point)

    def resume(self) -> None:
        self._steps, self._skip = None, True

    def step(self) -> None:
        self._steps, self._skip = 1, True

    @property
    def can_reverse(self) -> bool:
        return False

    def reverse_step(self) -> bool:
        return False

    def reverse_continue(self, is_interrupted: Callable[[], bool]) -> HaltReason | None:
        del is_interrupted
        return None

    def take_remark(self) -> str:
        return ""

    def run_until_ps(self, at_ps: int) -> HaltReason | None:
        while self.now_ps + INSTRUCTION_PS <= at_ps:
            pc = self.registers["pc"]
            stop = self._break_at(pc)
            if stop is not None:
                return stop
            self._skip = False
            self.now_ps += INSTRUCTION_PS
            self.registers["pc"] = START if pc == LOOP_END else pc + 2
            stop = self._store(pc)
            if stop is not None:
                return stop
            if self._steps is not None:
                self._steps = None
                return HaltReason()
        return None

    def _break_at(self, pc: int) -> HaltReason | None:
        found = [point for point in self.points if point.kind.is_break and point.address == pc]
        return HaltReason(found[0], pc) if found and not self._skip else None

    def _store(self, pc: int) -> HaltReason | None:
        address = self.stores.get(pc)
        if address is None:
            return None
        self.write_memory(address, self.now_ps.to_bytes(8, "little")[:4])
        watching = {PointKind.WRITE, PointKind.ACCESS}
        found = [
            point
            for point in self.points
            if point.kind in watching and point.address <= address < point.address + point.size
        ]
        return HaltReason(found[0], address) if found else None


class Debugger:
    """A debugger without a socket, which records the packets that the server sends."""

    def __init__(self, target: FakeTarget) -> None:
        self.target = target
        self.sent: list[bytes] = []
        self.commands: list[str] = []
        self.session = GdbSession(target, self._monitor, self.sent.append)

    def _monitor(self, command: str) -> str:
        self.commands.append(command)
        return f"done: {command}\n"

    def ask(self, packet: bytes) -> bytes:
        """Send a packet, and return its only answer."""
        before = len(self.sent)
        self.session.handle(packet)
        (reply,) = self.sent[before:]
        return reply

    def go(self, packet: bytes, for_ps: int = 10_000_000) -> bytes:
        """Let the target run and return its stop reply, or an empty reply if it still runs."""
        before = len(self.sent)
        self.session.handle(packet)
        stop = self.target.run_until_ps(self.target.now_ps + for_ps)
        if stop is not None:
            self.session.stopped(stop)
        return b"".join(self.sent[before:])


def framed(*payloads: bytes) -> bytes:
    """Return packets in the form in which a debugger sends them."""
    return b"".join(frame(payload) for payload in payloads)


class Client:
    """A debugger on a socket in the thread of the server, which it calls while it waits."""

    def __init__(self, server: GdbServer, run: Callable[[], None]) -> None:
        self.turn = run
        self._framer = Framer()
        self._arrived: list[Received] = []
        self.raw = b""
        self.socket = socket.create_connection((HOST, server.port), timeout=30.0)
        run()

    def send(self, data: bytes) -> None:
        self.socket.sendall(data)

    def ask(self, packet: bytes) -> Received:
        """Send a packet and wait for a packet."""
        self.send(frame(packet))
        return self.wait()

    def wait(self, turns: int = 1000) -> Received:
        """Return the next packet, or b"" if the server has disconnected."""
        for _ in range(turns):
            if self._arrived:
                return self._arrived.pop(0)
            self.turn()
            if select.select([self.socket], [], [], 0)[0]:
                data = self.socket.recv(0x10000)
                if not data:
                    return b""
                self.raw += data
                self._arrived += self._framer.feed(data)
        raise AssertionError(f"no packet in {turns} turns of the server")

    def close(self) -> None:
        self.socket.close()
